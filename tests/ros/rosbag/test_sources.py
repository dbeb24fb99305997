"""ros/rosbag/recording/sources: merging the messages of several bags."""

from __future__ import annotations

import itertools
import random
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from minirospy.base.errors import BagFormatError
from minirospy.core.bag.base import StoredMessage
from minirospy.core.bag.records import Connection
from minirospy.introspect.bag_convert import convert
from minirospy.ros.rosbag.recording.sources import Bags, ReadAhead, Selection
from tests.core.bag.bags import Given, make_bag
from tests.interruption import ends_elsewhere, interrupt_in_lock


@pytest.mark.parametrize("suffix", [".bag", ".mcap"])
def test_last_time_is_that_of_the_last_message(tmp_path: Path, suffix: str) -> None:
    source = random.Random(5)
    paths = []
    for name in ("one", "two"):
        chunks = [
            [
                Given(source.choice((0, 0, 0, 1, 2)), chunk * 5 + source.randrange(20), bytes(200))
                for _ in range(3)
            ]
            for chunk in range(20)
        ]
        path = tmp_path / f"{name}.bag"
        path.write_bytes(make_bag(chunks))
        paths.append(str(path.with_suffix(suffix)))
        if suffix == ".mcap":
            convert(str(path), paths[-1], compression="none", force=False, step=lambda _: None)

    with Bags(paths) as bags:
        for topics in ((), ("/topic0",), ("/topic1",), ("/topic1", "/topic2")):
            for end in (None, *range(5, 130, 4)):
                selection = Selection(topics, None, end)
                times = [message.time for _, message in bags.messages(selection)]
                if times:
                    assert bags.last_time(selection) == max(times)


def test_reading_ahead_starts_before_the_first_message_is_wanted() -> None:
    connection = Connection(0, "/a", {})
    read: list[int] = []

    def messages() -> Iterator[tuple[int, StoredMessage]]:
        for number in range(3):
            read.append(number)
            yield 0, StoredMessage(connection, number, b"", 0)
        raise BagFormatError("the end is damaged")

    ahead = ReadAhead(messages())
    ahead.wait()
    assert read == [0, 1, 2]

    found = []
    with pytest.raises(BagFormatError):
        found.extend(message.time for _, message in ahead)
    ahead.close()


def test_reading_ahead_ends_when_it_is_closed() -> None:
    connection = Connection(0, "/a", {})
    is_closed = threading.Event()

    def messages() -> Iterator[tuple[int, StoredMessage]]:
        try:
            while True:
                yield 0, StoredMessage(connection, 0, b"", 0)
        finally:
            is_closed.set()

    ahead = ReadAhead(messages())
    ahead.wait()
    ahead.close()
    assert is_closed.wait(45)


def test_ctrl_c_at_any_point_of_playing_does_not_hang_the_reading_thread() -> None:
    connection = Connection(0, "/a", {})
    ahead = ReadAhead((0, StoredMessage(connection, number, b"", 0)) for number in itertools.count())
    interrupt_in_lock(lambda: next(iter(ahead)))
    ahead.close()
    assert ends_elsewhere(ahead.join)
