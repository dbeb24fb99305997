"""client/statistics: the counts in a window, and how the window adapts. Times are passed as arguments."""

from __future__ import annotations

from std_msgs.msg import Header, String

from minirospy.base.times import Time
from minirospy.client.statistics import Report, Spread, TopicStatisticsCounter, WindowLimits

TALKER = {"callerid": "/talker"}
SECOND = 10**9


class Stamped:
    """The parts of a message that the counter reads."""

    _has_header = True

    def __init__(self, sequence: int, stamp: int) -> None:
        self.header = Header(seq=sequence, stamp=Time(nsecs=stamp))


def reports(counter: TopicStatisticsCounter, hertz: float, seconds: float) -> list[Report]:
    """Return the reports about a publisher of ``hertz`` messages per second."""
    times = [int(number / hertz * SECOND) + SECOND for number in range(int(hertz * seconds) + 1)]
    return [report for now in times if (report := counter.count(String(), TALKER, 7, now))]


def test_a_window_counts() -> None:
    first, second = reports(TopicStatisticsCounter(WindowLimits()), 20, 4)
    assert (first.publisher, first.start, first.stop) == ("/talker", SECOND, 3 * SECOND)
    assert (first.delivered, first.dropped, first.traffic) == (41, 0, 41 * 11)
    assert (second.start, second.stop, second.delivered) == (3 * SECOND, 5 * SECOND, 40)
    assert [round(value, 6) for value in second.period] == [0.05, 0, 0.05]
    assert second.stamp_age == Spread()


def test_a_window_grows_for_a_slow_publisher_and_shrinks_for_a_fast_one() -> None:
    limits = WindowLimits(min_elements=10, max_elements=20, min_size=0.5, max_size=9)
    slow = reports(TopicStatisticsCounter(limits), 1, 40)
    assert [(r.stop - r.start) // SECOND for r in slow] == [2, 4, 8, 8, 8, 8]
    fast = reports(TopicStatisticsCounter(limits), 100, 5)
    assert [round((r.stop - r.start) / SECOND, 2) for r in fast] == [2, 1, 0.5, 0.5, 0.5, 0.5]


def test_gaps_and_ages() -> None:
    counter = TopicStatisticsCounter(WindowLimits())
    report = None
    for sequence, seconds, age in ((5, 1.0, 0.1), (6, 1.5, 0.3), (9, 2.0, 0.1), (10, 3.0, 0.3)):
        now = int(seconds * SECOND)
        report = counter.count(Stamped(sequence, now - int(age * SECOND)), TALKER, 40, now)
    assert report
    assert report.dropped == 2
    assert [round(value, 6) for value in report.stamp_age] == [0.2, 0.1, 0.3]
    assert [round(value, 3) for value in report.period] == [0.667, 0.236, 1.0]


def test_unset_stamp_gives_no_age() -> None:
    counter = TopicStatisticsCounter(WindowLimits())
    counter.count(Stamped(1, 0), TALKER, 40, SECOND)
    report = counter.count(Stamped(2, 0), TALKER, 40, 3 * SECOND)
    assert report
    assert report.stamp_age == Spread()


def test_publishers_are_counted_apart_and_time_may_jump_back() -> None:
    counter = TopicStatisticsCounter(WindowLimits())
    counter.count(String(), TALKER, 7, 10 * SECOND)
    counter.count(String(), {"callerid": "/other"}, 7, 10 * SECOND)
    assert counter.count(String(), TALKER, 7, SECOND) is None
    report = counter.count(String(), TALKER, 7, 3 * SECOND)
    assert report
    assert (report.start, report.delivered) == (SECOND, 2)


def test_the_limits_are_read_from_parameters() -> None:
    values = {"/statistics_window_max_elements": 7, "/statistics_window_min_size": 0.5}
    assert WindowLimits.read(values.get) == WindowLimits(max_elements=7, min_size=0.5)
