"""One client of the rosbridge protocol, whose operations are executed in order.

The operations are in client_publications.py, client_subscriptions.py and client_services.py.
"""

from __future__ import annotations

import asyncio
import logging
import sys
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from minirospy.base.errors import BridgeError
from minirospy.core.wire.tcpros import ANY
from minirospy.web.rosbridge import protocol
from minirospy.web.rosbridge.authentication import authenticate
from minirospy.web.rosbridge.client_actions import ClientActions
from minirospy.web.rosbridge.client_publications import ClientPublications
from minirospy.web.rosbridge.client_services import ClientServices
from minirospy.web.rosbridge.client_subscriptions import ClientSubscriptions
from minirospy.web.rosbridge.operation import MAX_WAITING_BYTES, REFUSALS, Work
from minirospy.web.rosbridge.protocol import Event, OperationError, StatusLevel
from minirospy.web.rosbridge.subscription import Budget, Fragments

if TYPE_CHECKING:
    from minirospy.web.rosbridge.shared import RosbridgeShared
    from minirospy.web.server.client import WebClient

__all__ = ["RosbridgeSession"]

_log = logging.getLogger(__name__)

# Bytes of memory that a parsed operation takes per byte of text, if it contains objects or lists of numbers.
_VALUE_FACTOR = 4

# maximum bytes of a CBOR message from a read-only client: its requests are small, and each byte may decode to an object
_MAX_READ_ONLY_CBOR = 8 * 1024

_POLICY = 1008  # WebSocket close codes, RFC 6455, section 7.4
_FAILED = 1011


class _Pending(NamedTuple):
    """The rest of an operation that must wait. ``event`` is None if ``work`` reports its errors itself."""

    event: Event | None
    work: Work


