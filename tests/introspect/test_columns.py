"""introspect/columns: the fields of messages as columns."""

from __future__ import annotations

from genpy import Message
from geometry_msgs.msg import PoseStamped
from rosgraph_msgs.msg import TopicStatistics
from sensor_msgs.msg import Image, JointState, LaserScan
from std_msgs.msg import Empty, String

from minirospy.introspect.columns import Column, Kind, columns


def named(messages: list[object]) -> dict[str, Column]:
    return {column.name: column for column in columns(messages)}


def test_nested_fields_are_paths() -> None:
    first, second = PoseStamped(), PoseStamped()
    second.header.frame_id, second.pose.position.x = "map", 2.5
    found = named([first, second])
    assert list(found) == [
        "header.seq", "header.stamp", "header.frame_id", "pose.position.x", "pose.position.y", "pose.position.z",
        "pose.orientation.x", "pose.orientation.y", "pose.orientation.z", "pose.orientation.w",
    ]  # fmt: skip
    assert found["header.frame_id"].values == ["", "map"]
    assert found["pose.position.x"].values == [0.0, 2.5]


def test_times_and_durations_are_nanoseconds() -> None:
    message = TopicStatistics()
    message.window_stop.secs, message.window_stop.nsecs = 1_700_000_000, 5
    message.period_mean.secs, message.period_mean.nsecs = -1, 500_000_000
    found = named([message])
    assert found["window_stop"] == Column("window_stop", Kind.TIME, [1_700_000_000_000_000_005])
    assert found["period_mean"] == Column("period_mean", Kind.DURATION, [-500_000_000])


def test_arrays_of_named_values_have_one_column_for_each_name() -> None:
    messages = [
        JointState(name=["elbow", "wrist"], position=[1.0, 2.0], velocity=[0.1, 0.2]),
        JointState(name=["wrist", "finger"], position=[3.0, 4.0]),
    ]
    found = named(messages)
    assert found["position[elbow]"].values == [1.0, None]
    assert found["position[wrist]"].values == [2.0, 3.0]
    assert found["position[finger]"].values == [None, 4.0]
    assert found["velocity[elbow]"].values == [0.1, None]
    # No message has efforts: the column remains, with empty arrays.
    assert [len(each) for each in found["effort"].values] == [0, 0]


def test_arrays_that_do_not_belong_to_the_names_stay_whole() -> None:
    found = named([JointState(name=["elbow"], position=[1.0, 2.0])])
    assert [list(each) for each in found["position"].values] == [[1.0, 2.0]]


def test_one_array_of_another_length_changes_no_column_of_the_others() -> None:
    right = JointState(name=["elbow", "wrist"], position=[1.0, 2.0])
    found = named(
        [right, JointState(name=["elbow", "wrist"], position=[7.0]), JointState(name=["elbow"]), right]
    )
    assert found["position[elbow]"].values == [1.0, None, None, 1.0]
    assert [each and list(each) for each in found["position"].values] == [None, [7.0], None, None]


def test_a_name_that_is_no_list_of_names_belongs_to_no_array() -> None:
    class Counted(Message):
        __slots__ = ["name", "values"]
        _slot_types = ["uint32", "float64[]"]

    found = named([Counted(3, [1.0, 2.0])])
    assert found["values"].values == [[1.0, 2.0]]


def test_other_arrays_and_bytes_stay_as_they_are() -> None:
    scan = LaserScan(ranges=[1.0, 2.0])
    assert [list(each) for each in named([scan])["ranges"].values] == [[1.0, 2.0]]
    assert named([Image(data=b"\x01\x02")])["data"].values == [b"\x01\x02"]


def test_a_message_with_one_field_and_one_without() -> None:
    assert columns([String("a"), String("b")]) == [Column("data", Kind.PLAIN, ["a", "b"])]
    assert columns([Empty()]) == []
    assert columns([]) == []
