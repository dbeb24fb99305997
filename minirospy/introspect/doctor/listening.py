"""Check the connection between two machines in both directions: one listens, the other requests a connection back.

The listener is a service of type std_srvs/Trigger. A client that can call it has reached the listener's machine. The
response reports whether the listener's machine has reached the client's node, by subscribing to that node's topic and
receiving a message of 16 KiB. The response's message is JSON: the listener's ``host`` and ``time``, and, if the check
failed, its ``fault`` and ``text`` (otherwise "").
"""

from __future__ import annotations

import json
import socket
import time
from collections.abc import Callable, Iterator
from io import BytesIO

from minirospy.base.errors import MasterUnreachableError, MinirospyError, RpcError, RpcRefused
from minirospy.core.idl.load import service_class
from minirospy.core.wire.header import Header
from minirospy.introspect.doctor.findings import Finding, ok, problem
from minirospy.introspect.doctor.graph import Answers, node_trouble
from minirospy.introspect.doctor.master import clock_finding
from minirospy.introspect.doctor.own_node import PREFIX, DoctorNode, unreached_finding
from minirospy.introspect.doctor.reach import (
    CONNECT_SECONDS,
    Fault,
    MasterLocation,
    Trouble,
    host_port,
    in_parallel,
    look_up,
    read_topic,
    trouble_of,
)
from minirospy.introspect.graph import Graph
from minirospy.runtime.node.service_client import ServiceClient
from minirospy.runtime.rpc.master_proxy import SystemState

__all__ = ["check_listeners", "listen", "listeners"]

_SERVICE = "/connect_back"
_ANSWER_SECONDS = 6 * CONNECT_SECONDS
_PADDING = "x" * 16384


def listen(own: DoctorNode, graph: Graph, report: Callable[[Finding], object]) -> None:
    """Serve doctors on other machines: connect back to each, and call ``report`` with the result in a separate thread.

    Raise MasterUnreachableError if no master responds, or RpcError if a call fails.
    """

    def connect_back(_: memoryview, fields: Header) -> bytes:
        caller = fields.get("callerid", "")
        trouble: Trouble | None = None
        uri = ""

        try:
            uri = graph.master.lookup_node(caller)
            read_topic(uri, caller + "/letter", own.name, wait=True)
        except (MasterUnreachableError, RpcError, MinirospyError, OSError) as error:
            trouble = trouble_of(error)

        where = host_port(uri)[0] or caller

        if trouble:
            text = (
                f"it reaches this machine, and this one does not reach it at {uri or caller}: {trouble.text}"
            )
            report(problem("both directions", f"{where}: {text}", "see there what to do"))
        else:
            report(
                ok("both directions", f"{where} ({caller}): it reaches this machine, and this one reaches it")
            )

        answer = {
            "host": socket.gethostname(),
            "time": time.time(),
            "fault": trouble.fault.value if trouble else "",
            "text": trouble.text if trouble else "",
            "padding": _PADDING,
        }
        response = service_class("std_srvs/Trigger")._response_class(trouble is None, json.dumps(answer))
        buffer = BytesIO()
        response.serialize(buffer)
        return buffer.getvalue()

    own.serve(own.name + _SERVICE, connect_back)


def listeners(state: SystemState, answers: Answers) -> Answers:
    """Return the responses of the doctors that serve others (`minirospy doctor --listen`)."""
    return {node: answer for node, answer in answers.items() if node + _SERVICE in state.services}


def check_listeners(
    own: DoctorNode, graph: Graph, answers: Answers, place: MasterLocation
) -> Iterator[Finding]:
    """Call the listening doctors; yield one or two findings for each."""
    services = [
        node + _SERVICE for node, answer in answers.items() if node.startswith(PREFIX) and not answer.trouble
    ]

    def ask(service: str) -> tuple[str, float, str, float]:
        uri = graph.master.lookup_service(service)
        look_up(host_port(uri)[0])
        before = time.time()
        return uri, before, _call(uri, service, own.name), time.time()

    for service, result in zip(services, in_parallel(ask, services, _ANSWER_SECONDS), strict=True):
        if isinstance(result, RpcRefused):
            continue  # no such service: that doctor runs without --listen
        if isinstance(result, Exception):
            here = trouble_of(result)
            host = host_port(graph.node_uri(service.removesuffix(_SERVICE)) or "")[0]
            text, advice = node_trouble(host, here, place)
            yield problem(
                "both directions", f"the doctor that listens at '{host}' is not reached: {text}", advice
            )
            continue
        uri, before, text, after = result
        host = host_port(uri)[0]
        try:
            answer = json.loads(text)
            theirs, fault = float(answer["time"]), str(answer["fault"])
            name = host if answer["host"] == host else f"{answer['host']} ({host})"
            trouble = Trouble(Fault(fault), str(answer["text"])) if fault else None
        except (ValueError, KeyError, TypeError):
            yield problem(
                "both directions", f"{service} did not answer as a doctor: {text[:80]}", "end that node"
            )
            continue
        if trouble:
            yield unreached_finding(own, name, host, trouble)
        else:
            yield ok("both directions", f"this machine reaches {name}, and {name} this one")
            yield clock_finding(name, theirs, before, after)


def _call(uri: str, service: str, caller_id: str) -> str:
    """Call a listening doctor's service; return the message in the response.

    Raise OSError if the connection fails, WireError if the response is invalid.
    """
    type_ = service_class("std_srvs/Trigger")
    client = ServiceClient(uri, service, type_._md5sum, caller_id, timeout=CONNECT_SECONDS, same_host=False)
    try:
        response = type_._response_class()
        response.deserialize(client.call(b""))
    finally:
        client.close()
    return str(getattr(response, "message"))  # noqa: B009 - a field that the Protocol lacks
