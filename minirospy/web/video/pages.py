"""The pages of web_video_server. Each image is encoded once for all clients that request the same encoding."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from minirospy.base.errors import BridgeError, MasterUnreachableError, RpcError
from minirospy.introspect.snapshot import Snapshot, fetch
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger
from minirospy.web.graph import Arrival, SharedGraph
from minirospy.web.server.client import Exchange, HttpHandler
from minirospy.web.video import options
from minirospy.web.video.capacity import Capacity
from minirospy.web.video.options import VideoRequest, request_of
from minirospy.web.video.pictures import COMPRESSED, IMAGE, MAX_PIXELS, encoded, work_of

__all__ = ["VideoPages"]

SNAPSHOT_SECONDS = 10.0
_MAX_FEEDS = 32
"""Maximum number of concurrent feeds (one per topic and encoding); each feed encodes every image of its topic."""
_MAX_KEPT = 32_000_000
"""Maximum total size in bytes of the encoded images that are stored for new clients; further images are not stored."""
_HTML = "text/html; charset=utf-8"


class File(NamedTuple):
    """An encoded image."""

    data: bytes
    content_type: str
    nanoseconds: int


Listener = Callable[[File | BridgeError], None]


class _Feed:
    """Encodes a topic's images in one encoding. A worker always encodes the newest image."""

    def __init__(self, graph: SharedGraph, request: VideoRequest, shared: _Shared) -> None:
        self.listeners: list[Listener] = []
        self.last: File | BridgeError | None = None
        """The last encoded image, sent to new clients so that they need not wait for the next one on a slow or latched
        topic.
        """

        self._graph = graph
        self._request = request
        self._shared = shared
        self._newest: Arrival | None = None
        self._work: asyncio.Task[None] | None = None

    def open(self) -> None:
        """Subscribe to the topic."""
        self._graph.subscribe(self._request.topic, self._arrived)

    def close(self) -> None:
        """Unsubscribe from the topic."""
        self._graph.unsubscribe(self._request.topic, self._arrived)
        self._newest = None
        self._keep(None)

    def _arrived(self, arrival: Arrival) -> None:
        self._newest = arrival
        if self._work is None:
            self._work = self._graph.spawn(self._encode())

    async def _encode(self) -> None:
        loop = asyncio.get_running_loop()
        while self._newest:
            arrival, self._newest = self._newest, None
            type_ = arrival.header.get("type", "")
            found: File | BridgeError
            try:
                async with self._shared.work.taken(work_of(type_, arrival.body)):
                    data, content_type = await loop.run_in_executor(
                        None, encoded, type_, bytes(arrival.body), self._request.picture
                    )
            except BridgeError as error:
                found = error
            else:
                found = File(data, content_type, arrival.nanoseconds)
            self._keep(found if self.listeners else None)
            for listener in tuple(self.listeners):
                listener(found)
        self._work = None

    def _keep(self, found: File | BridgeError | None) -> None:
        """Store the last encoded image, unless the images of all feeds would then exceed _MAX_KEPT."""
        self._shared.kept -= _size(self.last)
        self.last = found
        if self._shared.kept + _size(found) > _MAX_KEPT:
            self.last = None
        self._shared.kept += _size(self.last)


def _size(found: File | BridgeError | None) -> int:
    return len(found.data) if isinstance(found, File) else 0


@dataclass
class _Shared:
    """State shared by all feeds: the limit of concurrently processed pixels, and the total size of stored images."""

    work: Capacity
    kept: int = 0


