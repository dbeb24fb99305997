"""The doctor's own node. It shows whether other machines, above all the master's, can reach nodes on this machine.

It is a normal node while the doctor runs: peers that reach it also reach the user's nodes.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Collection, Iterator
from types import TracebackType

from minirospy.base import names
from minirospy.base.clock import SignalSafeCondition, SignalSafeEvent
from minirospy.base.environment import Environment
from minirospy.base.errors import MasterUnreachableError, RpcError
from minirospy.core.idl.load import message_class, service_class
from minirospy.core.wire.framing import serialize_frame
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.introspect.doctor.findings import Finding, ok, problem
from minirospy.introspect.doctor.reach import (
    CONNECT_SECONDS,
    Fault,
    Trouble,
    addresses,
    host_port,
    own_address_towards,
    trouble_of,
)
from minirospy.runtime.node.node import Node
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.node.services import Handler
from minirospy.runtime.rpc.master_proxy import SlaveProxy
from minirospy.runtime.transport.links import OutLink
from minirospy.runtime.transport.loop import LoopThread

__all__ = ["PREFIX", "DoctorNode", "check_own_address", "check_way_back", "unreached_finding"]

PREFIX = "/minirospy_doctor"  # prefix of the names of the doctors' nodes

_LETTER_BYTES = 16 * 1024
"""Message size in bytes, larger than a packet: some tunnels drop every packet that exceeds their size limit."""

_log = logging.getLogger(__name__)


class DoctorNode:
    """Context manager that starts a node. After :meth:`register`, the node publishes a latched message.

    Entering raises OSError if no server can be opened at this machine's address.
    """

    def __init__(self, environment: Environment) -> None:
        self.environment = environment
        self.name = names.anonymous_name(PREFIX)
        self.letter = self.name + "/letter"
        self.told_by_master = SignalSafeEvent()
        """Set once the master has called this node."""
        self._loop = LoopThread("minirospy-doctor")
        self.node = _NotifiedNode(self.name, environment, self.told_by_master)
        self._log_links = SignalSafeCondition()
        self._listeners: set[str] = set()

    def __enter__(self) -> DoctorNode:
        try:
            self._loop.run(self.node.start())
        except BaseException:
            # Ctrl-C may have interrupted the start after the node's servers were opened.
            self._loop.run(self.node.close())
            self._loop.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._loop.run(self._leave(), 3.0)
        except TimeoutError:
            _log.debug("the master did not answer at the end")
        self._loop.close()

    def register(self) -> None:
        """Register the node's topics: ``letter``, which has a test message, and /rosout, which every node publishes.

        Raise MasterUnreachableError if no master responds, or RpcError if the call fails.
        """
        self._loop.run(self._register())

    def serve(self, name: str, handler: Handler) -> None:
        """Provide a std_srvs/Trigger service.

        Raise MasterUnreachableError if no master responds, or RpcError if the call fails.
        """
        type_ = service_class("std_srvs/Trigger")
        server = self.node.make_service(
            name,
            InterfaceType.of(type_),
            handler,
            request_type=type_._request_class._type,
            response_type=type_._response_class._type,
        )
        self._loop.run(self.node.serve(server))

    def wait_for_log_listeners(self, wanted: Collection[str], timeout: float) -> set[str]:
        """Wait up to ``timeout`` seconds; return the nodes in ``wanted`` that have not connected to this node's /rosout."""
        self._log_links.wait_for(lambda: self._listeners.issuperset(wanted), timeout)
        return set(wanted) - self._listeners

    async def _register(self) -> None:
        # Subscribe before advertising, so that the master must send this node a publisherUpdate about itself.
        await self.node.master("registerSubscriber", self.letter, "std_msgs/String", self.node.uri)
        text = message_class("std_msgs/String")
        letter = Publication(self.letter, InterfaceType.of(text), latch=True)
        body = b"x" * _LETTER_BYTES
        # A serialized std_msgs/String is a length followed by bytes, like a frame.
        letter.publish(serialize_frame(serialize_frame(body)))
        log = message_class("rosgraph_msgs/Log")
        type_ = InterfaceType.of(log)
        await self.node.advertise(letter)
        await self.node.advertise(Publication("/rosout", type_, on_link=self._link_changed))

    async def _leave(self) -> None:
        try:
            if self.node.publications:
                await self.node.master("unregisterSubscriber", self.letter, self.node.uri)
        except (MasterUnreachableError, RpcError) as error:
            _log.debug("leaving: %s", error)
        finally:
            await self.node.close()

    def _link_changed(self, link: OutLink, is_up: bool) -> None:
        if is_up:
            self._listeners.add(link.peer)
            self._log_links.notify_all()


class _NotifiedNode(Node):
    """A node that records whether the master has called its Slave API."""

    def __init__(self, name: str, environment: Environment, notified: threading.Event) -> None:
        super().__init__(name, environment)
        self._notified = notified

    def publishers_changed(self, topic: str, uris: list[str]) -> None:
        self._notified.set()


def check_own_address(own: DoctorNode) -> Iterator[Finding]:
    """Yield a finding on whether this machine can reach its own nodes at their advertised address."""
    host, ports = own.environment.host, own.environment.ports
    slave = SlaveProxy(own.node.uri, own.name, CONNECT_SECONDS, same_host=False)
    try:
        slave.get_pid()
    except RpcError as error:
        yield problem(
            "own address",
            f"this machine does not reach its own node at '{host}': {trouble_of(error).text}",
            "set ROS_IP to an address of this machine, or unset ROS_IP and ROS_HOSTNAME",
        )
    else:
        which = f"ports {ports[0]}-{ports[-1]}" if ports else "any port"
        yield ok(
            "own address", f"nodes of this machine are at '{host}' ({which}), and reach each other there"
        )
    finally:
        slave.close()


def check_way_back(own: DoctorNode, master_host: str, log_listeners: Collection[str]) -> Iterator[Finding]:
    """Yield findings on whether the master calls this node, and whether the subscribers of /rosout connect to it."""
    if not own.told_by_master.wait(CONNECT_SECONDS):
        yield unreached_finding(own, f"the master's machine ({master_host})", master_host, None)
        return
    missing = own.wait_for_log_listeners(log_listeners, CONNECT_SECONDS)
    if missing:
        yield problem(
            "return path",
            f"the master reaches this machine, but {', '.join(sorted(missing))} gets no topic from it",
            f"a firewall lets only some ports through: open TCP port {own.node.tcpros_port} too (see MINIROSPY_PORTS)",
        )
    else:
        yield ok("return path", f"the master's machine ({master_host}) reaches nodes of this one")


def unreached_finding(own: DoctorNode, who: str, their_host: str, trouble: Trouble | None) -> Finding:
    """Return the finding that another machine (``who``, at ``their_host``) cannot reach this node."""
    host, port = host_port(own.node.uri)
    known = addresses(their_host)
    ours = own_address_towards(known[0]) if known else ""
    text = f"{who} does not reach this one at {host}:{port}" + (f": {trouble.text}" if trouble else "")
    export = f"export ROS_IP={ours or '<the address by which it reaches this machine>'}"
    firewall = (
        f"a firewall keeps it from TCP ports {port} and {own.node.tcpros_port} of this machine: open them, or set "
        "MINIROSPY_PORTS to ports that are open"
    )
    if host == ours:
        return problem("return path", text, firewall)
    if ours not in addresses(host):
        return problem("return path", text, export)
    if trouble and trouble.fault is not Fault.NAME:
        return problem("return path", text, f"{firewall}; or it takes '{host}' for another machine: {export}")
    return problem("return path", text, export if trouble else f"{export}; if that does not do, {firewall}")
