"""The server for the Foxglove protocol: advertises channels and services to all clients, and updates them."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from minirospy.base.clock import time_of_clock_message
from minirospy.base.environment import DISTRO
from minirospy.core.wire.header import Header
from minirospy.introspect.snapshot import Changes
from minirospy.web.foxglove import protocol, serializing
from minirospy.web.foxglove.assets import Assets
from minirospy.web.foxglove.channels import Channels, Services
from minirospy.web.foxglove.parameters import Parameters
from minirospy.web.foxglove.protocol import Channel, GraphTables, Playback, PlaybackState
from minirospy.web.foxglove.session import FoxgloveSession
from minirospy.web.graph import Arrival, SharedGraph

if TYPE_CHECKING:
    from minirospy.web.server.client import WebClient

__all__ = ["CAPABILITIES", "FoxgloveEndpoint", "FoxgloveOptions"]

_log = logging.getLogger(__name__)

CAPABILITIES = ("clientPublish", "parameters", "parametersSubscribe", "services", "connectionGraph", "assets")
"""Capabilities that clients have by default."""

_FOR_WRITERS = {"clientPublish", "services", "playbackControl"}
_DROP_REPORT_SECONDS = 2.0


@dataclass(frozen=True)
class FoxgloveOptions:
    """Options of the Foxglove endpoint.

    ``name`` is the server name shown by clients; ``session_id`` is different for each start of the bridge.
    """

    name: str = "minirospy bridge"
    capabilities: Sequence[str] = CAPABILITIES
    session_id: str = ""
    metadata: Mapping[str, str] = field(default_factory=lambda: {"ROS_DISTRO": DISTRO.strip()})


class FoxgloveEndpoint:
    """Serves the Foxglove protocol. Runs on the loop."""

    def __init__(
        self,
        graph: SharedGraph,
        assets: Assets,
        options: FoxgloveOptions | None = None,
        playback: Playback | None = None,
    ) -> None:
        self.graph = graph
        self.assets = assets
        self.playback = playback
        self.channels = Channels()
        self.services = Services()
        self.parameters = Parameters(graph)

        self.sessions: set[FoxgloveSession] = set()
        self._options = options or FoxgloveOptions()
        self._waiting: set[FoxgloveSession] = set()  # clients to which the channels have not been sent yet
        self._is_known = False
        self._updating: asyncio.Task[None] | None = None
        self._is_outdated = False
        self._reporting: asyncio.TimerHandle | None = None

    # --- Endpoint

    def select(self, offered: Sequence[str]) -> str:
        """Choose one of the offered sub-protocols. Raise LookupError if none of ``offered`` is supported."""
        for name in protocol.SUBPROTOCOLS:
            if name in offered:
                return name
        raise LookupError(f"sub-protocol {' or '.join(protocol.SUBPROTOCOLS)} is required")

    def open(self, client: WebClient) -> FoxgloveSession:
        """Start serving a client."""
        session = FoxgloveSession(self, client)
        session.send(
            serializing.server_info(
                self._options.name,
                self.capabilities_of(client),
                self._options.metadata,
                self._options.session_id,
                self.playback.range if self.playback else None,
            )
        )
        if self.playback:
            client.send_binary(serializing.playback_state(self.playback.state()))

        is_first = not self.sessions
        self.sessions.add(session)
        if is_first:
            self._start()
        if self._is_known:
            self._offer_all(session)
        else:
            self._waiting.add(session)
        return session

    def left(self, session: FoxgloveSession) -> None:
        """Remove a client that has disconnected."""
        self.sessions.discard(session)
        self._waiting.discard(session)
        if not self.sessions:
            self._stop()

    # --- called by sessions

    def capabilities_of(self, client: WebClient) -> list[str]:
        """Return the capabilities of a client."""
        found = list(self._options.capabilities)
        if self.graph.node.simulated or self.playback:
            found.append("time")
        if self.playback:
            found.append("playbackControl")
        return [each for each in found if client.may_write or each not in _FOR_WRITERS]

    def definition_differs(self, channel: Channel, header: Header) -> None:
        """Replace a channel because its publisher's definition differs from the installed one."""
        replaced = self.channels.redefine(channel, header)
        if replaced:
            _log.info(
                "%s: [%s] has another definition than the installed one", channel.topic, replaced.schema.name
            )
            for session in list(self.sessions):
                session.channels_removed([channel.id])
                session.send(serializing.advertise([replaced]))

    def playback_changed(self, state: PlaybackState) -> None:
        """Send the state of a player to all clients."""
        for session in list(self.sessions):
            session.client.send_binary(serializing.playback_state(state))

    # --- internals

    def _start(self) -> None:
        self.graph.watch(self._graph_changed)
        if self.graph.node.simulated:
            self.graph.subscribe("/clock", self._clock)
        loop = asyncio.get_running_loop()
        self._reporting = loop.call_later(_DROP_REPORT_SECONDS, self._report_drops)

    def _stop(self) -> None:
        self.graph.unwatch(self._graph_changed)
        self.graph.unsubscribe("/clock", self._clock)
        if self._reporting:
            self._reporting.cancel()
        if self._updating:
            self._updating.cancel()
            self._updating = None
        self._is_known = False
        self.channels.clear()
        self.services.clear()

    def _graph_changed(self, changes: Changes) -> None:
        tables = GraphTables(changes.publishers, changes.subscribers, changes.services)
        if changes:
            text = serializing.connection_graph_update(
                tables, changes.removed_topics, changes.removed_services
            )
            for session in list(self.sessions):
                if session.wants_graph:
                    session.send(text)
        self._is_outdated = True
        if self._updating is None or self._updating.done():
            self._updating = self.graph.spawn(self._update())

    async def _update(self) -> None:
        """Advertise new channels and services, and remove old ones. Repeat this if the graph changes meanwhile."""
        while self._is_outdated:
            self._is_outdated = False
            new_services, removed_services = self.services.update(self.graph)
            new, removed = await self.channels.update(self.graph)
            for session in list(self.sessions - self._waiting):
                if removed:
                    session.channels_removed(removed)
                if new:
                    session.send(serializing.advertise(new))
                if "services" not in self.capabilities_of(session.client):
                    continue
                if removed_services:
                    session.send(serializing.unadvertise_services(removed_services))
                if new_services:
                    session.send(serializing.advertise_services(new_services))

        self._is_known = True
        while self._waiting:
            self._offer_all(self._waiting.pop())

    def _offer_all(self, session: FoxgloveSession) -> None:
        session.send(serializing.advertise(self.channels.by_id.values()))
        if "services" in self.capabilities_of(session.client):
            session.send(serializing.advertise_services(self.services.by_id.values()))

    def _clock(self, arrival: Arrival) -> None:
        if (now := time_of_clock_message(arrival.body)) is not None:
            frame = serializing.time_frame(now)
            for session in list(self.sessions):
                session.send_time(frame)

    def _report_drops(self) -> None:
        for session in list(self.sessions):
            session.report_drops()
        self._reporting = asyncio.get_running_loop().call_later(_DROP_REPORT_SECONDS, self._report_drops)
