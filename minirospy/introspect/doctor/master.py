"""Check the master: whether it responds, which machine is at fault if not, and how far its clock is off."""

from __future__ import annotations

import re
import socket
import time
from collections.abc import Iterator

from minirospy.base.errors import MasterUnreachableError, RpcError, RpcFault
from minirospy.core.wire.http import serialize_request
from minirospy.core.wire.xmlrpc import serialize_call
from minirospy.introspect.doctor.findings import Finding, ok, problem, warning
from minirospy.introspect.doctor.reach import (
    CONNECT_SECONDS,
    RESUME,
    Fault,
    MasterLocation,
    Trouble,
    trouble_of,
)
from minirospy.runtime.rpc.master_proxy import MasterProxy

__all__ = ["check_clock", "check_master", "clock_finding"]

_FEEL_SECONDS = 0.1  # clock difference in seconds that starts to affect tf

_WRONG_SECONDS = 1.0


def check_master(master: MasterProxy, place: MasterLocation) -> Iterator[Finding]:
    """Yield a finding that the master responds, or a problem if it does not."""
    if not place.addresses:
        yield problem(
            "master",
            f"this machine does not know the name '{place.host}' of ROS_MASTER_URI={master.uri}",
            f"use the address of that machine, or add '{place.host}' to the hosts file of this one",
        )
        return

    try:
        pid = f", pid {master.get_pid()}"
    except RpcFault:
        pid = ""  # this master is another implementation, which has no getPid
    except (MasterUnreachableError, RpcError) as error:
        yield _unreachable(master.uri, place, trouble_of(error))
        return

    status = _status(master)
    name = (
        f"minirospy {status['version']}" if "version" in status else "rosmaster" if pid else "a foreign one"
    )
    yield ok("master", f"{master.uri} answers: {name}{pid}")


def check_clock(master: MasterProxy, place: MasterLocation) -> Iterator[Finding]:
    """Yield a finding on how far the master's clock is from the local one, or nothing for a master on this machine."""
    if place.is_local:
        return
    before = time.time()
    theirs = _status(master).get("time")
    after = time.time()
    if isinstance(theirs, float):
        yield clock_finding(f"the master's machine ({place.host})", theirs, before, after)
        return
    seconds = _http_date(place)
    if seconds is None:
        yield ok("clock", f"{place.host} does not report its time: compare `date` on both machines")
        return
    # The header's time is rounded down to a full second.
    yield clock_finding(f"the master's machine ({place.host})", seconds, time.time() - 1.0, time.time())


def clock_finding(who: str, theirs: float, before: float, after: float) -> Finding:
    """Compare the local clock with ``theirs``, a remote time read between the local times ``before`` and ``after``."""
    difference = theirs - after if theirs > after else min(0.0, theirs - before)
    if abs(difference) < _FEEL_SECONDS:
        return ok("clock", f"that of {who} is the same")
    text = f"that of {who} is {abs(difference):.1f} s {'ahead of' if difference > 0 else 'behind'} this one"
    advice = (
        "let both follow one time server (chrony, ntp): stamps and transforms of one are wrong for the other"
    )
    return (problem if abs(difference) >= _WRONG_SECONDS else warning)("clock", text, advice)


def _unreachable(uri: str, place: MasterLocation, trouble: Trouble) -> Finding:
    where = uri if place.host == place.addresses[0] else f"{uri} ({place.addresses[0]})"

    if place.is_local:
        if trouble.fault is Fault.REFUSED:
            return problem(
                "master",
                f"none runs on this machine at {where}",
                "start `roscore`, or set ROS_MASTER_URI to the machine where it runs",
            )
    elif trouble.fault is Fault.REFUSED:
        return problem(
            "master",
            f"{place.host} is there, but nothing listens at {where}",
            f"start `roscore` on {place.host}; if it runs, it listens on loopback alone, since ROS_IP or ROS_HOSTNAME is "
            "that there, or on another port",
        )
    elif trouble.fault is Fault.SILENT:
        return problem(
            "master",
            f"nothing comes back from {where}",
            f"see that {place.host} is on and has that address (`ping {place.host}`); if it answers, its firewall drops "
            f"what comes to TCP port {place.port}",
        )
    elif trouble.fault is Fault.NO_ROUTE:
        return problem(
            "master",
            f"no way leads to {where}: {trouble.text}",
            "see that both machines are in one network, and that no firewall refuses",
        )

    if trouble.fault is Fault.LATE:
        return problem("master", f"{where} accepts connections, but does not answer ({trouble.text})", RESUME)
    if trouble.fault is Fault.STRANGER:
        return problem(
            "master",
            f"what answers at {where} is not a ROS master: {trouble.text}",
            "correct the port in ROS_MASTER_URI, or end that program",
        )

    return problem("master", f"{where}: {trouble.text}", "see docs/network.md")


def _status(master: MasterProxy) -> dict[str, object]:
    """Return the status provided by minirospy's master, or {} for any other master."""
    try:
        found = master.call("minirospy.status")
    except (RpcFault, RpcError):
        return {}
    return found if isinstance(found, dict) else {}


def _http_date(place: MasterLocation) -> float | None:
    """Return the time in the HTTP Date header, which Python's HTTP servers send, or None without this header."""
    from email.utils import parsedate_to_datetime

    request = serialize_request(place.host, "/RPC2", serialize_call("getPid", ("/doctor",)))
    try:
        with socket.create_connection((place.addresses[0], place.port), CONNECT_SECONDS) as sock:
            sock.sendall(request)
            answer = b""
            while b"\r\n\r\n" not in answer and (more := sock.recv(4096)):
                answer += more
        (date,) = re.findall(
            rb"^date:(.*)\r$", answer.partition(b"\r\n\r\n")[0] + b"\r", re.MULTILINE | re.IGNORECASE
        )
        return parsedate_to_datetime(date.decode("latin-1").strip()).timestamp()
    except (OSError, ValueError):
        return None
