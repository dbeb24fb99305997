"""The limits at which a recording is split, and the names of its files."""

from __future__ import annotations

import time

from minirospy.ros.rosbag.recording.options import RecordOptions
from minirospy.ros.rosbag.recording.splits import Next, Splits, file_name

SECOND = 10**9


def test_size_splits_or_ends() -> None:
    splitting = Splits(RecordOptions(split=True, max_size=100), 0)
    ending = Splits(RecordOptions(max_size=100), 0)

    assert splitting.check(100, 0) is Next.CONTINUE
    assert splitting.check(101, 0) is Next.SPLIT
    assert ending.check(101, 0) is Next.END


def test_duration_counts_from_the_start_of_each_file() -> None:
    splits = Splits(RecordOptions(split=True, max_duration=10 * SECOND), 5 * SECOND)

    assert splits.check(0, 15 * SECOND) is Next.CONTINUE
    assert splits.check(0, 16 * SECOND) is Next.SPLIT
    assert splits.check(0, 25 * SECOND) is Next.CONTINUE
    assert splits.check(0, 26 * SECOND) is Next.SPLIT


def test_a_long_silence_ends_several_files() -> None:
    splits = Splits(RecordOptions(split=True, max_duration=SECOND), 0)

    answers = [splits.check(0, int(3.5 * SECOND)) for _ in range(4)]

    assert answers == [Next.SPLIT] * 3 + [Next.CONTINUE]


def test_a_jump_of_the_clock_makes_one_file() -> None:
    splits = Splits(RecordOptions(split=True, max_duration=SECOND), 0)

    assert splits.check(0, 10**9 * SECOND) is Next.SPLIT
    assert splits.check(0, 10**9 * SECOND) is Next.CONTINUE


def test_duration_ends_a_recording_that_is_not_split() -> None:
    assert Splits(RecordOptions(max_duration=SECOND), 0).check(0, 2 * SECOND) is Next.END


def test_max_splits_keeps_the_newest_files() -> None:
    splits = Splits(RecordOptions(split=True, max_splits=2), 0)

    removed = [splits.closed(f"{i}.bag") for i in range(4)]

    assert removed == [[], [], ["0.bag"], ["1.bag"]]
    assert splits.count == 4


def test_names() -> None:
    now = time.mktime((2026, 11, 22, 14, 3, 5, 0, 0, -1))

    assert file_name(RecordOptions(), 0, now) == "2026-11-22-14-03-05.bag"
    assert file_name(RecordOptions(prefix="run"), 0, now) == "run_2026-11-22-14-03-05.bag"
    assert file_name(RecordOptions(prefix="run.bag"), 0, now) == "run_2026-11-22-14-03-05.bag"
    assert file_name(RecordOptions(prefix="a.b.c", append_date=False), 0, now) == "a.b.c.bag"
    assert file_name(RecordOptions(prefix="x.bag", append_date=False, split=True), 7, now) == "x_7.bag"
    assert file_name(RecordOptions(prefix="x.mcap", append_date=False, mcap=True), 0, now) == "x.mcap"
