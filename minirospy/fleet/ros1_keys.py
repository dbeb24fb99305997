"""The keys of zenoh-bridge-ros1, and its beacons. Pure.

Written from the source of that bridge (github.com/eclipse-zenoh/zenoh-plugin-ros1, May 2025)::

    HEX/MD5/NAMESPACE/NAME                               messages of a topic; queries of a service
    ros1_discovery_info/*/KIND/HEX/MD5/NAMESPACE/NAME    a beacon: some bridge has such a resource

HEX is the type name, with two hexadecimal digits per byte; NAME has no leading slash; NAMESPACE is ``*``, which matches
every other namespace, unless bridges are separated. KIND is pub, sub or srv; cl would be a service client, which no
bridge announces. A beacon is empty, and is put every second. A bridge may stop its own beacons while another bridge sends
the same key, so a beacon shows that some bridge has the resource, but not which one or how many.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from minirospy.base.errors import BridgeError
from minirospy.fleet.keys import UNKNOWN_MD5, TopicToken, is_global_name, is_md5

__all__ = [
    "EVERY_NAMESPACE",
    "LOST_SECONDS",
    "MAX_RESOURCES",
    "PERIOD",
    "Beacons",
    "Resource",
    "SharedTopic",
    "Sightings",
    "beacon_key",
    "beacon_pattern",
    "data_key",
    "parse_beacon",
    "parse_namespace",
    "shared_topics",
]

EVERY_NAMESPACE = "*"
PERIOD = 1.0  # seconds between beacons of a resource
LOST_SECONDS = 5.0
"""Seconds without a beacon after which a resource counts as lost.

A bridge sends no beacons while another bridge sends the same ones. If the other bridge exits, the first needs up to three
periods to resume its beacons. zenoh-bridge-ros1 itself takes 3 to 6 s to detect the loss.
"""
MAX_RESOURCES = 9_000
"""Maximum number of remote resources to track; the master accepts at most 10,000 names per node."""

_ROOT = "ros1_discovery_info"
_KINDS = ("pub", "sub", "srv", "cl")
_ANY = b"*".hex()
_MAX_KEY = 1_000
_HEX = re.compile(r"(?:[0-9a-f]{2})+")
_TYPE = re.compile(r"[A-Za-z]\w{0,127}/[A-Za-z]\w{0,127}", re.ASCII)
_NAMESPACE = re.compile(r"[A-Za-z0-9_.-]{1,64}")


class Resource(NamedTuple):
    """A topic that other bridges publish ("pub") or subscribe to ("sub"), or a service that they offer ("srv")."""

    kind: str
    name: str
    type: str
    md5sum: str


class SharedTopic(NamedTuple):
    """A topic with a single type, shared with other bridges. ``token`` describes its local use.

    ``is_offered`` is True if other bridges publish it, ``is_wanted`` if they subscribe to it.
    """

    token: TopicToken
    is_offered: bool = False
    is_wanted: bool = False

    def has_type_of(self, other: TopicToken) -> bool:
        """Return whether ``other`` has the same type as this topic."""
        return (self.token.type, self.token.md5sum) == (other.type, other.md5sum)


def shared_topics(
    local: Mapping[str, TopicToken], remote: Iterable[Resource]
) -> tuple[dict[str, SharedTopic], dict[str, str]]:
    """Return two dicts keyed by topic name: the shared topics, and the reasons why other remote topics are ignored.

    A remote topic is ignored if its type differs. The local type takes precedence; without one, the first remote type does.
    """
    found = {name: SharedTopic(token) for name, token in local.items() if token.md5sum != UNKNOWN_MD5}
    conflicts = {}
    for kind, name, type_, md5sum in remote:
        if kind == "srv":
            continue
        token = local.get(name, TopicToken("-", "-", name, type_, UNKNOWN_MD5, False, False))
        topic = found.get(name) or SharedTopic(token._replace(md5sum=md5sum))
        if (topic.token.type, topic.token.md5sum) != (type_, md5sum):
            conflicts[name] = f"{type_} [{md5sum}], not {topic.token.type} [{topic.token.md5sum}]"
        elif kind == "pub":
            found[name] = topic._replace(is_offered=True)
        else:
            found[name] = topic._replace(is_wanted=True)
    return found, conflicts


def parse_namespace(text: str) -> str:
    """Return the namespace used in keys. Raise BridgeError if ``text`` is not a single key chunk."""
    if text != EVERY_NAMESPACE and not _NAMESPACE.fullmatch(text):
        raise BridgeError(
            f"--ros1-keys {text}: is not a namespace of zenoh-bridge-ros1, as * or robot1: letters, digits, _ . and -"
        )
    return text


def data_key(type_: str, md5sum: str, name: str, namespace: str) -> str:
    """Return the key on which a topic's messages, or a service's queries, are sent."""
    return f"{type_.encode().hex()}/{md5sum}/{namespace}/{name.strip('/')}"


def beacon_key(resource: Resource, namespace: str) -> str:
    """Return the key on which a resource's beacons are sent."""
    kind, name, type_, md5sum = resource
    return f"{_ROOT}/*/{kind}/{data_key(type_, md5sum, name, namespace)}"


