"""The graph of a gateway's master: the topics and services that nodes other than gateways use, and their types."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Collection
from typing import TYPE_CHECKING

from minirospy.aio.raw import service_header
from minirospy.aio.tasks import ErrorReporter
from minirospy.base.errors import MasterUnreachableError, RpcError, WireError
from minirospy.core.wire.header import Header
from minirospy.fleet.definitions import Definitions
from minirospy.fleet.keys import UNKNOWN_MD5, Claim, ServiceToken, TopicToken, is_md5
from minirospy.fleet.rules import Export, GatewayRules, exported_services, exported_topics
from minirospy.introspect.node_queries import NodeQueries
from minirospy.introspect.snapshot import Snapshot, fetch

if TYPE_CHECKING:
    from minirospy.aio.node import Node

__all__ = ["RobotGraph"]

_log = logging.getLogger(__name__)
_MIN_REFRESH_INTERVAL, _MAX_REFRESH_INTERVAL = 0.25, 2.0
_QUERY_SECONDS = 3.0
"""Timeout in seconds for querying types, after which the graph is announced without the unknown ones."""


class RobotGraph:
    """The part of the master's graph that a gateway announces. Runs on the node's loop."""

    def __init__(
        self,
        node: Node,
        definitions: Definitions,
        claim: Claim,
        rules: GatewayRules,
        hidden: Callable[[], Collection[str]],
        gateways: Callable[[Snapshot], Collection[str]] | None = None,
    ) -> None:
        """Create the graph.

        ``hidden()`` returns the names of the imported robots. ``gateways(snapshot)`` returns the nodes of other gateways;
        their endpoints, like this node's, are ignored.
        """
        self.is_master_reached = True
        self.topics: dict[str, TopicToken] = {}
        self.services: dict[str, ServiceToken] = {}
        self.service_names: set[str] = set()
        """The services of all other nodes, including those that are not announced."""
        self._node = node
        self._definitions = definitions
        self._claim = claim
        self._rules = rules
        self._hidden = hidden
        self._gateways = gateways
        reporter = ErrorReporter(_log, "a query for a type")
        self._publishers = NodeQueries(self._publisher, reporter)
        self._services = NodeQueries(self._service, reporter)

    async def close(self) -> None:
        """Cancel the running queries. Idempotent."""
        await self._publishers.close()
        await self._services.close()

    async def look(self) -> bool:
        """Read the current graph from the master; return whether it has changed.

        Raise MasterUnreachableError or RpcError if the call to the master fails.
        """
        snapshot = await fetch(self._node.call_master)
        hidden, own = self._hidden(), {self._node.name}
        if self._gateways:
            own.update(self._gateways(snapshot))
        self.service_names = {name for name, nodes in snapshot.services.items() if set(nodes) - own}
        exports = exported_topics(snapshot, own, self._rules.topics, hidden)
        services = exported_services(snapshot, own, self._rules.services, hidden)
        present = {(each.topic, node): None for each in exports.values() for node in each.publishers}
        await asyncio.gather(
            self._publishers.look(present, _QUERY_SECONDS),
            self._services.look(services.items(), _QUERY_SECONDS),
        )

        topics = {}
        for export in exports.values():
            token = await self._topic_token(export)
            if token:
                topics[export.topic] = token
        found = {
            name: ServiceToken(self._claim.name, self._claim.gateway, name, *type_)
            for (name, _), type_ in self._services.found.items()
        }
        changed = topics != self.topics or found != self.services
        self.topics, self.services = topics, found
        return changed

    async def watch(self, look: Callable[[], Awaitable[bool]]) -> None:
        """Poll ``look`` repeatedly, more often while it reports changes."""
        pause = _MIN_REFRESH_INTERVAL
        while True:
            await asyncio.sleep(pause)
            changed = False
            started = time.monotonic()
            try:
                changed = await look()
                if not self.is_master_reached:
                    _log.info("the master answers again")
                self.is_master_reached = True
            except (MasterUnreachableError, RpcError) as error:
                if self.is_master_reached:
                    _log.warning("the graph cannot be read: %s. Will keep trying.", error)
                self.is_master_reached = False
            slowest = max(_MAX_REFRESH_INTERVAL, 20 * (time.monotonic() - started))
            pause = _MIN_REFRESH_INTERVAL if changed else min(pause * 1.5, slowest)

    async def _topic_token(self, export: Export) -> TopicToken | None:
        headers = [
            header
            for publisher in export.publishers
            if (header := self._publishers.found.get((export.topic, publisher))) is not None
        ]
        type_, md5sum = export.type, UNKNOWN_MD5
        if headers:
            type_, md5sum = headers[0].get("type", ""), headers[0].get("md5sum", "")
            if not is_md5(md5sum):
                return None
        elif export.subscribers:
            md5sum = await self._definitions.md5sum(type_) or UNKNOWN_MD5
        else:
            return None
        rewriter = await self._definitions.rewriter(type_, md5sum) if self._rules.has_frames else None

        return TopicToken(
            self._claim.name,
            self._claim.gateway,
            export.topic,
            type_,
            md5sum,
            bool(headers),
            bool(export.subscribers),
            any(header.get("latching") == "1" for header in headers),
            rewriter is not None,
        )

    async def _publisher(self, key: tuple[str, str]) -> Header:
        """Return a publisher's connection header, which contains the type and whether it latches."""
        header = await self._definitions.texts.header_of(*key)
        self._definitions.learn(
            header.get("type", ""), header.get("md5sum", ""), header.get("message_definition", "")
        )
        return header

    async def _service(self, key: tuple[str, tuple[str, ...]]) -> tuple[str, str]:
        """Return a service's type and md5sum."""
        header = await service_header(self._node, key[0])
        type_, md5sum = header.get("type", ""), header.get("md5sum", "")
        if not is_md5(md5sum) or "/" not in type_:
            raise WireError(f"service [{key[0]}] names no type")
        return type_, md5sum
