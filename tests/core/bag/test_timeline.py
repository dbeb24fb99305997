"""The contents of bags by time: message counts, the message at a time, and the times around it."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

from minirospy.core.bag.timeline import Timeline
from minirospy.ros.rosbag.recording.sources import open_reader
from tests.web.dashboard.bags import SECOND, START, make_bag, make_bag_out_of_order, text_body


def test_messages_are_found_by_time(tmp_path: Path) -> None:
    with ExitStack() as opened:
        timeline = Timeline(open_reader(make_bag(tmp_path / "a.bag", 10), opened))
        assert timeline.span == (START, START + 99 * SECOND // 10)
        assert timeline.density("/chatter", START, START + 10 * SECOND - 1, 5) == [20] * 5
        assert timeline.density("/chatter", START + 1, START + 1, 1) == [0]
        for seconds, text in (
            (0.0, "message 0"),
            (0.05, "message 0"),
            (5.0, "message 50"),
            (99, "message 99"),
        ):
            message = timeline.message_at("/chatter", START + int(seconds * SECOND))
            assert message
            assert message.body == text_body(text)
        assert timeline.message_at("/chatter", START - 1) is None
        assert timeline.count_at(START) == 3
        assert timeline.time_after(START) == START + SECOND // 10
        assert timeline.time_before(START + SECOND // 10) == START
        assert timeline.time_before(START) is None
        assert timeline.time_after(START + 10 * SECOND) is None
        assert timeline.topics["/map"].is_latched


def test_chunks_may_be_stored_in_any_order(tmp_path: Path) -> None:
    path = make_bag_out_of_order(tmp_path / "a.bag")
    with ExitStack() as opened:
        timeline = Timeline(open_reader(path, opened))
        assert timeline.span == (START, START + 29 * SECOND)
        assert timeline.density("/chatter", START, START + 30 * SECOND - 1, 3) == [10, 10, 10]
        assert timeline.time_at("/chatter", START + 15 * SECOND) == START + 15 * SECOND
        assert timeline.time_after(START + 9 * SECOND) == START + 10 * SECOND
        assert timeline.time_before(START + 20 * SECOND) == START + 19 * SECOND
        message = timeline.message_at("/chatter", START + 12 * SECOND)
        assert message
        assert message.body == text_body("message 12")
