"""The whole bridge: the shared graph, the protocols' endpoints and listeners, their status and diagnostics."""

from __future__ import annotations

import asyncio
import contextlib
import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

from minirospy.aio.node import Node
from minirospy.aio.tasks import ErrorReporter, keep_running
from minirospy.base.closing import close_all
from minirospy.base.environment import DISTRO
from minirospy.base.errors import BridgeError, ROSInterruptException
from minirospy.introspect.snapshot import fetch
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger
from minirospy.web.access import Access
from minirospy.web.foxglove.assets import ALLOWED, Assets
from minirospy.web.foxglove.endpoint import CAPABILITIES, FoxgloveEndpoint, FoxgloveOptions
from minirospy.web.foxglove.protocol import Playback
from minirospy.web.graph import Filters, SharedGraph
from minirospy.web.rosbridge.client_topics import ClientTopics
from minirospy.web.rosbridge.endpoint import RosbridgeEndpoint
from minirospy.web.rosbridge.shared import RosbridgeOptions
from minirospy.web.server.account import Account
from minirospy.web.server.client import Endpoint, Exchange, HttpHandler, Limits
from minirospy.web.server.listener import Listener
from minirospy.web.server.pipe import tls_context
from minirospy.web.video.pages import VideoPages
from minirospy.workspace.packages import Packages

if TYPE_CHECKING:
    import ssl

    from diagnostic_msgs.msg import DiagnosticArray

    from minirospy.aio.topics import Publisher
    from minirospy.web.rosapi.services import Rosapi
    from minirospy.web.tf_republisher.republisher import Republisher

__all__ = ["FOXGLOVE_PORT", "ROSBRIDGE_PORT", "VIDEO_PORT", "Bridge", "BridgeOptions", "Extras", "tls_of"]

FOXGLOVE_PORT = 8765
ROSBRIDGE_PORT = 9090
VIDEO_PORT = 8080
DIAGNOSTICS_SECONDS = 1.0


@dataclass(frozen=True)
class BridgeOptions:
    """The bridge's options.

    ``address`` is the address for all listeners; a protocol's port is None if it is not served. ``certificate`` and
    ``key`` are PEM files. Times are in seconds: ``max_refresh_interval`` between queries of an unchanged graph,
    ``retry_delay`` before a port in use is tried again (None: never).
    """

    address: str = "127.0.0.1"
    foxglove_port: int | None = FOXGLOVE_PORT
    rosbridge_port: int | None = None
    video_port: int | None = None
    access: Access = field(default_factory=Access)
    limits: Limits = field(default_factory=Limits)
    filters: Filters = field(default_factory=Filters)
    capabilities: Sequence[str] = CAPABILITIES
    assets: Sequence[str] = (ALLOWED,)
    certificate: str = ""
    key: str = ""
    max_refresh_interval: float = 1.0
    diagnostics: bool = True
    rosbridge: RosbridgeOptions = field(default_factory=RosbridgeOptions)
    retry_delay: float | None = None
    rosapi: bool = False
    transforms: bool = False
    """Options for rosbridge clients: ``rosapi`` also runs rosapi's services, ``transforms`` also runs tf2_web_republisher."""
    name: str = "minirospy bridge"  # name of the Foxglove server


@dataclass(frozen=True)
class Extras:
    """Additional endpoints and pages of the Foxglove listener. ``pages`` are public: they need no token."""

    endpoints: Sequence[Endpoint] = ()
    pages: Mapping[str, HttpHandler] = field(default_factory=dict)


def tls_of(options: BridgeOptions) -> ssl.SSLContext | None:
    """Return the TLS context, or None if there is no certificate. Raise BridgeError if the certificate is unusable."""
    if not options.certificate:
        if options.key:
            raise BridgeError("a key is given without its certificate: give both PEM files")
        return None
    try:
        return tls_context(options.certificate, options.key)
    except OSError as error:  # includes ssl.SSLError
        name = error.filename or f"{options.certificate} {options.key}".strip()
        raise BridgeError(f"the certificate cannot be used: {name}: {error.strerror or error}") from error


