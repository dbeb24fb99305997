"""Check a machine that the user names: whether it is reachable, and whether a doctor there tests the return path."""

from __future__ import annotations

import socket
from collections.abc import Iterator

from minirospy.introspect.doctor.findings import Finding, ok, problem, warning
from minirospy.introspect.doctor.graph import Answers
from minirospy.introspect.doctor.reach import (
    CONNECT_SECONDS,
    Fault,
    addresses,
    addresses_of,
    host_port,
    is_own_address,
    own_address_towards,
    trouble_of,
)

__all__ = ["check_listens", "check_machine"]


def check_machine(host: str, port: int) -> Iterator[Finding]:
    """Yield a finding on whether this machine can connect to ``port``, the master's port, on ``host``."""
    known = addresses(host)
    if not known:
        yield problem(
            "other machine",
            f"this machine does not know the name '{host}'",
            f"give the address of that machine, or add '{host}' to the hosts file of this one",
        )
        return

    where = host if host == known[0] else f"{host} ({known[0]})"
    if is_own_address(known[0]):
        yield ok("other machine", f"{where} is this machine")
        return

    heard = f"a server listens at its port {port}"

    try:
        socket.create_connection((known[0], port), CONNECT_SECONDS).close()
    except OSError as error:
        trouble = trouble_of(error)
        if trouble.fault is not Fault.REFUSED:
            yield problem(
                "other machine",
                f"nothing comes back from {where}"
                if trouble.fault is Fault.SILENT
                else f"no way leads to {where}: {trouble.text}",
                f"see that it is on, in this network, and has that address (`ping {host}`); if it answers, its firewall "
                f"drops what comes to TCP port {port}",
            )
            return
        heard = f"it answers, and no master listens at its port {port}"

    yield ok(
        "other machine", f"{where} is reached: {heard}; this machine is {own_address_towards(known[0])} to it"
    )


def check_listens(host: str, listeners: Answers, master_uri: str) -> Iterator[Finding]:
    """Yield a warning if none of the ``listeners`` (listening doctors) runs on ``host``."""
    theirs = [host_port(answer.node.uri or "")[0] for answer in listeners.values()]
    known = addresses_of([host, *theirs])
    here = {host, *known[host]}
    if not known[host] or is_own_address(known[host][0]):
        return  # check_machine() has already reported this case
    if not any(here & {name, *known[name]} for name in theirs):
        yield warning(
            "both directions",
            f"no doctor listens on {host}, so the return path was not checked",
            f"type `minirospy doctor --listen` there, with ROS_MASTER_URI={master_uri}, and this once more",
        )
