"""The limit on images that are processed at the same time, and the number of pixels in a message."""

from __future__ import annotations

import asyncio

import pytest
from sensor_msgs.msg import CompressedImage, Image

from minirospy.aio.handle import serialized
from minirospy.web.video.capacity import Capacity
from minirospy.web.video.pictures import COMPRESSED, IMAGE, MAX_PIXELS, work_of


def test_work_that_does_not_fit_waits_in_order() -> None:
    async def run() -> None:
        capacity, done = Capacity(10), []
        events = {name: asyncio.Event() for name in "abcd"}

        async def work(name: str, units: int) -> None:
            async with capacity.taken(units):
                done.append(name)
                await events[name].wait()

        tasks = [asyncio.ensure_future(work(*each)) for each in (("a", 6), ("b", 5), ("c", 1), ("d", 99))]
        await asyncio.sleep(0)
        # c would be within the limit, but comes after b.
        assert (done, capacity.taken_units) == (["a"], 6)
        events["a"].set()
        await tasks[0]
        await asyncio.sleep(0)
        assert (done, capacity.taken_units) == (["a", "b", "c"], 6)
        events["b"].set()
        await tasks[1]
        await asyncio.sleep(0)
        assert done == ["a", "b", "c"]
        events["c"].set()
        await tasks[2]
        await asyncio.sleep(0)
        # An item that is larger than the capacity runs alone.
        assert (done, capacity.taken_units) == (["a", "b", "c", "d"], 10)
        events["d"].set()
        await tasks[3]
        assert capacity.taken_units == 0

    asyncio.run(run())


@pytest.mark.parametrize("has_turn", [False, True])
def test_cancelled_work_gives_its_turn_back(has_turn: bool) -> None:
    async def run() -> None:
        capacity, started = Capacity(10), []

        async def work(name: str) -> None:
            async with capacity.taken(7):
                started.append(name)

        async with capacity.taken(7):
            first, second = (asyncio.ensure_future(work(name)) for name in "ab")
            await asyncio.sleep(0)
            if not has_turn:
                first.cancel()
        # The block has ended, so the first task is next in the queue, but it has not run yet.
        first.cancel()
        await asyncio.wait([first, second])
        assert first.cancelled()
        assert (started, capacity.taken_units) == (["b"], 0)

    asyncio.run(run())


def test_error_gives_the_turn_back() -> None:
    async def run() -> None:
        capacity = Capacity(10)
        with pytest.raises(ZeroDivisionError):
            async with capacity.taken(7):
                raise ZeroDivisionError
        assert capacity.taken_units == 0

    asyncio.run(run())


def test_pixels_of_a_message_are_known_before_it_is_decoded() -> None:
    gif = b"GIF89a" + (300).to_bytes(2, "little") + (20).to_bytes(2, "little")
    message = CompressedImage(format="gif", data=gif)
    message.header.frame_id = "camera"
    assert work_of(COMPRESSED, serialized(message)) == 6000
    large = CompressedImage(format="gif", data=b"GIF89a" + b"\xff" * 4)
    assert work_of(COMPRESSED, serialized(large)) == MAX_PIXELS
    assert work_of(COMPRESSED, serialized(CompressedImage(data=b"unknown"))) == MAX_PIXELS
    assert work_of(COMPRESSED, serialized(message)[:20]) == 0
    assert work_of(COMPRESSED, b"") == 0
    raw = serialized(Image(data=bytes(30_000)))
    assert work_of(IMAGE, raw) == len(raw) // 3
