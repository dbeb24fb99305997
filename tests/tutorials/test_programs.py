"""Programs of rospy_tutorials and actionlib_tutorials, started as on the pages of the ROS wiki."""

from __future__ import annotations

import asyncio
import signal
import sys

import pytest
from actionlib_tutorials.msg import FibonacciAction, FibonacciGoal
from rospy_tutorials.srv import AddTwoInts
from std_msgs.msg import String

from minirospy import Node
from minirospy.ros.actionlib.actionlib.aio import ActionClient
from tests.ros.robot_state_publisher.conftest import SECONDS, Start


@pytest.mark.parametrize("name", ["talker", "talker.py"])
def test_talker_says_hello(start: Start, name: str) -> None:
    start("rospy_tutorials", name)

    async def body() -> None:
        async with Node("test", rosout=False) as node:
            async for message in node.subscribe("chatter", String):
                assert message.data.startswith("hello world 1")
                break

    asyncio.run(asyncio.wait_for(body(), SECONDS))


@pytest.mark.parametrize("name", ["listener", "listener.py"])
def test_listener_logs_received_messages(start: Start, name: str) -> None:
    process = start("rospy_tutorials", name)

    async def body() -> None:
        async with Node("test", rosout=False) as node:
            publisher = node.advertise("chatter", String)
            await publisher.wait_for_subscribers()
            await publisher.publish(String("a text"))
            assert process.stdout is not None
            line = await asyncio.to_thread(process.stdout.readline)
            assert line.rstrip().endswith("I heard a text")
            assert ": /listener_" in line

    asyncio.run(asyncio.wait_for(body(), SECONDS))


def test_integers_are_added(start: Start) -> None:
    start("rospy_tutorials", "add_two_ints_server.py")

    async def body() -> None:
        async with Node("test", rosout=False) as node:
            await node.wait_for_service("add_two_ints")
            assert (await node.call("add_two_ints", AddTwoInts, a=1, b=2)).sum == 3

    asyncio.run(asyncio.wait_for(body(), SECONDS))
    for words, status, printed in (
        (("4", "-5"), 0, "Requesting 4+-5\n4 + -5 = -1\n"),
        (("1", str(1 << 63)), 1, f"Requesting 1+{1 << 63}\nService call failed: field b exceeds"),
        (("x", "y"), 1, "add_two_ints_client.py [x y]: two integers"),
        (("1",), 1, "add_two_ints_client.py [x y]: two integers"),
    ):
        process = start("rospy_tutorials", "add_two_ints_client.py", *words)
        output, errors = process.communicate(timeout=SECONDS)
        assert (process.returncode, errors) == (status, "")
        assert output.startswith(printed)


@pytest.mark.skipif(sys.platform == "win32", reason="a console's Ctrl-C cannot be sent to one process")
def test_client_that_waits_ends_at_ctrl_c(start: Start) -> None:
    process = start("rospy_tutorials", "add_two_ints_client.py", "1", "2")
    assert process.stdout is not None
    line = process.stdout.readline()
    process.send_signal(signal.SIGINT)
    assert (line, *process.communicate(timeout=SECONDS)) == ("Requesting 1+2\n", "", "")
    assert process.returncode == 130


def test_fibonacci_numbers_are_computed_one_a_second(start: Start) -> None:
    start("actionlib_tutorials", "fibonacci_server.py")

    async def body() -> None:
        async with (
            Node("test", rosout=False) as node,
            ActionClient(node, "fibonacci", FibonacciAction) as client,
        ):
            await client.wait_for_server()
            result = await client.send(FibonacciGoal(order=3))
            assert list(result.sequence) == [0, 1, 1, 2]

    asyncio.run(asyncio.wait_for(body(), SECONDS))
