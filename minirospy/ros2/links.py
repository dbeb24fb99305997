"""Which topics are bridged, and how: from what both graphs have at a moment. Pure."""

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
"""How the names of all bridges start, on both sides: their ends do not count as ends."""


def parse_domain(text: str) -> str:
    """Return the domain of ROS 2 that ``ROS_DOMAIN_ID`` names: 0 if it is empty. Raise BridgeError."""
    if not re.fullmatch(r"[0-9]{0,9}", text):
        raise BridgeError(f"ROS_DOMAIN_ID is [{escaped(text)}]: it must be a number, such as 0")
    return str(int(text or "0"))


class Direction(Enum):
    """Where messages go."""

    TO_ROS2 = "1 -> 2"
    TO_ROS1 = "2 -> 1"


@dataclass(frozen=True)
class Ros2End:
    """A publisher or subscriber in ROS 2; ``type`` is ``pkg/Name``."""

    node: str
    type: str
    is_reliable: bool = True
    is_transient_local: bool = False


@dataclass(frozen=True)
class Ros2Topic:
    """The ends of a topic in ROS 2."""

    publishers: tuple[Ros2End, ...] = ()
    subscribers: tuple[Ros2End, ...] = ()


@dataclass(frozen=True)
class Link:
    """A topic that is bridged in one direction.

    ``is_latched``: the last message is kept for those who come later. ``is_reliable``: of the subscription in ROS 2.
    """

    topic: str
    direction: Direction
    ros1_type: str
    ros2_type: str
    is_latched: bool = False
    is_reliable: bool = True

    @property
    def title(self) -> str:
        """How messages to people name the link."""
        return self.topic


def is_bridge(node: str) -> bool:
    """Return whether a node is a bridge, by its name on either side."""
    return node.rpartition("/")[2].startswith(BRIDGE_PREFIX)


def links(
    ros1: Snapshot,
    ros2: Mapping[str, Ros2Topic],
    is_latched: Callable[[str, str], bool],
    ros1_type: Callable[[str], str],
) -> list[Link]:
    """Return what is to be bridged: each topic with an end on either side, other than those of bridges.

    ``is_latched(topic, node)``: whether a publisher of ROS 1 latches.
    ``ros1_type``: a type of ROS 2 -> that of ROS 1, for a subscriber of ROS 1 that takes any type, as `rostopic echo`.
    """
    found = []
    for topic in sorted(ros1.topics & ros2.keys()):
        type_ = ros1.types.get(topic)
        publishers = [node for node in ros1.publishers.get(topic, ()) if not is_bridge(node)]
        subscribers = [node for node in ros1.subscribers.get(topic, ()) if not is_bridge(node)]
        writers = [end for end in ros2[topic].publishers if not is_bridge(end.node)]
        readers = [end for end in ros2[topic].subscribers if not is_bridge(end.node)]

        if publishers and readers and type_ is not None:
            # Who wants the last message is served only by a publisher that keeps it.
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
                    # A subscription that wants more than a publisher offers gets nothing of it.
                    all(end.is_reliable for end in writers),
                )
            )
    return found


def _type_of(ends: list[Ros2End], ros1_type: str) -> str:
    """Return the type of ends that may differ: preferred is the name of ROS 1, then the first by name."""
    types = sorted({end.type for end in ends})
    return ros1_type if ros1_type in types else types[0]


def marker(graph: str) -> bytes:
    """Return the header of CDR for messages that come from a graph of ROS 1, of which ``graph`` is the run_id.

    Readers ignore the options in its last two bytes; the bridge recognizes by them what it must not send back. The two
    lowest bits, which XCDR version 2 uses, stay zero, and the options as a whole are never those of other publishers.
    """
    import zlib

    number = (zlib.crc32(graph.encode()) % 0x3FFF + 1) << 2
    return bytes((0, 1)) + number.to_bytes(2, "big")
