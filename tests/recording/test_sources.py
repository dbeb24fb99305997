"""recording/sources: the messages of several bags."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from minirospy.introspect.bag_convert import convert
from minirospy.recording.sources import Bags, Selection
from tests.bag.bags import Given, make_bag


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
