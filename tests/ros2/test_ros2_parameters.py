"""Parameters in the ROS 2 bridge: names and values on both sides, and the services in ROS 1."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any
from xmlrpc.client import Binary

import pytest

from minirospy import Node
from minirospy.aio.raw import call_raw
from minirospy.base.errors import BridgeError, ServiceException
from minirospy.core.idl.load import service_class
from minirospy.ros2.bridge import Ros2Bridge, Ros2Options
from minirospy.ros2.links import BRIDGE_PREFIX
from minirospy.ros2.parameter_values import (
    Value,
    leaves,
    listed,
    ros1_name,
    ros1_value,
    ros2_name,
    ros2_value,
)
from tests.ros2.ros2_definitions import catalogue
from tests.ros2.test_ros2_bridge import FakeSide

LIMIT = 60.0


def test_names_are_written_with_dots_in_ros2() -> None:
    assert ros2_name("/robot/arm/speed") == "robot.arm.speed"
    assert ros1_name("robot.arm.speed") == "/robot/arm/speed"
    assert list(leaves({"a": {"b": 1, "c": {}}, "d": [1]})) == ["/a/b", "/d"]


@pytest.mark.parametrize(
    ("value", "type_"),
    [(True, 1), (3, 2), (0.5, 3), ("a", 4), ([True], 6), ([1, 2], 7), ([0.5], 8), (["a"], 9)],
)
def test_values_pass_to_ros2_and_back(value: object, type_: int) -> None:
    assert ros2_value(value) == Value(type_, value)
    assert ros1_value(ros2_value(value)) == value


def test_values_missing_in_ros2_become_the_nearest_ones() -> None:
    assert ros2_value([1, 0.5]) == Value(8, [1.0, 0.5])
    assert ros2_value([]) == Value(9, [])
    assert ros2_value([{"a": 1}]) == Value(4, '[{"a": 1}]')
    assert ros2_value(Binary(b"ab")) == Value(5, [b"a", b"b"])
    back = ros1_value(Value(5, [b"a", b"b"]))
    assert isinstance(back, Binary)
    assert back.data == b"ab"


@pytest.mark.parametrize("value", [Value(2, 2**31), Value(7, [0, -(2**31) - 1]), Value(0), Value(10, 1)])
def test_values_that_ros1_has_not_are_refused(value: Value) -> None:
    with pytest.raises(BridgeError):
        ros1_value(value)


def test_lists_have_the_prefixes_and_depth_that_are_wanted() -> None:
    names = ["a", "b.c", "b.d.e"]
    assert listed(names, [], 0) == (names, ["b", "b.d"])
    assert listed(names, [], 1) == (["a"], [])
    assert listed(names, ["b"], 0) == (["b.c", "b.d.e"], ["b", "b.d"])
    assert listed(names, ["b"], 1) == (["b.c"], ["b"])
    assert listed(names, ["a", "b.d"], 0) == (["a", "b.d.e"], ["b.d"])


def text(value: str) -> bytes:
    return len(value).to_bytes(4, "little") + value.encode()


def bridged(scene: Callable[[Node, FakeSide], Any]) -> None:
    side = FakeSide()

    async def run() -> None:
        async with Node("other", rosout=False) as node, Node(BRIDGE_PREFIX, rosout=False) as own:
            bridge = Ros2Bridge(own, side, Ros2Options(), catalogue())
            try:
                await bridge.start()
                await asyncio.wait_for(scene(node, side), LIMIT)
            finally:
                await bridge.close()

    asyncio.run(run())


@pytest.mark.usefixtures("master")
def test_parameters_of_ros1_are_read_and_set_by_the_store() -> None:
    async def scene(node: Node, side: FakeSide) -> None:
        await node.set_param("/robot", {"speed": 1.5, "arm": {"on": True}})
        assert {"robot.speed", "robot.arm.on"} <= set(await side.store.names())
        assert await side.store.get(["robot.speed", "robot.arm", "none"]) == [
            Value(3, 1.5), Value(0), Value(0),
        ]  # fmt: skip
        both = [("robot.speed", Value(2, 7)), ("robot.big", Value(2, 2**40))]
        reasons = await side.store.set(both, atomically=True)
        assert reasons == ["", f"{2**40} does not fit into the 32 bits of an integer in ROS 1"]
        assert await node.get_param("/robot/speed") == 1.5
        await side.store.set(both, atomically=False)
        assert await node.get_param("/robot/speed") == 7
        assert await side.store.set([("robot.speed", Value(0)), ("", Value(2, 1))], atomically=False) == [
            "", "a parameter needs a name",
        ]  # fmt: skip
        assert not await node.has_param("/robot/speed")

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_parameters_of_ros2_are_read_and_set_by_services() -> None:
    async def scene(node: Node, side: FakeSide) -> None:
        async def call(service: str, *texts: str) -> bytes:
            type_ = service_class("rosapi/" + service.title().replace("_", ""))
            return await call_raw(
                node, f"/{BRIDGE_PREFIX}/{service}", type_._md5sum, b"".join(map(text, texts))
            )

        assert await call("set_param", "/peer:gains", "[1, 2]") == b""
        assert side.parameters.values == {"gains": Value(7, [1, 2])}
        assert await call("get_param", "/peer:gains", "") == text("[1, 2]")
        assert await call("get_param", "/peer:none", "0") == text("0")
        assert await call("get_param_names") == b"\1\0\0\0" + text("/peer:gains")
        for service, texts, reason in (
            ("get_param", ("/peer:none", ""), r"has no parameter \[none\]"),
            ("get_param", ("none", ""), "write /node:parameter"),
            ("set_param", ("/peer:gains", "{"), "is not JSON"),
            ("set_param", ("/peer:gains", "[" * 100_000), "is not JSON"),
            ("set_param", ("/peer:gains", str(2**64)), "64 bits"),
            ("set_param", ("/peer:gains", f"[1.5, {10**400}]"), "does not fit into ROS 2"),
            ("get_param", ("/peer:gains",), "ends too early"),
            ("set_param", (), "ends too early"),
        ):
            with pytest.raises(ServiceException, match=reason):
                await call(service, *texts)

    bridged(scene)
