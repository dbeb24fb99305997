"""Frames in asyncio programs: buffers, changes and broadcasters of nodes on one loop."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

import pytest
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from minirospy import Node
from minirospy.base.errors import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    ROSInterruptException,
)
from minirospy.base.times import Time
from minirospy.ros.tf2_ros.tf2_ros.aio import Broadcaster, Buffer
from tests.waiting import until

LONG = 40.0


def run(main: Callable[[Node, Buffer], Coroutine[Any, Any, None]]) -> None:
    """Run a test's coroutine with a node and its buffer; assert that no task remains in the loop."""

    async def bounded() -> None:
        async with Node("frames") as node, Buffer(node) as buffer:
            await asyncio.wait_for(main(node, buffer), LONG)
        left = asyncio.all_tasks() - {asyncio.current_task()}
        assert not left

    asyncio.run(bounded(), debug=True)


def stamped(parent: str, child: str, seconds: int, x: float = 0.0) -> TransformStamped:
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = parent
    message.header.stamp = Time(seconds)
    message.transform.translation.x = x
    message.transform.rotation.w = 1.0
    return message


@pytest.mark.usefixtures("master")
class TestBuffer:
    def test_a_lookup_waits_for_what_is_broadcast(self) -> None:
        async def main(node: Node, buffer: Buffer) -> None:
            broadcaster = Broadcaster(node)
            waiting = asyncio.create_task(buffer.lookup("map", "laser", Time(2), timeout=None))
            await broadcaster.send_static(stamped("map", "odom", 0, 1.0))
            await broadcaster.send_static(stamped("base", "laser", 0, 0.5))
            await broadcaster.send()
            assert broadcaster.moving is not None
            await broadcaster.moving.wait_for_subscribers()
            await broadcaster.send(stamped("odom", "base", 1, 1.0))
            await broadcaster.send(stamped("odom", "base", 3, 3.0), stamped("base", "wheel", 3))
            found = await waiting
            assert found.transform.translation.x == pytest.approx(3.5)
            assert (found.header.frame_id, found.child_frame_id) == ("map", "laser")

            assert (await buffer.lookup("odom", "base")).header.stamp == Time(3)
            full = await buffer.lookup_full("base", Time(3), "base", Time(1), "odom", timeout=1.0)
            assert full.transform.translation.x == pytest.approx(-2.0)
            assert buffer.why_not("map", "wheel") is None
            assert "broadcaster: '/frames'" in buffer.frames_as_yaml()
            await broadcaster.close()

        run(main)

    def test_what_is_missing_is_named(self) -> None:
        async def main(node: Node, buffer: Buffer) -> None:
            with pytest.raises(
                LookupException, match='"map" passed to lookupTransform argument target_frame'
            ):
                await buffer.lookup("map", "base", timeout=0.01)
            with pytest.raises(InvalidArgumentException, match="cannot start with a '/'"):
                await buffer.lookup("/map", "base", timeout=None)
            with pytest.raises(InvalidArgumentException):
                await anext(buffer.changes("map", ""))
            assert "cannot be empty" in (buffer.why_not("map", "") or "")
            buffer.tree.insert("map", "base", 5, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
            buffer.tree.insert("other", "tree", 5, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
            with pytest.raises(ExtrapolationException):
                await buffer.lookup("map", "base", Time(9))
            with pytest.raises(ConnectivityException):
                await buffer.lookup("map", "tree")

        run(main)

    def test_changes_of_a_pose_come_as_they_are_published(self) -> None:
        async def main(node: Node, buffer: Buffer) -> None:
            broadcaster = Broadcaster(node)
            await broadcaster.send_static(stamped("base", "laser", 0, 0.5))
            places = []

            async def follow() -> None:
                async for pose in buffer.changes("map", "laser"):
                    places.append(pose.transform.translation.x)
                    if len(places) == 3:
                        return
                    await broadcaster.send(stamped("map", "other", 1))
                    await broadcaster.send(stamped("map", "base", len(places) + 1, float(len(places))))

            following = asyncio.create_task(follow())
            await broadcaster.send()
            assert broadcaster.moving is not None
            await broadcaster.moving.wait_for_subscribers()
            await broadcaster.send(stamped("map", "base", 1, 0.0))
            await following
            assert places == [0.5, 1.5, 2.5]

        run(main)

    def test_the_end_of_the_node_ends_waits_and_loops(self) -> None:
        async def main(node: Node, buffer: Buffer) -> None:
            async def follow() -> str:
                async for _ in buffer.changes("map", "base"):
                    return "never"
                return "over"

            following = asyncio.create_task(follow())
            waits = [asyncio.create_task(buffer.lookup("map", "base", timeout=each)) for each in (None, LONG)]
            await asyncio.sleep(0)
            node.shutdown("enough")
            assert await following == "over"
            for wait in waits:
                with pytest.raises(ROSInterruptException):
                    await wait

        run(main)

    def test_time_that_jumps_back_clears_moving_frames(self, caplog: pytest.LogCaptureFixture) -> None:
        async def main(node: Node, buffer: Buffer) -> None:
            times = [Time(10)]
            node.now = lambda: times[-1]  # type: ignore[method-assign]
            buffer.tree.insert("map", "base", 5, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
            for later in (Time(10), Time(11)):
                times.append(later)
                buffer.check_for_jump()
                assert buffer.why_not("map", "base") is None
            times.append(Time(5))
            buffer.check_for_jump()
            assert buffer.why_not("map", "base")

        run(main)
        assert "Detected jump back in time of 6.000000s. Clearing TF buffer." in caplog.text

    def test_bytes_that_are_not_transforms_are_one_line(self, caplog: pytest.LogCaptureFixture) -> None:
        async def main(node: Node, buffer: Buffer) -> None:
            class Wrong(TFMessage):
                def serialize(self, buff: Any) -> None:
                    buff.write(b"\1\0\0\0abc")

            publisher = node.advertise("/tf", Wrong, latch=True)
            await publisher.publish(Wrong())
            await buffer.lookup("map", "base", timeout=None)

        async def bounded(node: Node, buffer: Buffer) -> None:
            task = asyncio.create_task(main(node, buffer))
            await until(lambda: "is not a tf2_msgs/TFMessage" in caplog.text)
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)

        run(bounded)
        assert "a message of /frames is not a tf2_msgs/TFMessage" in caplog.text
