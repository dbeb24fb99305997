"""The subscribing end of a topic: a Subscription receives frames from its links, one to each publisher.

It works on bytes; ``minirospy.client`` and ``minirospy.aio`` handle the message classes.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial
from itertools import islice

from minirospy.base.errors import HandshakeRefused, RpcError, ThreadLimitError, WireError
from minirospy.base.steps import Steps
from minirospy.core.graph.subscription import MAX_PUBLISHERS, Connect, Disconnect, SubscriptionPlan
from minirospy.core.wire.framing import CHUNK, Frame
from minirospy.core.wire.header import Header, serialize_header
from minirospy.core.wire.tcpros import InterfaceType, check_publisher, subscriber_header
from minirospy.runtime.node.unreachable import Unreachable, advice
from minirospy.runtime.rpc.async_client import AsyncRpcClient
from minirospy.runtime.transport import local, shared_memory, sockets, tcp
from minirospy.runtime.transport.limits import explain, is_file_limit
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger
from minirospy.runtime.transport.readers import ReaderSet, read_frames, watch_frames, watch_frames_in_turns
from minirospy.runtime.transport.workers import Workers

__all__ = ["Deliver", "InLink", "InTurns", "Subscription"]

_log = logging.getLogger(__name__)

SETTLE_SECONDS = 10.0  # seconds within which all nodes register again with a master that has lost its state

# failed connections before a publisher is reported; a publisher that is shutting down unregisters before that
_WARN_AFTER = 3

# maximum number of log lines about publishers that send invalid responses; further lines are only counted
_REFUSALS_LOGGED = 10

_LEAVE_SECONDS = 10.0
# a link counts as working once it has received a message, or has been open for this many seconds
_WORKED_SECONDS = 5.0

Deliver = Callable[[Frame, Header], None]
"""A function that is called with each message's bytes and the publisher's connection header."""


@dataclass(frozen=True)
class InTurns:
    """Delivers messages of up to ``max_bytes`` in steps on the loop: ``start`` runs the steps from ``deliver``.

    A longer message is skipped, and ``on_left_out`` is called with its publisher's connection header.
    """

    deliver: Callable[[Frame, Header], Steps[None]]
    start: Callable[[Steps[None]], None]
    max_bytes: int
    on_left_out: Callable[[Header], None]


@dataclass(eq=False)
class InLink:
    """The subscriber's end of one connection. ``uri`` is the URI of the publisher's Slave API."""

    uri: str
    address: str
    sock: socket.socket
    header: Header
    received: int = 0
    received_bytes: int = 0
    closed: bool = field(default=False)
    latched: Frame | None = None  # the last message from a latching publisher
    shares_memory: bool = False  # the header declared that this process can map the publisher's memory
    since: float = field(default_factory=time.monotonic)
    fault: Exception | None = None
    # True if the master's list dropped the publisher and listed it again while the link was open
    returned: bool = False

    @property
    def number(self) -> int:
        """The link's number within the node: its file descriptor."""
        return self.sock.fileno()

    @property
    def transport(self) -> str:
        """The name of the transport protocol."""
        return "TCPROS" if self.sock.family in sockets.FAMILIES else local.PROTOCOL

    @property
    def local_port(self) -> int:
        """The local port, or 0 if there is none or the socket is closed."""
        try:
            return int(self.sock.getsockname()[1]) if self.transport == "TCPROS" else 0
        except OSError:
            return 0

    def close(self) -> None:
        """Shut the connection down, so that the reader stops and closes the socket."""
        self.closed = True
        sockets.hang_up(self.sock)


