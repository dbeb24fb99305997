"""Topics of every robot over Zenoh, in both directions: /tf, /tf_static, /clock and /rosout, compared with rosbags."""

from __future__ import annotations

import queue
from io import BytesIO
from typing import Any

import pytest
from geometry_msgs.msg import TransformStamped
from rosgraph_msgs.msg import Clock, Log
from tf2_msgs.msg import TFMessage

from minirospy import Node
from minirospy.aio.raw import raw_class
from minirospy.core.idl.load import message_class
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.ros2.bridge import PassingToRos2, Ros2Bridge
from minirospy.ros2.links import Direction
from tests.ros2.ros2_definitions import typestore
from tests.ros2.test_ros2_zenoh import LIMIT, RmwNode, domain, endpoint, node, zenoh
from tests.ros2.test_ros2_zenoh_actions import bridged, in_thread
from tests.waiting import until, wait_until

__all__ = ["domain", "endpoint", "node"]  # fixtures

KEYS = {
    "/tf": "tf2_msgs::msg::dds_::TFMessage_/RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    "/clock": "rosgraph_msgs::msg::dds_::Clock_/RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
    "/rosout": "rcl_interfaces::msg::dds_::Log_/RIHS01_e28ce254ca8abc06abf92773b74602cdbf116ed34fbaf294fb9f81da9f318eac",
}
"""Types with their hashes in ROS 2 Kilted."""
KEYS["/tf_static"] = KEYS["/tf"]
TYPES = {
    "/tf": "tf2_msgs/TFMessage",
    "/tf_static": "tf2_msgs/TFMessage",
    "/clock": "rosgraph_msgs/Clock",
    "/rosout": "rosgraph_msgs/Log",
}
STATIC = "1:1:,1:,:,:,,"  # QoS: reliable, transient local, depth 1


def key_of(topic: str) -> str:
    return f"0{topic}/{KEYS[topic]}"


def data_of(message: Any) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def transforms(*children: str) -> bytes:
    """Return a serialized ROS 1 TFMessage."""
    found = []
    for number, child in enumerate(children, 1):
        each = TransformStamped(child_frame_id=child)
        each.header.frame_id, each.header.stamp.secs = "map", number
        each.transform.translation.x, each.transform.rotation.w = number / 2, 1.0
        found.append(each)
    return data_of(TFMessage(transforms=found))


def children(data: bytes) -> set[str]:
    message: Any = TFMessage().deserialize(data)
    return {each.child_frame_id for each in message.transforms}


def to_ros2(data: bytes) -> bytes:
    return bytes(typestore().ros1_to_cdr(data, "tf2_msgs/msg/TFMessage"))


def to_ros1(data: bytes) -> bytes:
    return bytes(typestore().cdr_to_ros1(data, "tf2_msgs/msg/TFMessage"))


class Ros1:
    """The ROS 1 endpoints. References are kept, because a subscription to which nothing refers is closed."""

    def __init__(self, node: Node, bridge: Ros2Bridge) -> None:
        self.node = node
        self.bridge = bridge
        self.kept: list[Any] = []

    async def publish(self, topic: str, data: bytes, *, latch: bool = False) -> Any:
        class_ = raw_class(InterfaceType.of(message_class(TYPES[topic])))
        publisher = await self.node.advertise(topic, class_, latch=latch)
        self.kept.append(publisher)
        if not latch:
            # A subscriber with the bridge's name may also be the short connection that reads the header.
            await until(lambda: self._is_bridged(topic))
        publisher.publish_raw(data)
        return publisher

    def _is_bridged(self, topic: str) -> bool:
        """Return whether the bridge's subscription is connected."""
        for link, passing in self.bridge.topics.links.items():
            if link.topic == topic and link.direction is Direction.TO_ROS2:
                assert isinstance(passing, PassingToRos2)
                return bool(passing._subscription and passing._subscription.headers)
        return False

    async def subscribe(self, topic: str) -> queue.Queue[bytes]:
        came: queue.Queue[bytes] = queue.Queue()
        self.kept.append(await self.node.subscribe_raw(topic, lambda frame, _: came.put(bytes(frame))))
        return came


def subscribe(node: RmwNode, topic: str, *, static: bool = False) -> queue.Queue[bytes]:
    """Subscribe as rmw_zenoh does; return the queue of received messages."""
    came: queue.Queue[bytes] = queue.Queue()

    def arrived(sample: Any) -> None:
        came.put(sample.payload.to_bytes())

    if static:
        subscriber = zenoh.ext.declare_advanced_subscriber(
            node.session,
            key_of(topic),
            arrived,
            history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1),
            recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
            subscriber_detection=True,
        )
    else:
        subscriber = node.session.declare_subscriber(key_of(topic), arrived)
    node.kept.append(subscriber)
    node.end(len(node.kept), "MS", key_of(topic), STATIC if static else "::,10:,:,:,,")
    return came


def publish(node: RmwNode, topic: str, data: bytes, *, static: bool = False) -> None:
    """Publish as rmw_zenoh does, to current subscribers, or with ``static`` also to later ones."""
    node.end(len(node.kept), "MP", key_of(topic), STATIC if static else "::,10:,:,:,,")
    if static:
        publisher = zenoh.ext.declare_advanced_publisher(
            node.session,
            key_of(topic),
            cache=zenoh.ext.CacheConfig(max_samples=1),
            sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=0.5),
            publisher_detection=True,
        )
    else:
        publisher = node.session.declare_publisher(key_of(topic))
        wait_until(lambda: publisher.matching_status.matching)
    node.kept.append(publisher)
    publisher.put(data)


