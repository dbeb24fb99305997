"""Topics at run time: a Publication sends frames to its links, a Subscription takes frames off its links.

Both work on bytes: message classes are the business of ``minirospy.client``.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from minirospy.errors import HandshakeRefused, RpcError, WireError
from minirospy.graph.subscription import Connect, Disconnect, SubscriptionPlan
from minirospy.runtime import tcp
from minirospy.runtime.rpc_async import AsyncRpcClient
from minirospy.runtime.workers import Workers
from minirospy.wire.header import Header
from minirospy.wire.tcpros import (
    InterfaceType,
    check_publisher,
    check_subscriber,
    publisher_header,
    subscriber_header,
)

__all__ = ["Deliver", "InLink", "Publication", "Subscription"]

_log = logging.getLogger(__name__)

Deliver = Callable[[memoryview, Header], None]
"""What is called with each message's bytes and its publisher's connection header."""


class Publication:
    """A topic that this node publishes. ``publish`` may be called from any thread."""

    def __init__(
        self,
        topic: str,
        type_: InterfaceType,
        *,
        queue_size: int | None = 0,
        latch: bool = False,
        headers: Mapping[str, str] | None = None,
        tcp_nodelay: bool = False,
        on_link: Callable[[tcp.OutLink, bool], None] | None = None,
    ) -> None:
        """``queue_size`` frames may wait for a slow subscriber (0: any number; None: publish waits itself).

        ``on_link(link, is_up)`` is called on the loop when a subscriber has come or gone.
        """
        self.topic = topic
        self.type = type_
        self.queue_size = queue_size
        self.latch = latch
        self.headers = dict(headers or {})
        self.tcp_nodelay = tcp_nodelay
        self.links: tuple[tcp.OutLink, ...] = ()
        self._on_link = on_link
        self._latched: bytes | None = None
        self._latch_lock = threading.Lock()

    def publish(self, frame: bytes) -> None:
        """Send one frame to every subscriber."""
        if self.latch:
            # A subscriber that joins at this moment gets the frame once: either here or on joining.
            with self._latch_lock:
                self._latched = frame
                links = self.links
        else:
            links = self.links
        for link in links:
            link.send(frame)
        if self.queue_size is None:
            for link in links:
                link.wait()

    async def accept(self, sock: socket.socket, fields: Header, caller_id: str, peer: str) -> str | None:
        """Answer a subscriber's header as node ``caller_id`` and send to it from now on, or return why it is refused."""
        why = check_subscriber(fields, self.topic, self.type)
        if why:
            return why
        answer = publisher_header(self.topic, self.type, caller_id, latch=self.latch, extra=self.headers)
        await tcp.send_header(sock, answer)
        tcp.tune(sock, nodelay=self.tcp_nodelay or fields.get("tcp_nodelay") == "1")
        link = tcp.OutLink(
            sock,
            asyncio.get_running_loop(),
            fields.get("callerid", peer),
            self.queue_size or 0,
            self._link_closed,
        )
        link.open()
        with self._latch_lock:
            self.links += (link,)
            latched = self._latched
            if latched is not None:
                link.send(latched)
        if self._on_link:
            self._on_link(link, True)
        return None

    def close(self) -> None:
        """End all links (on the loop)."""
        for link in self.links:
            link.close()

    def _link_closed(self, link: tcp.OutLink) -> None:
        self.links = tuple(other for other in self.links if other is not link)
        if self._on_link:
            self._on_link(link, False)


@dataclass(eq=False)
class InLink:
    """The subscriber's end of one connection. ``uri`` is the publisher's Slave API."""

    uri: str
    address: str
    sock: socket.socket
    header: Header
    received: int = 0
    received_bytes: int = 0
    closed: bool = field(default=False)

    def close(self) -> None:
        """Have the reader end; it closes the socket."""
        self.closed = True
        tcp.hang_up(self.sock)


