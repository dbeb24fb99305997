"""The bridge's ROS 2 node on a Zenoh session: its tokens and endpoints, and the graph of other sessions."""

from __future__ import annotations

import contextlib
import importlib
import itertools
import os
import threading
import time
from collections.abc import Callable

from minirospy.base.errors import BridgeError
from minirospy.ros2.links import parse_domain
from minirospy.ros2.zenoh_keys import (
    Entity,
    Kind,
    Qos,
    attachment,
    format_token,
    gid_of,
    parse_token,
    tokens_pattern,
)
from minirospy.zenoh.library import (
    DEFAULT_ENDPOINT,
    Declared,
    NetworkOptions,
    Sample,
    Session,
    configured,
    one_line,
    require_zenoh,
)

__all__ = ["Graph", "Handle", "ZenohNode"]

_MAX_ENTITIES = 50_000


class Graph:
    """The nodes and endpoints in other sessions, known from their tokens. Methods may be called from any thread."""

    def __init__(self, own_session: str = "") -> None:
        self._own = own_session
        self._nodes: dict[str, Entity] = {}
        self._by_name: dict[str, dict[str, Entity]] = {}
        self._count = 0
        self._lock = threading.Lock()

    def set(self, key: str, is_there: bool) -> None:
        """Add or remove the entity of a token; ignore tokens that cannot be parsed."""
        entity = parse_token(key)
        if entity is None or entity.session == self._own:
            return
        with self._lock:
            kept = self._nodes if entity.kind is Kind.NODE else self._by_name.setdefault(entity.name, {})
            if is_there and key not in kept and self._count < _MAX_ENTITIES:
                kept[key] = entity
                self._count += 1
            elif not is_there and key in kept:
                del kept[key]
                self._count -= 1
            if not kept:
                self._by_name.pop(entity.name, None)

    def nodes(self) -> list[Entity]:
        """Return the nodes in other sessions."""
        with self._lock:
            return list(self._nodes.values())

    def ends(self, *kinds: Kind) -> list[Entity]:
        """Return all endpoints of the given kinds."""
        with self._lock:
            found = [each for ends in self._by_name.values() for each in ends.values()]
        return [each for each in found if each.kind in kinds]

    def of_name(self, name: str, *kinds: Kind) -> list[Entity]:
        """Return the endpoints of the given kinds for one topic or service."""
        with self._lock:
            found = list(self._by_name.get(name, {}).values())
        return [each for each in found if each.kind in kinds]


class ZenohNode:
    """A Zenoh session with one ROS 2 node. ``graph`` contains the nodes and endpoints in other sessions."""

    def __init__(self, name: str, options: NetworkOptions) -> None:
        """Open the session, and wait for the router. Raise BridgeError if that fails."""
        require_zenoh("ros2-bridge --zenoh", needs_hash=True)
        self.zenoh = importlib.import_module("zenoh")
        self.domain = parse_domain(os.environ.get("ROS_DOMAIN_ID", ""))
        self.session = self._opened(options)
        self._zid = str(self.session.info.zid())
        self._name = name
        self._ids = itertools.count()
        self.graph = Graph(self._zid)
        self._is_closed = False
        liveliness = self.session.liveliness()
        # These declarations last until the session is closed.
        self._declared = [
            liveliness.declare_token(format_token(self.entity(Kind.NODE))),
            liveliness.declare_subscriber(
                tokens_pattern(self.domain), self.handler(self._changed), history=True
            ),
        ]

    def entity(
        self, kind: Kind, name: str = "", type_: str = "", hash_: str = "", qos: Qos | None = None
    ) -> Entity:
        """Return a new entity: the first is the node itself, the others are its endpoints, which a :class:`Handle` declares."""
        id = next(self._ids)
        return Entity(self.domain, self._zid, id, kind, self._name, "/", name, type_, hash_, qos or Qos())

    def close(self) -> None:
        """Close the session and all its declarations. Idempotent."""
        if self._is_closed:
            return
        self._is_closed = True
        # Undeclaring fails on a broken link, but the peer then detects the loss itself.
        with contextlib.suppress(self.zenoh.ZError):
            self.session.close()

    def handler(self, function: Callable[..., object], ended: Callable[[], object] | None = None) -> object:
        """Return a handler that runs in Zenoh's own thread; by default, Zenoh's Python API starts a thread for each handler."""
        return self.zenoh.handlers.Callback(function, ended, indirect=False)

    def _opened(self, options: NetworkOptions) -> Session:
        config = configured(options)
        # Messages stored for late subscribers need time stamps.
        config.insert_json5("timestamping/enabled", "true")
        try:
            session: Session = self.zenoh.open(config)
        except self.zenoh.ZError as error:
            where = ", ".join(options.connect) or options.config or DEFAULT_ENDPOINT
            raise BridgeError(
                f"no router of Zenoh answers at {where} ({one_line(error)}): start `ros2 run rmw_zenoh_cpp rmw_zenohd`, "
                "`zenohd` or `minirospy fleet router` there, or give --connect"
            ) from error
        return session

    def _changed(self, sample: Sample) -> None:
        self.graph.set(str(sample.key_expr), sample.kind == self.zenoh.SampleKind.PUT)


class Handle:
    """An endpoint of the node, with its token and declarations; all are undeclared by :meth:`close`."""

    def __init__(self, node: ZenohNode, end: Entity, *declared: Declared) -> None:
        key = format_token(end)
        self._fault = node.zenoh.ZError
        self._declared = (node.session.liveliness().declare_token(key), *declared)
        self._gid = gid_of(key)
        self._sequence = itertools.count(1)

    def attachment(self) -> bytes:
        """Return the attachment for the next message or request."""
        return attachment(next(self._sequence), time.time_ns(), self._gid)

    def close(self) -> None:
        """Undeclare the endpoint. Idempotent."""
        declared, self._declared = self._declared, ()
        for each in declared:
            # Closing the session has already undeclared the endpoint.
            with contextlib.suppress(self._fault):
                each.undeclare()
