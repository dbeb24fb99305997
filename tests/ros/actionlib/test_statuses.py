"""StatusList compared with the generated class: bytes and statuses are equal."""

from __future__ import annotations

from io import BytesIO

import pytest
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.errors import MessageException
from minirospy.ros.actionlib.actionlib.statuses import StatusList, find_status, status_bytes

texts = st.text(st.characters(exclude_categories=("Cs",)), max_size=20)
statuses = st.builds(
    lambda id, status, text, secs: GoalStatus(GoalID(id=id, stamp=_time(secs)), status, text),
    texts,
    st.integers(0, 255),
    texts,
    st.integers(0, 2**32 - 1),
)


def _time(secs: int) -> object:
    import genpy

    return genpy.Time(secs, 5)


def to_bytes(message: GoalStatusArray) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


@given(st.lists(statuses, max_size=6))
def test_the_same_bytes_and_the_same_statuses(wanted: list[GoalStatus]) -> None:
    plain = GoalStatusArray(status_list=wanted)
    plain.header.seq, plain.header.frame_id = 7, "frame"
    made = StatusList([status_bytes(status) for status in wanted])
    made.header.seq, made.header.frame_id = 7, "frame"
    assert to_bytes(made) == to_bytes(plain)
    read = StatusList().deserialize(to_bytes(plain))
    assert read.status_list == wanted
    assert (read.header.seq, read.header.frame_id) == (7, "frame")
    for id in {status.goal_id.id for status in wanted} | {"none", ""}:
        first = next((status for status in wanted if status.goal_id.id == id), None)
        assert read.find(id) == first == find_status(plain, id) == find_status(read, id)


def test_id_in_a_text_is_not_a_goal() -> None:
    plain = GoalStatusArray(
        status_list=[GoalStatus(GoalID(id="a"), 1, "the goal"), GoalStatus(GoalID(id="b"), 1, "")]
    )
    assert StatusList().deserialize(to_bytes(plain)).find("the goal") is None


@pytest.mark.parametrize("size", [0, 3, 15, 19, 25, 40])
def test_bytes_that_end_too_soon_are_refused(size: int) -> None:
    data = to_bytes(GoalStatusArray(status_list=[GoalStatus(GoalID(id="goal"), 1, "text")]))
    with pytest.raises(MessageException):
        StatusList().deserialize(data[:size]).status_list  # noqa: B018


def test_statuses_that_are_set_are_sent() -> None:
    message = StatusList()
    message.status_list = [GoalStatus(GoalID(id="goal"), 1, "text")]
    assert to_bytes(message) == to_bytes(GoalStatusArray(status_list=message.status_list))
