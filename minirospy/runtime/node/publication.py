"""The publishing end of a topic: a Publication sends frames on its links, one to each subscriber.

It works on bytes; ``minirospy.client`` and ``minirospy.aio`` handle the message classes.
"""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Callable, Mapping

from minirospy.base.closing import close_each
from minirospy.core.wire import ring
from minirospy.core.wire.framing import LargeFrame
from minirospy.core.wire.header import Header, serialize_header
from minirospy.core.wire.tcpros import LARGE_MESSAGES, InterfaceType, check_subscriber, publisher_header
from minirospy.runtime.transport import shared_memory, sockets
from minirospy.runtime.transport.links import OutLink
from minirospy.runtime.transport.ring_sender import SharedRing

__all__ = ["Publication"]


class Publication:
    """A topic that this node publishes. ``publish`` is thread-safe."""

    def __init__(
        self,
        topic: str,
        type_: InterfaceType,
        *,
        queue_size: int | None = 0,
        latch: bool = False,
        headers: Mapping[str, str] | None = None,
        tcp_nodelay: bool = False,
        on_link: Callable[[OutLink, bool], None] | None = None,
    ) -> None:
        """Create the publication. Queue up to ``queue_size`` frames for a slow subscriber (0: no limit; None: publish blocks).

        ``on_link(link, is_up)`` is called on the loop when a subscriber has connected or disconnected.
        """
        self.topic = topic
        self.type = type_
        self.queue_size = queue_size
        self.latch = latch
        self.headers = dict(headers or {})
        self.tcp_nodelay = tcp_nodelay
        self.links: tuple[OutLink, ...] = ()
        # Total bytes of messages sent to at least one subscriber, with length prefixes. Each message counts once.
        self.sent_bytes = 0
        # number of subscribers that the master listed when the publication was registered
        self.expected = 0
        self._on_link = on_link
        self._latched: bytes | LargeFrame | None = None
        self._latch_lock = threading.Lock()
        # the shared memory for large messages; created for the first subscriber that can read it
        self._ring: SharedRing | None = None

    @property
    def is_sending(self) -> bool:
        """Return whether a thread is publishing, and therefore holds a lock."""
        return (
            self._latch_lock.locked()
            or any(link.is_sending for link in self.links)
            or (self._ring is not None and self._ring.lock.locked())
        )

    @property
    def shared_bytes(self) -> int:
        """Return the number of bytes of shared memory that this topic uses."""
        return self._ring.memory_bytes if self._ring else 0

    def publish(self, frame: bytes | LargeFrame) -> None:
        """Send one frame to every subscriber."""
        if self.latch:
            # A subscriber that connects now must receive the frame exactly once, either here or in accept().
            with self._latch_lock:
                self._latched = frame
                links = self.links
        else:
            links = self.links
        if links:
            if isinstance(frame, bytes):
                self.sent_bytes += len(frame)
                for link in links:
                    link.send(frame)
            else:
                self.sent_bytes += 4 + frame.size
                self._send_large(frame, links)
        if self.queue_size is None:
            for link in links:
                link.wait()

    def accept(
        self, sock: socket.socket, fields: Header, caller_id: str, peer: str, *, shares_memory: bool = False
    ) -> str | None:
        """Reply as node ``caller_id`` to a subscriber's header and start sending to it. If refused, return the reason.

        ``shares_memory``: large messages may go through shared memory if the subscriber can read it. Call this on the loop.
        """
        why = check_subscriber(fields, self.topic, self.type)
        if why:
            return why

        sockets.tune(sock, nodelay=self.tcp_nodelay or fields.get("tcp_nodelay") == "1")
        sockets.enlarge_send_buffer(sock)
        answer = publisher_header(self.topic, self.type, caller_id, latch=self.latch, extra=self.headers)
        loop = asyncio.get_running_loop()
        if shares_memory and fields.get("shared_memory") == LARGE_MESSAGES and shared_memory.may_share(sock):
            self._ring = self._ring or SharedRing(loop)
            sender = self._ring.add(sock)
        else:
            sender = None
        link = OutLink(
            sock,
            loop,
            fields.get("callerid", peer),
            self.queue_size or 0,
            self._link_closed,
            header=serialize_header(answer),
            split=fields.get("split_frames") == LARGE_MESSAGES,
            ring=sender,
        )

        for other in self.links:
            if other.peer == link.peer and other.waiting:
                # A node keeps only one connection per topic, so this subscriber has lost the old one and no longer reads it.
                other.close()
        # A subscriber that has received the header expects all messages published from then on.
        # The link must therefore accept frames before the header is sent.
        with self._latch_lock:
            self.links += (link,)
            latched = self._latched if self.latch else None
            if latched is not None:
                link.send(latched)
        try:
            link.open()
            if self._on_link:
                self._on_link(link, True)
        except BaseException:
            # The caller closes the socket, and a link without a socket must not be counted or closed later.
            link.close()
            raise
        return None

    def forget_latched(self) -> None:
        """Stop sending the last frame to new subscribers."""
        with self._latch_lock:
            self._latched = None

    def close(self) -> None:
        """Close all links. Call this on the loop."""
        close_each([*(link.close for link in self.links), *([self._ring.close] if self._ring else [])])

    def _send_large(self, frame: LargeFrame, links: tuple[OutLink, ...]) -> None:
        if self._ring is None or not ring.MIN_MESSAGE <= frame.size <= ring.MAX_MESSAGE:
            for link in links:
                link.send(frame)
            return
        with self._ring.share(frame) as sharing:
            for link in links:
                link.send(frame, sharing)

    def _link_closed(self, link: OutLink) -> None:
        self.links = tuple(other for other in self.links if other is not link)
        if self._on_link:
            self._on_link(link, False)