class VideoPages:
    """Serves images from topics. Runs on the loop."""

    def __init__(self, graph: SharedGraph) -> None:
        self._graph = graph
        self.feeds: dict[VideoRequest, _Feed] = {}
        self._shared = _Shared(Capacity(MAX_PIXELS))
        self._log = RateLimitedLogger(logging.getLogger(graph.node.log.name))

    @property
    def handlers(self) -> Mapping[str, HttpHandler]:
        """Return the request handler for each path."""
        return {
            "/": self._guarded(self._topics),
            "/stream": self._guarded(self._stream),
            "/stream_viewer": self._guarded(self._viewer),
            "/snapshot": self._guarded(self._snapshot),
        }

    def _guarded(self, handler: Callable[[Exchange], None]) -> HttpHandler:
        def handle(exchange: Exchange) -> None:
            try:
                handler(exchange)
            except BridgeError as error:
                _refuse(exchange, 400, str(error))

        return handle

    def _topics(self, exchange: Exchange) -> None:
        async def respond() -> None:
            graph = await self._look(exchange)
            if graph:
                found = {
                    topic: graph.types[topic]
                    for topic in graph.publishers
                    if graph.types.get(topic) in (IMAGE, COMPRESSED)
                }
                exchange.respond(
                    200, options.topics_page(found, exchange.request.query.get("token", "")), _HTML
                )

        self._graph.spawn(respond())

    def _viewer(self, exchange: Exchange) -> None:
        query = exchange.request.query
        exchange.respond(200, options.viewer_page(query, query.get("token", "")), _HTML)

    def _stream(self, exchange: Exchange) -> None:
        request = request_of(exchange.request.query)

        def show(found: File | BridgeError) -> None:
            if isinstance(found, BridgeError):
                self._log.warning("%s: %s", request.topic, found)
                return
            head = options.part(found.data, found.content_type, found.nanoseconds)
            exchange.send(request, head, found.data, options.END)

        def start() -> None:
            exchange.start(200, f"multipart/x-mixed-replace;boundary={options.BOUNDARY}")
            exchange.send("start", options.START, newest_only=False)
            self._join(exchange, request, show)

        self._graph.spawn(self._when_published(exchange, request, start))

    def _snapshot(self, exchange: Exchange) -> None:
        request = request_of(exchange.request.query, is_snapshot=True)
        late: asyncio.TimerHandle | None = None
        leave: Callable[[], None] = _nothing

        def show(found: File | BridgeError) -> None:
            if late:
                late.cancel()
            leave()
            if isinstance(found, BridgeError):
                _refuse(exchange, 500, str(found))
            else:
                exchange.respond(200, found.data, found.content_type)

        def is_late() -> None:
            leave()
            _refuse(exchange, 504, f"no image came on [{request.topic}] in {SNAPSHOT_SECONDS:.0f} seconds")

        def start() -> None:
            nonlocal late, leave
            late = asyncio.get_running_loop().call_later(SNAPSHOT_SECONDS, is_late)
            leave = self._join(exchange, request, show)

        self._graph.spawn(self._when_published(exchange, request, start))

    # --- internals

    async def _look(self, exchange: Exchange) -> Snapshot | None:
        """Return the graph. If it cannot be read, send an error response, and return None."""
        try:
            found = await fetch(self._graph.node.call_master)
        except (MasterUnreachableError, RpcError) as error:
            _refuse(exchange, 503, f"the graph cannot be read: {error}")
            return None
        return found.filtered(self._graph.filters.topics, self._graph.filters.services)

    async def _when_published(
        self, exchange: Exchange, request: VideoRequest, start: Callable[[], None]
    ) -> None:
        graph = await self._look(exchange)
        # If the client has disconnected meanwhile, do not start, because nothing would end the stream.
        if graph is None or not exchange.is_open:
            return
        topic = self._graph.node.resolve(request.topic)
        type_ = graph.types.get(topic, "")
        if topic not in graph.publishers:
            _refuse(exchange, 404, f"topic [{topic}] is not published")
        elif type_ not in (IMAGE, COMPRESSED):
            _refuse(
                exchange, 400, f"topic [{topic}] is of type [{type_}]: {IMAGE} and {COMPRESSED} are images"
            )
        elif request not in self.feeds and len(self.feeds) >= _MAX_FEEDS:
            _refuse(exchange, 503, f"{_MAX_FEEDS} encodings of images are in use: no more")
        else:
            start()

    def _join(self, exchange: Exchange, request: VideoRequest, listener: Listener) -> Callable[[], None]:
        """Send a topic's images to a client.

        Return a function that stops sending, which is also called when the client disconnects.
        """
        feed = self.feeds.get(request)
        is_new = feed is None
        if feed is None:
            feed = self.feeds[request] = _Feed(self._graph, request, self._shared)
        feed.listeners.append(listener)
        joined = feed

        def leave() -> None:
            if listener not in joined.listeners:
                return
            joined.listeners.remove(listener)
            if not joined.listeners:
                joined.close()
                self.feeds.pop(request, None)

        exchange.on_end = leave
        if is_new:
            feed.open()
        elif feed.last:
            asyncio.get_running_loop().call_soon(listener, feed.last)
        return leave


def _nothing() -> None:
    """Do nothing, because the stream has not started."""


def _refuse(exchange: Exchange, status: int, why: str) -> None:
    exchange.respond(status, (why + "\n").encode())