class Bridge:
    """Serves a node's graph to browsers. Runs on the node's loop."""

    def __init__(
        self,
        node: Node,
        options: BridgeOptions | None = None,
        playback: Playback | None = None,
        extras: Extras | None = None,
    ) -> None:
        self.options = options or BridgeOptions()
        self.node = node
        self.graph = SharedGraph(
            node,
            self.options.filters,
            max_refresh_interval=self.options.max_refresh_interval,
            clock=playback.now if playback else None,
        )
        self.foxglove = FoxgloveEndpoint(
            self.graph,
            Assets(Packages(), self.options.assets),
            FoxgloveOptions(
                name=self.options.name,
                capabilities=self.options.capabilities,
                session_id=str(time.time_ns() // 1_000_000),
                metadata={"ROS_DISTRO": DISTRO.strip(), "node": node.name},
            ),
            playback,
        )
        client_topics = ClientTopics(node)
        self.rosbridge = RosbridgeEndpoint(self.graph, self.options.rosbridge, client_topics.changed)
        self.video = VideoPages(self.graph)
        self._beside: list[ClientTopics | Rosapi | Republisher] = []
        if self.options.rosbridge_port is not None:
            self._beside.append(client_topics)
        self._extras = extras or Extras()
        self._account = Account(self.options.limits.memory)
        self._refusals = RateLimitedLogger(node.log)  # logs refused clients that another option would admit
        self.listeners: dict[str, Listener] = {}
        self._started = time.monotonic()
        self._reporting: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Open the listeners. Raise BridgeError if one cannot be opened."""
        tls = tls_of(self.options)
        served: list[tuple[str, list[Endpoint], int | None]] = [
            ("foxglove", [self.foxglove, *self._extras.endpoints], self.options.foxglove_port),
            ("rosbridge", [self.rosbridge], self.options.rosbridge_port),
            ("video", [], self.options.video_port),
        ]
        for name, endpoints, port in served:
            if port is not None:
                public = self._extras.pages if name == "foxglove" else {}
                self.listeners[name] = await self._listen(endpoints, port, tls, public)
        await self._start_beside()
        if self.options.diagnostics:
            self._reporting = asyncio.ensure_future(self._report())

    async def _listen(
        self,
        endpoints: list[Endpoint],
        port: int,
        tls: ssl.SSLContext | None,
        public: Mapping[str, HttpHandler],
    ) -> Listener:
        """Create the listener for a protocol and open its port.

        Raise BridgeError if the port is in use, unless ``retry_delay`` is set.
        """
        listener = Listener(
            endpoints,
            self.options.access,
            limits=self.options.limits,
            pages={**self.video.handlers, "/status": self._status_page},
            public_pages=public,
            tls=tls,
            account=self._account,
            warn=lambda text: self._refusals.warning("refused: %s", text),
        )
        while True:
            try:
                await listener.open(self.options.address, port)
            except BridgeError as error:
                if self.options.retry_delay is None:
                    raise
                delay = self.options.retry_delay
                self.node.log.warning("Unable to start server: %s. Retrying in %gs.", error, delay)
                with contextlib.suppress(asyncio.TimeoutError):
                    await asyncio.wait_for(self.node.spin(), delay)
                if self.node.is_shutdown:
                    raise ROSInterruptException("shutdown while the port is in use") from None
            else:
                return listener

    async def _start_beside(self) -> None:
        """Start rosapi and tf2_web_republisher for rosbridge clients, if no other node provides them."""
        graph = await fetch(self.node.call_master)
        if self.options.rosapi and "/rosapi/topics" not in graph.services:
            from minirospy.web.rosapi.services import Rosapi

            self._beside.append(Rosapi(self.node, self.options.filters))
        if self.options.transforms and "/republish_tfs" not in graph.services:
            from minirospy.web.tf_republisher.republisher import Republisher

            self._beside.append(Republisher(self.node))
        for part in self._beside:
            await part.start()

    async def close(self) -> None:
        """Disconnect all clients. Idempotent."""
        if self._reporting:
            self._reporting.cancel()
            await asyncio.gather(self._reporting, return_exceptions=True)
        parts = [*self.listeners.values(), self.rosbridge, *self._beside, self.graph]
        await close_all([part.close for part in parts])

    def status(self) -> dict[str, object]:
        """Return the bridge's listeners and clients as JSON-compatible values."""
        clients = []
        for endpoint, listener in self.listeners.items():
            for connection in listener.connections:
                if connection.client:
                    queue = connection.queue
                    clients.append(
                        {
                            "endpoint": endpoint,
                            "address": connection.peer,
                            "protocol": connection.client.subprotocol or "",
                            "rights": connection.client.grant.value,
                            "seconds": round(time.monotonic() - connection.traffic.since, 1),
                            "sent": queue.sent,
                            "sent_bytes": queue.sent_bytes,
                            "waiting": len(queue),
                            "waiting_bytes": queue.size + queue.answers,
                            "dropped": queue.dropped,
                            "received": connection.traffic.received,
                            "received_bytes": connection.traffic.received_bytes,
                            "held_back": connection.traffic.held_back,
                        }
                    )

        return {
            "node": self.node.name,
            "seconds": round(time.monotonic() - self._started, 1),
            "endpoints": {
                endpoint: {
                    "address": listener.host,
                    "port": listener.port,
                    "encrypted": listener.is_encrypted,
                    "connections": len(listener.connections),
                    "refused": listener.refused,
                }
                for endpoint, listener in self.listeners.items()
            },
            "topics": {
                topic: {"received": shared.received, "received_bytes": shared.received_bytes}
                for topic, shared in self.graph.topics.items()
            },
            "clients": clients,
        }

    def _status_page(self, exchange: Exchange) -> None:
        exchange.respond(200, json.dumps(self.status(), indent=1).encode(), "application/json")

    async def _report(self) -> None:
        """Publish the clients' status as diagnostics once per second while clients are connected."""
        from diagnostic_msgs.msg import DiagnosticArray

        publisher = self.node.advertise("/diagnostics", DiagnosticArray, queue_size=1)
        reporter = ErrorReporter(self.node.log, "publishing the state of the clients")
        await keep_running(partial(self._publish_states, publisher), reporter)

    async def _publish_states(self, publisher: Publisher[DiagnosticArray]) -> None:
        from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

        before: Mapping[str, int] = {}
        while True:
            await asyncio.sleep(DIAGNOSTICS_SECONDS)
            dropped: dict[str, int] = {}
            array = DiagnosticArray()
            array.header.stamp = self.node.now()
            for endpoint, listener in self.listeners.items():
                for connection in listener.connections:
                    if not connection.client:
                        continue
                    queue, name = connection.queue, f"{connection.peer} {id(connection):x}"
                    dropped[name] = queue.dropped
                    lost = queue.dropped - before.get(name, 0)
                    values = {
                        "sent": queue.sent,
                        "sent bytes": queue.sent_bytes,
                        "waiting bytes": queue.size,
                        "dropped": queue.dropped,
                        "received": connection.traffic.received,
                    }
                    array.status.append(
                        DiagnosticStatus(
                            level=DiagnosticStatus.WARN if lost else DiagnosticStatus.OK,
                            name=f"{self.node.name.lstrip('/')}: {endpoint} client {connection.peer}",
                            message=f"{lost} messages dropped in a second" if lost else "all messages sent",
                            hardware_id=connection.peer,
                            values=[KeyValue(key, str(value)) for key, value in values.items()],
                        )
                    )
            before = dropped
            if array.status:
                with contextlib.suppress(Exception):
                    await publisher.publish(array)
