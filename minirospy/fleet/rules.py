"""Rules that select the topics and services that a gateway forwards, and set their rates and priorities. Pure."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from fnmatch import fnmatchcase

from minirospy.base.errors import BridgeError
from minirospy.base.name_filter import NameFilter
from minirospy.fleet.keys import is_global_name
from minirospy.introspect.snapshot import Snapshot

__all__ = [
    "Export",
    "GatewayRules",
    "Priority",
    "Throttle",
    "exported_services",
    "exported_topics",
    "is_logger_service",
    "parse_priorities",
    "parse_rates",
    "priority_of_type",
]

_MAX_HERTZ = 10_000.0
_LOGGER_SERVICES = ("/get_loggers", "/set_logger_level")


class Priority(IntEnum):
    """Priority with which a message is sent.

    Each priority has its own queue and thread, so that a slow message does not delay those with a higher priority.
    """

    TELEOP = 0
    DATA = 1
    BULK = 2


_TELEOP_TYPES = {
    "ackermann_msgs/AckermannDrive",
    "ackermann_msgs/AckermannDriveStamped",
    "actionlib_msgs/GoalID",
    "geometry_msgs/Twist",
    "geometry_msgs/TwistStamped",
    "sensor_msgs/Joy",
}
_BULK_TYPES = {
    "nav_msgs/OccupancyGrid",
    "sensor_msgs/CompressedImage",
    "sensor_msgs/Image",
    "sensor_msgs/PointCloud",
    "sensor_msgs/PointCloud2",
    "stereo_msgs/DisparityImage",
    "theora_image_transport/Packet",
    "visualization_msgs/MarkerArray",
}


# seconds without a command before zero velocity is published; commands at shorter intervals form one stream
STOP_SECONDS = 0.5


@dataclass(frozen=True)
class GatewayRules:
    """Selects the topics and services to forward, and the rates and priorities of the topics.

    ``rates`` (Hz) and ``priorities`` map patterns of names; the first pattern that matches applies.
    """

    topics: NameFilter = field(default_factory=NameFilter)
    services: NameFilter = field(default_factory=NameFilter)
    parameters: NameFilter = field(default_factory=NameFilter)
    robots: NameFilter = field(default_factory=NameFilter)
    rates: Sequence[tuple[str, float]] = ()
    priorities: Sequence[tuple[str, Priority]] = ()
    has_frames: bool = False
    # seconds without a command before zero velocity is published; 0 disables this
    stop_seconds: float = STOP_SECONDS

    def rate(self, topic: str) -> float:
        """Return a topic's maximum rate in Hz, or 0 if it is not limited."""
        return next((rate for pattern, rate in self.rates if fnmatchcase(topic, pattern)), 0.0)

    def priority(self, topic: str, type_: str) -> Priority:
        """Return the priority of a topic."""
        named = (priority for pattern, priority in self.priorities if fnmatchcase(topic, pattern))
        return next(named, priority_of_type(type_))


@dataclass(frozen=True)
class Export:
    """A topic to announce, with its local publishers and subscribers, except gateways."""

    topic: str
    type: str
    publishers: tuple[str, ...]
    subscribers: tuple[str, ...]


class Throttle:
    """Limits messages to a rate in Hz by spacing them evenly; 0 means no limit."""

    def __init__(self, hertz: float) -> None:
        self._period = 1.0 / hertz if hertz else 0.0
        self._next = 0.0

    def allows(self, now: float) -> bool:
        """Return whether a message may be sent at ``now``, in monotonic seconds."""
        if now < self._next:
            return False
        # Add the period to the due time: starting from ``now``, a limit of 10 Hz would pass only 7.5 of 30 messages per second.
        # After a pause, the due time would be in the past, so use ``now``.
        self._next = max(self._next + self._period, now)
        if self._next <= now:
            self._next = now + self._period
        return True


def priority_of_type(type_: str) -> Priority:
    """Return the default priority for a type, used if no rule matches the topic."""
    if type_ in _TELEOP_TYPES:
        return Priority.TELEOP
    return Priority.BULK if type_ in _BULK_TYPES else Priority.DATA


def parse_rates(words: Iterable[str]) -> list[tuple[str, float]]:
    """Parse patterns and rates in Hz, such as ``/camera/*=5``. Raise BridgeError if one is invalid."""
    found = []
    for word in words:
        pattern, text = _halves(word, "--rate", "/camera/*=5")
        try:
            hertz = float(text)
        except ValueError:
            hertz = -1.0
        if not 0 < hertz <= _MAX_HERTZ:
            raise BridgeError(f"--rate {word}: [{text}] is not a rate in Hz, as 5 or 0.2")
        found.append((pattern, hertz))
    return found


def parse_priorities(words: Iterable[str]) -> list[tuple[str, Priority]]:
    """Parse patterns and priorities, such as ``/arm/*=teleop``. Raise BridgeError if one is invalid."""
    names = {priority.name.lower(): priority for priority in Priority}
    found = []
    for word in words:
        pattern, text = _halves(word, "--priority", "/arm/*=teleop")
        if text not in names:
            raise BridgeError(f"--priority {word}: [{text}] is not one of {', '.join(names)}")
        found.append((pattern, names[text]))
    return found


def exported_topics(
    snapshot: Snapshot, own: Collection[str], allows: Callable[[str], bool], hidden: Iterable[str] = ()
) -> dict[str, Export]:
    """Return the topics that a robot announces: their type is known, and a node other than a gateway uses them.

    ``own`` contains the gateways' nodes, ``hidden`` the namespaces of imported robots, whose topics are not announced again.
    """
    starts = tuple(f"/{name}/" for name in hidden)
    found = {}
    for topic in sorted(snapshot.topics):
        type_ = snapshot.types.get(topic)
        if type_ is None or not _is_shown(topic, starts) or not allows(topic):
            continue
        publishers = _others(snapshot.publishers.get(topic, ()), own)
        subscribers = _others(snapshot.subscribers.get(topic, ()), own)
        if publishers or subscribers:
            found[topic] = Export(topic, type_, publishers, subscribers)
    return found


def exported_services(
    snapshot: Snapshot, own: Collection[str], allows: NameFilter, hidden: Iterable[str] = ()
) -> dict[str, tuple[str, ...]]:
    """Return the services that a robot announces, each with its nodes.

    Each node's two logger services are left out, unless the filter was given patterns.
    """
    starts = tuple(f"/{name}/" for name in hidden)
    every = allows == NameFilter()
    found = {}
    for service, nodes in sorted(snapshot.services.items()):
        others = _others(nodes, own)
        if not others or not _is_shown(service, starts) or not allows(service):
            continue
        if not (every and is_logger_service(service)):
            found[service] = others
    return found


def is_logger_service(service: str) -> bool:
    """Return whether this is one of the two logger services that every node provides."""
    return service.endswith(_LOGGER_SERVICES)


def _halves(word: str, option: str, example: str) -> tuple[str, str]:
    pattern, equals, text = word.rpartition("=")
    if not equals or not pattern.startswith(("/", "*")):
        raise BridgeError(f"{option} {word}: is not of the form GLOB=VALUE, as {example}")
    return pattern, text


def _is_shown(name: str, hidden: tuple[str, ...]) -> bool:
    return is_global_name(name) and not name.startswith(hidden)


def _others(nodes: Sequence[str], own: Collection[str]) -> tuple[str, ...]:
    return tuple(node for node in nodes if node not in own)
