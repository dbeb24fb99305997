"""message_filters: the search compared with ROS's loops, and the synchronizers in cases in which ROS's would hang."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st
from message_filters import ApproximateTimeSynchronizer, SimpleFilter, Subscriber, TimeSynchronizer
from rospy import Time, rostime
from std_msgs.msg import Header, String

from minirospy.ros.message_filters.message_filters.stamps import StampQueue, closest_stamps

STAMPS = st.lists(st.integers(0, 40), max_size=6, unique=True)


class Stamped:
    def __init__(self, nanoseconds: int) -> None:
        self.header = Header(stamp=Time(0, nanoseconds))


@pytest.fixture(autouse=True)
def _clock() -> Iterator[None]:
    rostime.set_rostime_initialized(True)
    yield
    rostime.set_rostime_initialized(False)


def queue_of(stamps: list[int]) -> StampQueue:
    return StampQueue({Time(0, stamp): stamp for stamp in stamps})


def found_by_loops(queues: list[list[int]], stamp: int, slop: int, index: int | None) -> list[int] | None:
    """Return the result of ROS's algorithm, which tries every combination, with each queue's stamps ordered by distance."""
    near = [
        [stamp]
        if at == index
        else sorted((s for s in queue if abs(s - stamp) <= slop), key=lambda s: abs(s - stamp))
        for at, queue in enumerate(queues)
    ]
    return next((list(each) for each in itertools.product(*near) if max(each) - min(each) < slop), None)


@given(st.lists(STAMPS, min_size=1, max_size=5), st.integers(0, 40), st.integers(0, 15), st.data())
def test_search_finds_the_same_as_loops(
    queues: list[list[int]], stamp: int, slop: int, data: st.DataObject
) -> None:
    index = data.draw(st.sampled_from([None, *range(len(queues))]))
    if index is not None and stamp not in queues[index]:
        queues[index].append(stamp)
    found = closest_stamps([queue_of(each) for each in queues], stamp, slop, index)
    assert found == found_by_loops(queues, stamp, slop, index)


def test_search_of_many_topics_without_a_match_ends() -> None:
    # There are 50 stamps on either side, and none fits any on the other side: 100 ** 12 combinations.
    sides = [queue_of([*range(50), *range(151, 201)]) for _ in range(12)]
    sides.append(queue_of([*range(50)]))
    sides.append(queue_of([*range(151, 201)]))
    assert closest_stamps(sides, 100, 101) is None


@given(st.lists(st.tuples(st.integers(0, 9), st.booleans())))
def test_a_stamp_queue_is_a_dict(steps: list[tuple[int, bool]]) -> None:
    queue, model = StampQueue(), dict[Time, object]()
    for number, (stamp, is_added) in enumerate(steps):
        if is_added:
            queue[Time(0, stamp)] = model[Time(0, stamp)] = number
        else:
            assert queue.pop(Time(0, stamp), None) == model.pop(Time(0, stamp), None)
        assert list(queue.items()) == list(model.items())
        assert queue.order == sorted(each.to_nsec() for each in model)
        assert repr(queue) == repr(model)
    assert Time(0, 20) not in queue
    assert 5 not in queue
    with pytest.raises(KeyError):
        queue[Time(0, 20)]


@pytest.mark.parametrize("is_approximate", [False, True])
def test_callback_that_raises_does_not_block_the_next_set(is_approximate: bool) -> None:
    inputs = [SimpleFilter(), SimpleFilter()]
    both = ApproximateTimeSynchronizer(inputs, 5, 1.0) if is_approximate else TimeSynchronizer(inputs, 5)
    seen = []

    def callback(left: Stamped, right: Stamped) -> None:
        seen.append(left.header.stamp.nsecs)
        if len(seen) == 1:
            raise ValueError("a fault of the program")

    both.registerCallback(callback)
    inputs[0].signalMessage(Stamped(1))
    with pytest.raises(ValueError, match="a fault of the program"):
        inputs[1].signalMessage(Stamped(1))
    for each in inputs:
        each.signalMessage(Stamped(2))
    assert seen == [1, 2]


@pytest.mark.parametrize("is_approximate", [False, True])
def test_callback_may_feed_its_own_synchronizer(is_approximate: bool) -> None:
    inputs = [SimpleFilter(), SimpleFilter()]
    both = ApproximateTimeSynchronizer(inputs, 5, 1e-9) if is_approximate else TimeSynchronizer(inputs, 5)
    seen = []

    def callback(left: Stamped, right: Stamped) -> None:
        seen.append(left.header.stamp.nsecs)
        if left.header.stamp.nsecs < 3:
            for each in inputs:
                each.signalMessage(Stamped(left.header.stamp.nsecs + 1))

    both.registerCallback(callback)
    for each in inputs:
        each.signalMessage(Stamped(1))
    assert seen == [1, 2, 3]


def test_stamp_older_than_a_full_queue_completes_no_set() -> None:
    inputs = [SimpleFilter(), SimpleFilter()]
    seen: list[object] = []
    ApproximateTimeSynchronizer(inputs, 1, 1.0).registerCallback(lambda *messages: seen.append(messages))
    newest, older, other = Stamped(900), Stamped(5), Stamped(7)
    for source, message in ((0, newest), (0, older), (1, other)):
        inputs[source].signalMessage(message)
    assert seen == [(newest, other)]


def test_message_without_a_header_leaves_the_synchronizer_usable() -> None:
    inputs = [SimpleFilter()]
    seen: list[object] = []
    TimeSynchronizer(inputs, 5).registerCallback(seen.append)
    with pytest.raises(AttributeError, match="header"):
        inputs[0].signalMessage(String("x"))
    inputs[0].signalMessage(message := Stamped(1))
    assert seen == [message]


def test_callback_that_registers_another_one() -> None:
    source, seen = SimpleFilter(), list[object]()
    source.registerCallback(lambda message: source.registerCallback(seen.append))
    source.signalMessage(1)
    source.signalMessage(2)
    assert seen == [2]


def test_copy_of_a_subscriber_without_attributes_raises() -> None:
    empty = copy.copy(Subscriber.__new__(Subscriber))
    with pytest.raises(AttributeError, match="sub"):
        _ = empty.name
