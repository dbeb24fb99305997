"""The server for the rosbridge protocol: opens a session for each client."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from minirospy.introspect.snapshot import Changes
from minirospy.web.graph import SharedGraph
from minirospy.web.rosbridge.session import RosbridgeSession
from minirospy.web.rosbridge.shared import RosbridgeOptions, RosbridgeShared

if TYPE_CHECKING:
    from minirospy.web.server.client import WebClient

__all__ = ["RosbridgeEndpoint"]

_SUBPROTOCOL = "rosbridge_v2"


class RosbridgeEndpoint:
    """Serves the rosbridge protocol. Runs on the loop."""

    def __init__(
        self,
        graph: SharedGraph,
        options: RosbridgeOptions | None = None,
        on_clients: Callable[[Sequence[RosbridgeSession]], object] = lambda _: None,
    ) -> None:
        """Create the endpoint. ``on_clients`` is called with the open sessions when a client connects or disconnects."""
        self.sessions: list[RosbridgeSession] = []
        self.shared = RosbridgeShared(graph, options)
        self._on_clients = on_clients

    def select(self, offered: Sequence[str]) -> str | None:
        """Return the sub-protocol to use, or None for no sub-protocol."""
        return _SUBPROTOCOL if _SUBPROTOCOL in offered else None

    def open(self, client: WebClient) -> RosbridgeSession:
        """Start serving a client."""
        session = RosbridgeSession(self.shared, client, self._left)
        if not self.sessions:
            self.shared.graph.watch(_ignore)
        self.sessions.append(session)
        self._on_clients(self.sessions)
        return session

    def close(self) -> None:
        """Stop the threads after the work in progress. Idempotent."""
        self.shared.close()

    def _left(self, session: RosbridgeSession) -> None:
        """Remove a client that has disconnected."""
        self.sessions.remove(session)
        if not self.sessions:
            self.shared.graph.unwatch(_ignore)
            self.shared.forget_messages()
        self._on_clients(self.sessions)


def _ignore(_: Changes) -> None:
    """Ignore graph changes: sessions query the graph when they need it."""