class RosbridgeSession:
    """The session of one client. Its connection calls the methods on the loop.

    Operations are executed in the order of arrival: if one has to wait (for the graph, or for the subscribers of a new topic),
    later operations wait too, except for service calls.
    """

    def __init__(
        self, shared: RosbridgeShared, client: WebClient, on_end: Callable[[RosbridgeSession], None]
    ) -> None:
        """Create the session. ``on_end`` is called with the session after its client has disconnected."""
        self.client = client
        self.shared = shared
        self.graph = shared.graph
        self.connected = shared.graph.node.now()  # when the client connected, for /connected_clients
        self.budget = Budget()  # byte budget for queued messages on topics whose rate the client limits
        self.operation_size = 0  # memory of the current operation, in bytes
        # whether the current operation's message is so large that its ROS message is created in a thread
        self.is_large = False
        self._on_end = on_end
        self._level = StatusLevel.ERROR  # lowest severity of the status messages that the client receives
        self._is_authenticated = not shared.options.authenticate
        # received fragments of incomplete messages
        self._fragments = Fragments(shared.options.fragment_timeout)
        self._publications = ClientPublications(self)
        self._subscriptions = ClientSubscriptions(self)
        self._services = ClientServices(self)
        self._actions = ClientActions(self)
        # waiting operations and calls, which are cancelled when the session ends
        self._tasks: set[asyncio.Task[None]] = set()
        self._inbox: deque[str | bytes] = deque()  # messages queued behind a waiting operation
        # memory of the inbox, and of the message whose operation is waiting, in bytes
        self._inbox_size = 0
        self._is_working = False  # whether an operation is waiting
        self._handlers: Mapping[type[Event], Callable[[Any], Work | _Pending | None]] = {
            protocol.Advertise: self._publications.advertise,
            protocol.Unadvertise: self._publications.unadvertise,
            protocol.Publish: self._publications.publish,
            protocol.Subscribe: self._subscriptions.subscribe,
            protocol.Unsubscribe: self._subscriptions.unsubscribe,
            protocol.CallService: self._services.call_service,
            protocol.ServiceResponse: self._services.service_response,
            protocol.AdvertiseService: self._services.advertise_service,
            protocol.UnadvertiseService: self._services.unadvertise_service,
            protocol.SendActionGoal: self._actions.send_goal,
            protocol.CancelActionGoal: self._actions.cancel_goal,
            protocol.Fragment: self._fragment,
            protocol.SetLevel: self._set_level,
            protocol.Auth: self._auth,
        }

    # --- called by the client's connection

    def received_text(self, text: str) -> None:
        """Execute the operation in a JSON message."""
        self._received(text)

    def received_binary(self, data: bytes) -> None:
        """Execute the operation in a CBOR message."""
        if len(data) > _MAX_READ_ONLY_CBOR and not self.client.may_write:
            self._refuse_large(data)
            return
        self._received(data)

    def ended(self) -> None:
        """Release all of the client's resources."""
        self._subscriptions.close()
        self._publications.close()
        self._services.close()
        self._actions.close()
        # Release memory now: the session is in reference cycles, so the garbage collector would release it only later.
        self._inbox.clear()
        self._fragments.clear()
        for task in list(self._tasks):
            task.cancel()
        self._on_end(self)

    # --- called by the services and topics

    def send(self, fields: Mapping[str, object]) -> None:
        """Send a message that is not about a topic."""
        self.send_encoded(protocol.encode_messages(fields, "none", self.shared.options.fragment_size))

    def send_encoded(self, messages: Sequence[str | bytes]) -> None:
        """Send encoded messages: strings are JSON, bytes are CBOR."""
        for message in messages:
            if isinstance(message, bytes):
                self.client.send_binary(message)
            else:
                self.client.send_text(message)

    def status(self, level: StatusLevel, text: str, id_: object = None) -> None:
        """Send a status message if the client has requested messages of this level. Log warnings and errors."""
        if level <= self._level:
            self.client.send_text(str(protocol.encode(protocol.status(level, text, id_))))  # type: ignore[arg-type]
        if level is not StatusLevel.INFO:
            shown = text if id_ is None else f"[id: {id_}] {text}"
            self.shared.log.warning("[Client %s] %s", self.client.name, shown)

    # --- sequential execution

    def count(self) -> None:
        """Count this client's memory towards the server's budget."""
        self.client.holds(
            self._inbox_size
            + self._fragments.size
            + self.budget.taken
            + self._services.calls_size
            + self._actions.goals_size
            + self._publications.latched_size
        )

    def _received(self, data: str | bytes) -> None:
        if not self._is_working:
            self._start(self._begin(data), sys.getsizeof(data))
            return
        self._inbox.append(data)
        self._inbox_size += sys.getsizeof(data)
        if self._inbox_size > MAX_WAITING_BYTES:
            self.client.close(_POLICY, "too much waits for an earlier operation")
        self.count()

    def _start(self, first: _Pending | None, size: int) -> None:
        if first is not None:
            self._is_working = True
            self._inbox_size += size
            # If the task is cancelled before its first step, the work was never started and must be closed.
            self.spawn(self._work(first, size)).add_done_callback(lambda _: first.work.close())
            self.count()

    async def _work(self, first: _Pending, size: int) -> None:
        """Finish an operation whose message has ``size`` bytes; then execute the operations received meanwhile."""
        try:
            await self._finish(first)
            self._inbox_size -= size
            while self._inbox:
                data = self._inbox.popleft()
                size = sys.getsizeof(data)
                pending = self._begin(data)
                del data
                if pending is not None:
                    await self._finish(pending)
                self._inbox_size -= size
            self.count()
        except Exception:  # noqa: BLE001 whatever an operation raises ends this client alone, as in its connection
            _log.exception("an operation of %s could not be carried out", self.client.name)
            self.client.close(_FAILED, "the bridge failed on this message")
        self._is_working = False

    def _begin(self, data: str | bytes) -> _Pending | None:
        """Start an operation. If the operation must wait, return the rest of its work, otherwise None."""
        self.operation_size = _VALUE_FACTOR * sys.getsizeof(data)
        if not protocol.is_quick(data):
            return self._begin_large(data)
        try:
            event = protocol.parse(protocol.decode(data))
        except BridgeError as error:
            self._unreadable(error)
            return None
        return self._carry_out(event)

    def _begin_large(self, data: str | bytes) -> _Pending | None:
        """Parse a large message in a thread, so that other clients need not wait; meanwhile, do not read from this client."""
        if not self.client.may_write:
            # The message consists of fragments, or was in a PNG: the connection would have refused a message of this size.
            self._refuse_large(data)
            return None
        self.client.pause()
        return _Pending(None, self._carry_out_large(data))

    async def _carry_out_large(self, data: str | bytes) -> None:
        try:
            event = await self.shared.in_thread(lambda: protocol.parse(protocol.decode_in_pieces(data)))
        except BridgeError as error:
            self._unreadable(error)
            return
        else:
            self.is_large = True
            pending = self._carry_out(event)
            if pending is not None:
                await self._finish(pending)
        finally:
            self.is_large = False
            self.client.resume()

    def _refuse_large(self, data: str | bytes) -> None:
        what = "characters" if isinstance(data, str) else "bytes of CBOR"
        self.status(
            StatusLevel.ERROR, f"a message of {len(data)} {what} is too large: this token is read-only"
        )

    def _unreadable(self, error: BridgeError) -> None:
        self.status(StatusLevel.ERROR, str(error), error.id if isinstance(error, OperationError) else None)

    def _carry_out(self, event: Event) -> _Pending | None:
        if not self._is_authenticated and not isinstance(event, protocol.Auth):
            self.shared.log.warning("Client %s did not authenticate. Closing connection.", self.client.name)
            self.client.close(_POLICY, "authentication is required first")
            return None
        try:
            pending = self._handlers[type(event)](event)
        except REFUSALS as error:
            self._failed(event, error)
            return None
        # If ``event`` is a fragment that completes an operation, ``pending`` already contains that operation's event.
        return pending if pending is None or isinstance(pending, _Pending) else _Pending(event, pending)

    async def _finish(self, pending: _Pending) -> None:
        try:
            await pending.work
        except REFUSALS as error:
            assert pending.event is not None
            self._failed(pending.event, error)

    def _failed(self, event: Event, error: Exception) -> None:
        # rosbridge prefixes errors with the operation's name, except for errors that it detects itself.
        front = "" if isinstance(error, OperationError) else f"{_OPERATIONS[type(event)]}: "
        self.status(StatusLevel.ERROR, f"{front}{error}", event.id)

    def spawn(self, work: Work) -> asyncio.Task[None]:
        task = self.graph.spawn(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    # --- operations on the session

    def _fragment(self, event: protocol.Fragment) -> _Pending | None:
        try:
            text = self._fragments.add(event, asyncio.get_running_loop().time())
        finally:
            self.count()
        return self._begin(text) if text is not None else None

    def _set_level(self, event: protocol.SetLevel) -> None:
        self._level = event.level

    async def _auth(self, event: protocol.Auth) -> None:
        if self._is_authenticated:
            return
        if await authenticate(self.graph.node, event):
            self._is_authenticated = True
            return
        self.shared.log.warning("Client %s did not authenticate. Closing connection.", self.client.name)
        self.client.close(_POLICY, "not authenticated")

    # --- called by the handlers of operations

    async def type_of(self, topic: str) -> str:
        """Return the type of a topic in the graph. Raise BridgeError if the topic has no type."""
        resolved = self.graph.node.resolve(topic)
        if self.graph.snapshot.types.get(resolved, ANY) == ANY:
            await self.graph.look()
        found = self.graph.snapshot.types.get(resolved, ANY)
        if found == ANY:
            raise BridgeError(f"Cannot infer topic type for topic {topic} as it is not yet advertised")
        return found

    def is_allowed(self, kind: str, name: str, what: str) -> bool:
        """Return whether the globs allow a name; if not, send rosbridge's warning."""
        filters = self.graph.filters
        if (filters.topics if kind == "topics" else filters.services)(self.graph.node.resolve(name)):
            return True
        self.status(StatusLevel.WARNING, f"No match found for {what}: {name}")
        return False

    def require_write(self, what: str) -> None:
        if not self.client.may_write:
            raise BridgeError(f"{what} is not allowed: this token is read-only")


_OPERATIONS: Mapping[type[Event], str] = {
    protocol.Advertise: "advertise",
    protocol.Unadvertise: "unadvertise",
    protocol.Publish: "publish",
    protocol.Subscribe: "subscribe",
    protocol.Unsubscribe: "unsubscribe",
    protocol.CallService: "call_service",
    protocol.ServiceResponse: "service_response",
    protocol.AdvertiseService: "advertise_service",
    protocol.UnadvertiseService: "unadvertise_service",
    protocol.SendActionGoal: "send_action_goal",
    protocol.CancelActionGoal: "cancel_action_goal",
    protocol.Fragment: "fragment",
    protocol.SetLevel: "set_level",
    protocol.Auth: "auth",
}