def beacon_pattern(namespace: str) -> str:
    """Return the key expression that matches all beacons in a namespace."""
    return f"{_ROOT}/*/*/*/*/{namespace}/*/**"


def parse_beacon(key: str) -> Resource | None:
    """Return the resource of a beacon, or None for a service client, or a subscriber that accepts any type.

    Raise BridgeError if the beacon is invalid.
    """
    if len(key) > _MAX_KEY:
        raise BridgeError(f"its key has {len(key)} characters")
    chunks = key.split("/", 6)
    if len(chunks) < 7 or chunks[0] != _ROOT:
        raise BridgeError("its key has not seven parts")
    _, _, kind, hexadecimal, md5sum, _, name = chunks
    if kind not in _KINDS:
        raise BridgeError(f"[{kind}] is not one of {', '.join(_KINDS)}")
    if hexadecimal == _ANY or kind == "cl":
        return None
    if not _HEX.fullmatch(hexadecimal):
        raise BridgeError(f"[{hexadecimal}] is not a type's name in hexadecimal digits")
    type_ = bytes.fromhex(hexadecimal).decode(errors="replace")
    if not _TYPE.fullmatch(type_):
        raise BridgeError(f"[{type_}] is not the name of a type")
    if not is_md5(md5sum):
        raise BridgeError(f"[{md5sum}] is not an md5sum")
    if not is_global_name(f"/{name}"):
        raise BridgeError(f"[/{name}] is not the name of a topic or service")
    return Resource(kind, f"/{name}", type_, md5sum)


@dataclass
class _Beacon:
    due: float
    is_received: bool = False
    is_silent: bool = False
    is_resuming: bool = False


class Beacons:
    """Schedules beacons for local resources, one per period, unless other bridges already send the same beacon."""

    def __init__(self, random: Callable[[], float]) -> None:
        """Create an empty schedule. ``random`` returns a number in [0, 1)."""
        self._random = random
        self._beacons: dict[str, _Beacon] = {}

    def __len__(self) -> int:
        return len(self._beacons)

    def update(self, keys: Iterable[str], now: float) -> None:
        """Set the keys of the local resources. The beacons of new resources are due immediately."""
        before = self._beacons
        self._beacons = {key: before.get(key) or _Beacon(now) for key in keys}

    def received(self, key: str) -> None:
        """Record that another bridge has sent a beacon."""
        beacon = self._beacons.get(key)
        if beacon:
            beacon.is_received = True

    def due(self, now: float) -> list[str]:
        """Return the keys whose beacons are due at time ``now``, in seconds."""
        found = []
        for key, beacon in self._beacons.items():
            if beacon.due > now:
                continue
            is_received, beacon.is_received = beacon.is_received, False
            beacon.due = now + PERIOD
            if is_received:
                # Decide at random whether to stop, so that about half of the bridges sending this beacon continue.
                beacon.is_silent = beacon.is_silent or self._random() < 0.5
                beacon.is_resuming = False
            elif beacon.is_silent and not beacon.is_resuming:
                # Resume after a random delay, so that not all silent bridges resume at the same time.
                beacon.is_resuming = True
                beacon.due = now + self._random() * PERIOD
            else:
                beacon.is_silent = beacon.is_resuming = False
            if not beacon.is_silent:
                found.append(key)
        return found


class Sightings:
    """The remote resources from which beacons have arrived recently."""

    def __init__(self) -> None:
        self._seen: dict[Resource, float] = {}

    def __iter__(self) -> Iterator[Resource]:
        return iter(self._seen)

    def received(self, resource: Resource, now: float) -> bool:
        """Record a beacon; return whether its resource is new. Raise BridgeError at the maximum number of resources."""
        is_new = resource not in self._seen
        if is_new and len(self._seen) >= MAX_RESOURCES:
            raise BridgeError(f"there are more than {MAX_RESOURCES} topics and services")
        self._seen[resource] = now
        return is_new

    def extend(self, seconds: float, now: float) -> None:
        """Let all resources expire ``seconds`` later, but no later than if their beacons arrived now."""
        self._seen = {resource: min(at + seconds, now) for resource, at in self._seen.items()}

    def forget_lost(self, now: float) -> bool:
        """Remove resources whose last beacon is too old; return whether any were removed."""
        lost = [resource for resource, at in self._seen.items() if now - at > LOST_SECONDS]
        for resource in lost:
            del self._seen[resource]
        return bool(lost)