class Subscription:
    """A topic that this node listens to: one connection to each publisher, made again when it breaks.

    Each connection is read by a worker of its own that calls ``deliver``: one publisher's messages stay in
    order, and neither topics nor publishers wait for each other. With ``on_loop``, ``deliver`` is called
    on the loop instead and must be quick.
    """

    def __init__(
        self,
        topic: str,
        type_: InterfaceType,
        caller_id: str,
        deliver: Deliver,
        *,
        rpc: AsyncRpcClient,
        workers: Workers,
        newest: int = 0,
        tcp_nodelay: bool = False,
        on_loop: bool = False,
    ) -> None:
        self.topic = topic
        self.type = type_
        self.newest = newest
        self.tcp_nodelay = tcp_nodelay
        self.links: tuple[InLink, ...] = ()
        self._caller_id = caller_id
        self._deliver = deliver
        self._rpc = rpc
        self._workers = workers
        self._on_loop = on_loop
        self._plan = SubscriptionPlan()
        self._connecting: dict[str, asyncio.Task[None]] = {}
        self._closed = False

    def publishers_changed(self, uris: Iterable[str]) -> None:
        """The master's list of publishers has come (on the loop)."""
        if self._closed:
            return
        for action in self._plan.publishers_changed(uris):
            if isinstance(action, Disconnect):
                self._disconnect(action.uri)
            else:
                self._start_connecting(action)

    def close(self) -> None:
        """End all links (on the loop)."""
        self._closed = True
        for task in self._connecting.values():
            task.cancel()
        for link in self.links:
            link.close()

    def _disconnect(self, uri: str) -> None:
        task = self._connecting.pop(uri, None)
        if task:
            task.cancel()
        for link in self.links:
            if link.uri == uri:
                link.close()

    def _start_connecting(self, action: Connect) -> None:
        task = asyncio.ensure_future(self._connect(action.uri, action.delay))
        self._connecting[action.uri] = task

        def done(finished: asyncio.Task[None]) -> None:
            if self._connecting.get(action.uri) is finished:
                del self._connecting[action.uri]

        task.add_done_callback(done)

    async def _connect(self, uri: str, delay: float) -> None:
        if delay:
            await asyncio.sleep(delay)
        try:
            link = await self._open_link(uri)
        except HandshakeRefused as error:
            # The same answer would come again: wait until the master tells of a change.
            _log.warning("publisher %s of %s refused the connection: %s", uri, self.topic, error)
        except (RpcError, WireError, OSError) as error:
            _log.debug("connecting to %s for %s: %s", uri, self.topic, error)
            self._retry(uri)
        else:
            self._plan.connected(uri)
            self.links += (link,)
            if self._on_loop:
                tcp.watch_frames(
                    asyncio.get_running_loop(),
                    link.sock,
                    lambda frame: self._deliver(frame, link.header),
                    lambda: self._link_ended(link),
                )
            else:
                self._workers.start(self._read, link, asyncio.get_running_loop())

    async def _open_link(self, uri: str) -> InLink:
        answer = await self._rpc.call(uri, "requestTopic", self._caller_id, self.topic, [["TCPROS"]])
        host, port = _tcpros_address(answer, uri, self.topic)
        sock = await tcp.connect(host, port)
        try:
            tcp.tune(sock, nodelay=self.tcp_nodelay)
            await tcp.send_header(
                sock,
                subscriber_header(self.topic, self.type, self._caller_id, tcp_nodelay=self.tcp_nodelay),
            )
            header = await tcp.receive_header(sock)
            check_publisher(header, self.topic, self.type)
        except BaseException:
            sock.close()
            raise
        # Others leave the topic out; user code reads it.
        header.setdefault("topic", self.topic)
        return InLink(uri, f"{host}:{port}", sock, header)

    def _read(self, link: InLink, loop: asyncio.AbstractEventLoop) -> None:
        deliver, header = self._deliver, link.header

        def on_frame(frame: memoryview) -> None:
            link.received += 1
            link.received_bytes += len(frame)
            deliver(frame, header)

        try:
            tcp.read_frames(link.sock, on_frame, self.newest)
        except (OSError, WireError) as error:
            if not link.closed:
                _log.debug("connection to %s for %s ended: %s", link.uri, self.topic, error)
        finally:
            with contextlib.suppress(RuntimeError):
                loop.call_soon_threadsafe(self._link_ended, link)

    def _link_ended(self, link: InLink) -> None:
        self.links = tuple(other for other in self.links if other is not link)
        if not link.closed:
            self._retry(link.uri)

    def _retry(self, uri: str) -> None:
        action = None if self._closed else self._plan.lost(uri)
        if action:
            self._start_connecting(action)


def _tcpros_address(answer: object, uri: str, topic: str) -> tuple[str, int]:
    """(host, port) out of a publisher's answer to requestTopic. Raises WireError."""
    match answer:
        case [1, _, ["TCPROS", str(host), int(port), *_]]:
            return host, port
        case [int(), text, *_]:
            raise WireError(f"{uri} does not serve {topic}: {text}")
        case _:
            raise WireError(f"{uri} answered requestTopic for {topic} with {answer!r}")
