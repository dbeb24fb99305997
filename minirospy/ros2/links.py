"""Selects topics to bridge, and their settings, from snapshots of both graphs. Pure."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum

from minirospy.base.errors import BridgeError
from minirospy.base.escape import escaped
from minirospy.introspect.snapshot import Snapshot

__all__ = [
    "BRIDGE_PREFIX", "Direction", "Link", "Ros2End", "Ros2Topic", "is_bridge", "links", "marker", "parse_domain",
]  # fmt: skip

BRIDGE_PREFIX = "minirospy_ros2_bridge"
"""Prefix of the node names of all bridges, on both sides. Endpoints of bridges are ignored."""


def parse_domain(text: str) -> str:
    """Return the ROS 2 domain given by ``ROS_DOMAIN_ID`` (empty: 0). Raise BridgeError if ``text`` is invalid."""
    if not re.fullmatch(r"[0-9]{0,9}", text):
        raise BridgeError(f"ROS_DOMAIN_ID is [{escaped(text)}]: it must be a number, such as 0")
    return str(int(text or "0"))


class Direction(Enum):
    """The direction in which messages are sent."""

    TO_ROS2 = "1 -> 2"
    TO_ROS1 = "2 -> 1"


@dataclass(frozen=True)
class Ros2End:
    """A publisher or subscriber in ROS 2. ``type`` has the form ``pkg/Name``."""

    node: str
    type: str
    is_reliable: bool = True
    is_transient_local: bool = False


@dataclass(frozen=True)
class Ros2Topic:
    """The endpoints of a topic in ROS 2."""

    publishers: tuple[Ros2End, ...] = ()
    subscribers: tuple[Ros2End, ...] = ()


@dataclass(frozen=True)
class Link:
    """A topic to be bridged in one direction.

    If ``is_latched``, later subscribers receive the last message. ``is_reliable`` is the reliability of the ROS 2
    subscription.
    """

    topic: str
    direction: Direction
    ros1_type: str
    ros2_type: str
    is_latched: bool = False
    is_reliable: bool = True

    @property
    def title(self) -> str:
        """Return the link's name for log messages."""
        return self.topic


def is_bridge(node: str) -> bool:
    """Return whether a node is a bridge, according to its name. The prefix is the same in ROS 1 and ROS 2."""
    return node.rpartition("/")[2].startswith(BRIDGE_PREFIX)


def links(
    ros1: Snapshot,
    ros2: Mapping[str, Ros2Topic],
    is_latched: Callable[[str, str], bool],
    ros1_type: Callable[[str], str],
) -> list[Link]:
    """Return the topics to bridge: those with endpoints on both sides, not counting endpoints of bridges.

    ``is_latched(topic, node)`` returns whether a ROS 1 publisher latches. ``ros1_type(ros2_type)`` returns the ROS 1 type for
    a ROS 1 subscriber to any type, such as `rostopic echo`.
    """
    found = []
    for topic in sorted(ros1.topics & ros2.keys()):
        type_ = ros1.types.get(topic)
        publishers = [node for node in ros1.publishers.get(topic, ()) if not is_bridge(node)]
        subscribers = [node for node in ros1.subscribers.get(topic, ()) if not is_bridge(node)]
        writers = [end for end in ros2[topic].publishers if not is_bridge(end.node)]
        readers = [end for end in ros2[topic].subscribers if not is_bridge(end.node)]

        if publishers and readers and type_ is not None:
            # A transient local subscriber receives messages only from publishers that are transient local, too.
            keeps = any(end.is_transient_local for end in readers)
            latched = keeps or any(is_latched(topic, node) for node in publishers)
            found.append(Link(topic, Direction.TO_ROS2, type_, _type_of(readers, type_), latched))
        if writers and subscribers:
            found.append(
                Link(
                    topic,
                    Direction.TO_ROS1,
                    type_ or ros1_type(_type_of(writers, "")),
                    _type_of(writers, type_ or ""),
                    all(end.is_transient_local for end in writers),
                    # A reliable subscriber receives nothing from a best-effort publisher.
                    all(end.is_reliable for end in writers),
                )
            )
    return found


def _type_of(ends: list[Ros2End], ros1_type: str) -> str:
    """Return the type of a topic. If its endpoints' types differ, prefer ROS 1's type name, then the alphabetically first one."""
    types = sorted({end.type for end in ends})
    return ros1_type if ros1_type in types else types[0]


def marker(graph: str) -> bytes:
    """Return the CDR header that marks messages from the ROS 1 graph with run_id ``graph``.

    Readers ignore the options in the header's last two bytes. The bridge uses these bytes to recognize messages that it
    must not send back. The two lowest bits, which XCDR version 2 uses, stay zero; other publishers do not use the other
    bits.
    """
    import zlib

    number = (zlib.crc32(graph.encode()) % 0x3FFF + 1) << 2
    return bytes((0, 1)) + number.to_bytes(2, "big")
