"""A simulated robot with zenoh-bridge-ros1, based only on that bridge's source and on eclipse-zenoh.

It uses no code from minirospy, so the keys are built independently.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from typing import Any

import zenoh

PERIOD = 1.0


class Ros1Peer:
    """Sends beacons, publishes, subscribes, offers services, and calls services.

    It connects to ``endpoint``, or with ``listens``, listens there.
    """

    def __init__(
        self, endpoint: str, namespace: str = "*", mode: str = "client", *, listens: bool = False
    ) -> None:
        config = zenoh.Config()
        for key, value in (
            ("mode", mode),
            ("connect/endpoints", [] if listens else [endpoint]),
            ("listen/endpoints", [endpoint] if listens else []),
            ("scouting/multicast/enabled", False),
        ):
            config.insert_json5(key, json.dumps(value))
        self.session: Any = zenoh.open(config)
        self.namespace = namespace
        self.received: dict[str, int] = {}
        """The number of beacons from other peers, by key from the kind on."""
        self._beacons: dict[str, Any] = {}
        self._declared: list[Any] = []
        self._ended = threading.Event()
        self._lock = threading.Lock()
        pattern = f"ros1_discovery_info/*/*/*/*/{namespace}/*/**"
        self._declared.append(self.session.declare_subscriber(pattern, self._beacon_arrived))
        self._thread = threading.Thread(target=self._beat, daemon=True)
        self._thread.start()

    def key(self, type_: str, md5sum: str, name: str) -> str:
        return f"{type_.encode().hex()}/{md5sum}/{self.namespace}/{name.strip('/')}"

    def announce(self, kind: str, type_: str, md5sum: str, name: str) -> None:
        """Send beacons for a resource until :meth:`withdraw`."""
        self.announce_key(f"ros1_discovery_info/*/{kind}/{self.key(type_, md5sum, name)}")

    def announce_key(self, key: str) -> None:
        publisher = self.session.declare_publisher(
            key,
            reliability=zenoh.Reliability.BEST_EFFORT,
            allowed_destination=zenoh.Locality.REMOTE,
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.BACKGROUND,
        )
        with self._lock:
            self._beacons[key] = publisher
        publisher.put(b"")

    def withdraw(self, kind: str, type_: str, md5sum: str, name: str) -> None:
        with self._lock:
            self._beacons.pop(f"ros1_discovery_info/*/{kind}/{self.key(type_, md5sum, name)}").undeclare()

    def has_received(self, kind: str, type_: str, md5sum: str, name: str) -> bool:
        return f"{kind}/{self.key(type_, md5sum, name)}" in self.received

    def publisher(self, type_: str, md5sum: str, name: str) -> Any:
        return self.session.declare_publisher(
            self.key(type_, md5sum, name),
            reliability=zenoh.Reliability.RELIABLE,
            allowed_destination=zenoh.Locality.REMOTE,
            congestion_control=zenoh.CongestionControl.BLOCK,
        )

    def subscribe(self, type_: str, md5sum: str, name: str) -> list[bytes]:
        """Return the list to which payloads are appended."""
        found: list[bytes] = []
        subscriber = self.session.declare_subscriber(
            self.key(type_, md5sum, name),
            lambda sample: found.append(sample.payload.to_bytes()),
            allowed_origin=zenoh.Locality.REMOTE,
        )
        self._declared.append(subscriber)
        return found

    def serve(self, type_: str, md5sum: str, name: str, answer: Callable[[bytes], bytes]) -> None:
        """Offer a service as the bridge does: an error is sent as its text, and a query without payload gets no reply."""

        def asked(query: Any) -> None:
            with query:
                if query.payload is None:
                    return
                try:
                    reply = answer(query.payload.to_bytes())
                except RuntimeError as error:
                    reply = str(error).encode()
                query.reply(query.key_expr, reply)

        queryable = self.session.declare_queryable(
            self.key(type_, md5sum, name), asked, allowed_origin=zenoh.Locality.REMOTE
        )
        self._declared.append(queryable)

    def call(self, type_: str, md5sum: str, name: str, request: bytes) -> bytes:
        """Return the first reply. Raise RuntimeError for an error reply, or if there is none."""
        replies = self.session.get(
            self.key(type_, md5sum, name),
            payload=request,
            allowed_destination=zenoh.Locality.REMOTE,
            timeout=60,
        )
        for reply in replies:
            if reply.ok is None:
                raise RuntimeError(reply.err.payload.to_bytes().decode())
            payload: bytes = reply.ok.payload.to_bytes()
            return payload
        raise RuntimeError("no reply")

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        if not self.session.is_closed():
            self.session.close()

    def _beacon_arrived(self, sample: Any) -> None:
        key = str(sample.key_expr).split("/", 2)[2]
        self.received[key] = self.received.get(key, 0) + 1

    def _beat(self) -> None:
        while not self._ended.wait(PERIOD):
            with self._lock:
                publishers = list(self._beacons.values())
            for publisher in publishers:
                publisher.put(b"")