async def next_of(came: queue.Queue[bytes]) -> bytes:
    found: bytes = await in_thread(lambda: came.get(timeout=LIMIT))
    return found


@pytest.mark.usefixtures("master")
def test_transforms_pass_both_ways_over_zenoh(node: RmwNode, endpoint: str) -> None:
    async def scene(other: Node, peer: RmwNode, bridge: Ros2Bridge) -> None:
        ros1 = Ros1(other, bridge)
        came = await ros1.subscribe("/tf")
        await in_thread(publish, peer, "/tf", to_ros2(transforms("a", "b")))
        # ROS 2 messages have no sequence number, so it is zero.
        assert await next_of(came) == transforms("a", "b")

        there = await in_thread(subscribe, peer, "/tf")
        await ros1.publish("/tf", transforms("c"))
        assert to_ros1(await next_of(there)) == transforms("c")

    bridged(node, endpoint, scene)


@pytest.mark.usefixtures("master")
def test_static_transforms_of_all_publishers_reach_late_subscribers(node: RmwNode, endpoint: str) -> None:
    async def scene(other: Node, peer: RmwNode, bridge: Ros2Bridge) -> None:
        async with Node("second", rosout=False) as second:
            ros1 = [Ros1(each, bridge) for each in (other, second)]
            for each, child in zip(ros1, "ab", strict=True):
                await each.publish("/tf_static", transforms(child), latch=True)
            there = await in_thread(lambda: subscribe(peer, "/tf_static", static=True))
            while children(to_ros1(await next_of(there))) != {"a", "b"}:
                pass
            late = RmwNode(endpoint)
            there = await in_thread(lambda: subscribe(late, "/tf_static", static=True))
            assert children(to_ros1(await next_of(there))) == {"a", "b"}
            late.session.close()

    bridged(node, endpoint, scene)


@pytest.mark.usefixtures("master")
def test_static_transforms_of_ros2_reach_late_ros1_subscribers(node: RmwNode, endpoint: str) -> None:
    async def scene(other: Node, peer: RmwNode, bridge: Ros2Bridge) -> None:
        second = RmwNode(endpoint)
        for each, child in ((peer, "a"), (second, "b")):
            await in_thread(
                lambda each=each, child=child: publish(
                    each, "/tf_static", to_ros2(transforms(child)), static=True
                )
            )
        ros1 = Ros1(other, bridge)
        came = await ros1.subscribe("/tf_static")
        while children(await next_of(came)) != {"a", "b"}:
            pass
        async with Node("late", rosout=False) as late:
            later = Ros1(late, bridge)
            came = await later.subscribe("/tf_static")
            assert children(await next_of(came)) == {"a", "b"}
        second.session.close()

    bridged(node, endpoint, scene)


@pytest.mark.usefixtures("master")
def test_time_passes_both_ways_over_zenoh(node: RmwNode, endpoint: str) -> None:
    async def scene(other: Node, peer: RmwNode, bridge: Ros2Bridge) -> None:
        ros1 = Ros1(other, bridge)
        clock = Clock()
        clock.clock.secs, clock.clock.nsecs = 12, 34
        cdr = b"\0\1\0\0" + data_of(clock)
        came = await ros1.subscribe("/clock")
        await in_thread(publish, peer, "/clock", cdr)
        assert await next_of(came) == data_of(clock)

        there = await in_thread(subscribe, peer, "/clock")
        await ros1.publish("/clock", data_of(clock))
        found = await next_of(there)
        # The last two bytes of the header identify the sender.
        assert (found[:2], found[4:]) == (cdr[:2], cdr[4:])

    bridged(node, endpoint, scene)


@pytest.mark.usefixtures("master")
def test_log_lines_pass_both_ways_over_zenoh(node: RmwNode, endpoint: str) -> None:
    def log(level: int) -> Any:
        store = typestore()
        stamp = store.types["builtin_interfaces/msg/Time"](12, 34)
        return store.types["rcl_interfaces/msg/Log"](stamp, level, "motor", "it is hot", "m.cpp", "run", 7)

    async def scene(other: Node, peer: RmwNode, bridge: Ros2Bridge) -> None:
        ros1 = Ros1(other, bridge)
        came = await ros1.subscribe("/rosout")
        cdr = bytes(typestore().serialize_cdr(log(40), "rcl_interfaces/msg/Log"))
        await in_thread(lambda: publish(peer, "/rosout", cdr, static=True))
        line: Any = Log().deserialize(await next_of(came))
        assert (line.level, line.name, line.msg) == (Log.ERROR, "motor", "it is hot")
        assert (line.file, line.function, line.line) == ("m.cpp", "run", 7)
        assert (line.header.stamp.secs, line.header.stamp.nsecs) == (12, 34)

        there = await in_thread(subscribe, peer, "/rosout")
        await ros1.publish("/rosout", data_of(line))
        found = typestore().deserialize_cdr(await next_of(there), "rcl_interfaces/msg/Log")
        assert found == log(40)

    bridged(node, endpoint, scene)