class Subscription:
    """A topic that this node subscribes to: one connection to each publisher, re-established when it breaks.

    A separate worker reads each connection and calls ``deliver``, so that messages from one publisher stay in order, and
    neither topics nor publishers delay each other. With ``on_loop``, ``deliver`` is called on the loop instead and must
    return quickly; for longer work pass an :class:`InTurns`. ``newest`` may be changed at any time: if more messages arrive
    during a delivery, only the newest ``newest`` are delivered (0: all).
    """

    def __init__(
        self,
        topic: str,
        type_: InterfaceType,
        caller_id: str,
        deliver: Deliver | InTurns,
        *,
        rpc: AsyncRpcClient,
        workers: Workers,
        readers: ReaderSet,
        newest: int = 0,
        tcp_nodelay: bool = False,
        on_loop: bool = False,
        header_memory: tcp.HeaderMemory | None = None,
        this_host: str = "",
        shares_memory: bool = False,
        unreachable: Unreachable | None = None,
    ) -> None:
        """Create the subscription. ``this_host`` is the value of :func:`local.this_host`, or "" to avoid Unix sockets.

        ``shares_memory``: large messages from a process of this user may come through shared memory. All subscriptions of
        the node share ``unreachable``, because several subscriptions may lose the same publisher.
        """
        self.topic = topic
        self.type = type_
        self.newest = newest
        self._this_host = this_host
        self._shares_memory = shares_memory
        self.tcp_nodelay = tcp_nodelay
        self._links: dict[str, InLink] = {}
        self._caller_id = caller_id
        self._deliver = deliver
        self.rpc = rpc
        self._workers = workers
        self._readers = readers
        self._header_memory = header_memory
        self._on_loop = on_loop or isinstance(deliver, InTurns)

        self.lists = 0  # number of publisher lists received
        self.plan = SubscriptionPlan()
        self._named: list[str] = []
        self.settling: asyncio.TimerHandle | None = None
        self._reported: set[str] = set()
        self._unreachable = unreachable or Unreachable()
        # Limit the rate of log lines, because /rosout has as many publishers as there are nodes.
        self._limited_log = RateLimitedLogger(_log, _REFUSALS_LOGGED)
        self.connecting: dict[str, asyncio.Task[None]] = {}
        # Links to publishers that have left the master's list, each with the timer that closes it.
        self._leaving: dict[str, tuple[InLink, asyncio.TimerHandle]] = {}
        self.on_connected: list[Callable[[], object]] = []  # called on the loop when a publisher is connected
        self.on_ended: list[
            Callable[[], object]
        ] = []  # called on the loop when a connection to a publisher has closed
        self._closed = False

    @property
    def links(self) -> tuple[InLink, ...]:
        """The connections to publishers, at most one to each."""
        return tuple(self._links.values())

    def publishers_changed(self, uris: Iterable[str]) -> None:
        """Apply the master's list of publishers. Call this on the loop."""
        if self._closed:
            return
        self.lists += 1
        self._named = list(islice(uris, MAX_PUBLISHERS))
        for action in self.plan.publishers_changed(self._named, keep=self.settling is not None):
            if isinstance(action, Disconnect):
                self._leave(action.uri)
            else:
                self.start_connecting(action)

    def registered_again(self, uris: Iterable[str]) -> None:
        """Apply the first list from a master that had lost its state. Call this on the loop.

        The list lacks nodes that have not registered again yet, so for a while no connected publisher is dropped.
        """
        if self.settling:
            self.settling.cancel()
        self.settling = asyncio.get_running_loop().call_later(SETTLE_SECONDS, self._settle)
        self.publishers_changed(uris)

    def close(self) -> None:
        """Close all links. Call this on the loop."""
        self._closed = True
        self._unreachable.close()
        self._limited_log.close()
        if self.settling:
            self.settling.cancel()
        for task in self.connecting.values():
            task.cancel()
        for uri in [*self._links, *self._leaving]:
            self._disconnect(uri)

    async def wait_closed(self) -> None:
        """Wait, after :meth:`close`, until pending connection attempts have stopped."""
        await asyncio.gather(*self.connecting.values(), return_exceptions=True)

    def _settle(self) -> None:
        """Forget publishers that the master does not list.

        Keep those with an open link, because rospy nodes never register again.
        """
        self.settling = None
        for action in self.plan.publishers_changed(self._named):
            if isinstance(action, Connect):
                self.start_connecting(action)
            elif action.uri not in self._links:
                self._disconnect(action.uri)

    def _leave(self, uri: str) -> None:
        """Keep reading from a publisher that has unregistered, because its earlier messages may still be in transit.

        The publisher closes the connection when everything is sent. If it does not, it is disconnected after a while.
        """
        link = self._links.get(uri)
        if not link:
            self._disconnect(uri)
            return
        del self._links[uri]
        timer = asyncio.get_running_loop().call_later(_LEAVE_SECONDS, self._disconnect, uri)
        self._leaving[uri] = (link, timer)

    def _disconnect(self, uri: str) -> None:
        task = self.connecting.pop(uri, None)
        if task:
            task.cancel()
        # Remove the link immediately; it does not close until its reader has detected the end of the connection.
        link = self._links.pop(uri, None)
        if link:
            link.close()
            self._notify_ended()
        if uri in self._leaving:
            link, timer = self._leaving.pop(uri)
            timer.cancel()
            link.close()
            self._notify_ended()

    def _notify_ended(self) -> None:
        if not self._closed:
            for notify in self.on_ended.copy():
                notify()

    def start_connecting(self, action: Connect) -> None:
        if action.uri in self._leaving:
            # If the publisher still used the first connection, a second one would deliver each message twice.
            link, timer = self._leaving.pop(action.uri)
            timer.cancel()
            link.returned = True
            self._links[action.uri] = link
        if action.uri in self._links:
            return
        task = asyncio.ensure_future(self._connect(action.uri, action.delay))
        self.connecting[action.uri] = task

        def done(finished: asyncio.Task[None]) -> None:
            if self.connecting.get(action.uri) is finished:
                del self.connecting[action.uri]

        task.add_done_callback(done)

    async def _connect(self, uri: str, delay: float) -> None:
        if delay:
            await asyncio.sleep(delay)

        lists = self.lists
        try:
            link = await self.open_link(uri)
        except HandshakeRefused as error:
            _log.warning("publisher %s of %s refused the connection: %s", uri, self.topic, error)
            if self.lists == lists:
                self.plan.refused(uri)
            else:
                # A newer list of publishers arrived after the refusal. Use it, because no further list may come.
                # Retry now, because the publisher may accept.
                self.retry(uri, error)
        except _NoPublisher as error:
            self._limited_log.warning("no connection for %s: %s", self.topic, error)
        except (RpcError, WireError, OSError) as error:
            self.retry(uri, error)
        else:
            if self._closed or self.connecting.get(uri) is not asyncio.current_task():
                # Before Python 3.12, asyncio.wait_for may lose a cancellation that coincides with the last byte.
                link.sock.close()
                return

            self._links[uri] = link
            loop, deliver = asyncio.get_running_loop(), self._deliver
            ended = partial(self._link_ended, link)
            if isinstance(deliver, InTurns):
                in_steps, left_out = deliver.deliver, deliver.on_left_out
                watch_frames_in_turns(
                    loop,
                    link.sock,
                    lambda frame: in_steps(frame, link.header),
                    ended,
                    deliver.start,
                    deliver.max_bytes,
                    lambda: left_out(link.header),
                )
            elif self._on_loop:
                fail = partial(setattr, link, "fault")
                watch_frames(loop, link.sock, lambda frame: deliver(frame, link.header), ended, fail)
            else:
                try:
                    self._workers.start(self._read, link, deliver, loop)
                except ThreadLimitError as error:
                    del self._links[uri]
                    link.sock.close()
                    self._limited_log.error("messages of %s are not received: %s", self.topic, error)
                    self.retry(uri, error)
                    return

            for notify in self.on_connected.copy():
                notify()

    async def open_link(self, uri: str) -> InLink:
        protocols: list[list[str]] = [["TCPROS"]]
        if self._this_host:
            # Add the Unix socket after TCPROS, because third-party nodes read the first protocol only.
            protocols.append([local.PROTOCOL, self._this_host])
        answer = await self.rpc.call(uri, "requestTopic", self._caller_id, self.topic, protocols)
        sock, address = await self._reach(answer, uri)

        try:
            sockets.tune(sock, nodelay=self.tcp_nodelay)
            shares_memory = self._shares_memory and not self._on_loop and shared_memory.may_share(sock)
            fields = subscriber_header(
                self.topic,
                self.type,
                self._caller_id,
                tcp_nodelay=self.tcp_nodelay,
                # Send only ROS 1's header fields to peers on other hosts.
                split_frames=not self._on_loop and sock.family not in sockets.FAMILIES,
                shared_memory=shares_memory,
            )
            await tcp.send_header(sock, fields)
            header = await tcp.receive_header(sock, memory=self._header_memory)
            check_publisher(header, self.topic, self.type)
        except BaseException:
            sock.close()
            raise
        # Like rospy, count the sent header as well.
        received_bytes = len(serialize_header(fields))
        link = InLink(uri, address, sock, header, received_bytes=received_bytes, shares_memory=shares_memory)
        # Third-party nodes omit the topic, but user code reads it.
        header.setdefault("topic", self.topic)
        return link

    async def _reach(self, answer: object, uri: str) -> tuple[socket.socket, str]:
        """Connect to the publisher that sent this response; return the socket and the publisher's address."""
        unix = local.parse_answer(answer) if self._this_host else None
        if unix:
            with contextlib.suppress(OSError):
                return local.connect(unix.name), unix.name
            # Connecting to the Unix socket failed: the processes are isolated from each other, for example by a sandbox.
            # Use TCP.
            host, port = unix.host, unix.port
        else:
            host, port = _tcpros_address(answer, uri, self.topic)
        return await tcp.connect(host, port), f"{host}:{port}"

    def _read(self, link: InLink, deliver: Deliver, loop: asyncio.AbstractEventLoop) -> None:
        header = link.header

        def on_frame(frame: Frame) -> None:
            link.received += 1
            link.received_bytes += 4 + len(frame)
            deliver(frame, header)

        def on_latched_frame(frame: Frame) -> None:
            # Copy a small frame, because the next receive overwrites its buffer.
            link.latched = frame if len(frame) > CHUNK else bytes(frame)
            on_frame(frame)

        try:
            read_frames(
                link.sock,
                on_latched_frame if header.get("latching") == "1" else on_frame,
                self,
                self._readers,
                shares_memory=link.shares_memory,
            )
        except (OSError, WireError) as error:
            link.fault = error
        except MemoryError:
            # There is not enough memory for the message or for an object that a callback allocates.
            link.fault = WireError("no memory for a message")
        finally:
            with contextlib.suppress(RuntimeError):
                loop.call_soon_threadsafe(self._link_ended, link)

    def _link_ended(self, link: InLink) -> None:
        if link.closed:
            return
        if link.uri in self._leaving:
            _, timer = self._leaving.pop(link.uri)
            timer.cancel()
            self._notify_ended()
            return
        del self._links[link.uri]
        self._notify_ended()
        if link.returned:
            # The closed connection belonged to the publisher's previous registration; connect to its current one now.
            self.start_connecting(Connect(link.uri))
            return
        fault = link.fault or EOFError("the publisher closed the connection")
        if isinstance(fault, WireError):
            # Log one line and disconnect: after an error, the rest of the stream is invalid, too.
            _log.warning("connection to %s for %s ended: %s", link.uri, self.topic, fault)
        elif link.received or time.monotonic() - link.since > _WORKED_SECONDS:
            self.plan.worked(link.uri)
            self._reported.discard(link.uri)
        self.retry(link.uri, fault)

    def retry(self, uri: str, error: Exception) -> None:
        action = None if self._closed else self.plan.lost(uri)
        if not action:
            return
        _log.debug("connection to %s for %s: %s; again in %g s", uri, self.topic, error, action.delay)
        cause = error.__cause__ or error
        if isinstance(error, ThreadLimitError) or is_file_limit(cause):
            # The error is a limit in this process, not the publisher's fault.
            if is_file_limit(cause):
                self._limited_log.error("no connection for %s: %s", self.topic, explain(cause))
            self.start_connecting(action)
            return

        nameless = isinstance(cause, socket.gaierror)
        # Publishers that are shutting down refuse connections or disconnect.
        # Report all other errors immediately: a timeout indicates a wrong address or a firewall.
        at_once = isinstance(cause, OSError) and not isinstance(cause, ConnectionError)
        if (at_once or self.plan.failures(uri) >= _WARN_AFTER) and uri not in self._reported:
            self._reported.add(uri)
            self._unreachable.add(uri, self.topic, error, advice(uri, error, nameless=nameless))
        self.start_connecting(action)


class _NoPublisher(WireError):
    """The response cannot come from a publisher.

    Do not retry, because a retry would fail again; rospy does not retry either.
    """


def _tcpros_address(answer: object, uri: str, topic: str) -> tuple[str, int]:
    """Return (host, port) from a publisher's response to requestTopic.

    Raise WireError if the response does not contain them.
    """
    match answer:
        case [1, _, ["TCPROS", str(host), int(port), *_]]:
            return host, port
        case [0 | -1, text, *_]:
            raise WireError(f"{uri} does not serve {topic}: {text}")
        case _:
            raise _NoPublisher(f"{uri} answered requestTopic for {topic} with {answer!r}")
