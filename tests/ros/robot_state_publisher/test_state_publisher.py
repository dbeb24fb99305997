"""robot_state_publisher and joint_state_publisher as nodes."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable

import pytest
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage

from minirospy import Node
from minirospy.runtime.rpc.master_proxy import MasterProxy
from tests.ros.robot_state_publisher.conftest import ARM, SECONDS, Start, end

Frame = tuple[str, str]


def set_param(master: str, name: str, value: object) -> None:
    proxy = MasterProxy(master, "/test")
    proxy.set_param(name, value)
    proxy.close()


@pytest.fixture
def arm(master: str) -> str:
    text = ARM.read_text(encoding="utf-8")
    set_param(master, "/robot_description", text)
    return text


def run(body: Callable[[Node], Awaitable[None]]) -> None:
    async def main() -> None:
        async with Node("test", rosout=False) as node:
            await asyncio.wait_for(body(node), SECONDS)

    asyncio.run(main())


def frames(message: TFMessage) -> list[Frame]:
    return [(each.header.frame_id, each.child_frame_id) for each in message.transforms]


def test_fixed_joints_are_latched_and_moving_ones_published(arm: str, start: Start) -> None:
    start("robot_state_publisher", "robot_state_publisher")

    async def body(node: Node) -> None:
        async for static in node.subscribe("/tf_static", TFMessage):
            assert frames(static) == [("forearm", "tool")]
            break
        states = node.advertise("joint_states", JointState)
        moving = node.subscribe("/tf", TFMessage)
        await moving.wait_for_publishers()
        await states.wait_for_subscribers()
        state = JointState(name=["elbow", "foo"], position=[math.pi, 1.0])
        state.header.stamp = node.now()
        await states.publish(state)
        async for message in moving:
            assert frames(message) == [("upper_arm", "forearm")]
            assert message.transforms[0].header.stamp == state.header.stamp
            break

    run(body)


def test_prefix_is_found_upwards_and_fixed_joints_repeat_without_tf_static(
    arm: str, master: str, start: Start
) -> None:
    set_param(master, "/robot/tf_prefix", "left")
    words = ("__ns:=/robot", "_use_tf_static:=false", "_publish_frequency:=20")
    start("robot_state_publisher", "state_publisher", *words)

    async def body(node: Node) -> None:
        stamps = []
        async for message in node.subscribe("/tf", TFMessage):
            assert frames(message) == [("left/forearm", "left/tool")]
            stamps.append(message.transforms[0].header.stamp)
            # If messages arrive late, their stamps are no longer in the future.
            if len(stamps) > 1 and stamps[-1] > node.now():
                break
        assert stamps[0] < stamps[1]

    run(body)


@pytest.mark.parametrize(
    ("program", "value", "words"),
    [
        ("robot_state_publisher", None, "Could not find parameter robot_description on parameter server"),
        ("robot_state_publisher", 5, "Could not read parameter /robot_description on parameter server"),
        (
            "robot_state_publisher",
            "<robot name='r'>\n<link/></robot>",
            "No name given for the link. (/robot_description:2)",
        ),
        ("joint_state_publisher", None, "The robot_description parameter is required and not set."),
        ("joint_state_publisher", "<robot", "robot_description:1: not XML: "),
    ],
)
def test_missing_description_is_one_line(
    program: str, value: object, words: str, master: str, start: Start
) -> None:
    if value is not None:
        set_param(master, "/robot_description", value)
    process = start(program, program)
    _, errors = process.communicate(timeout=SECONDS)

    assert process.returncode == 1
    assert words in errors
    assert "Traceback" not in errors


def test_joint_states_follow_parameters_and_sources(arm: str, master: str, start: Start) -> None:
    set_param(
        master, "/joint_state_publisher", {"zeros": {"elbow": 1.5}, "rate": 50, "source_list": ["others"]}
    )
    start("joint_state_publisher", "joint_state_publisher")

    async def body(node: Node) -> None:
        others = node.advertise("others", JointState)
        is_sent = False
        async for message in node.subscribe("joint_states", JointState):
            assert message.name == ["shoulder", "elbow", "left", "right"]
            if message.position[0] == 0.25:
                break
            assert list(message.position) == pytest.approx([0, 1.5, 0.03, 0.16])
            if not is_sent:
                is_sent = True
                await others.wait_for_subscribers()
                await others.publish(JointState(name=["shoulder"], position=[0.25]))

    run(body)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("rate", 0),
        ("rate", "fast"),
        ("zeros", {"elbow": "pi"}),
        ("dependent_joints", {"elbow": {}}),
        ("source_list", 1),
    ],
)
def test_wrong_parameters_are_one_line(arm: str, master: str, start: Start, name: str, value: object) -> None:
    set_param(master, f"/joint_state_publisher/{name}", value)
    process = start("joint_state_publisher", "joint_state_publisher")
    _, errors = process.communicate(timeout=SECONDS)
    assert process.returncode == 1
    assert name in errors
    assert "Traceback" not in errors


def test_publishers_end_quietly(arm: str, start: Start) -> None:
    processes = [start(name, name) for name in ("robot_state_publisher", "joint_state_publisher")]

    async def body(node: Node) -> None:
        async for _ in node.subscribe("/tf", TFMessage):
            break

    run(body)
    assert [end(process) for process in processes] == [("", ""), ("", "")]
    assert [process.returncode for process in processes] == [0, 0]
