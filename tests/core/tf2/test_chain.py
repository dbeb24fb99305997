"""The frames between two others, for names that do not exist, compared with Debian's tf2_py. recorded.json has the rest."""

from __future__ import annotations

import pytest

from minirospy.base.errors import ConnectivityException, LookupException
from minirospy.core.tf2.buffer import TransformBuffer

SECOND = 1_000_000_000


@pytest.fixture
def buffer() -> TransformBuffer:
    buffer = TransformBuffer()
    buffer.insert("a", "b", SECOND, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    return buffer


@pytest.mark.parametrize("time", [0, SECOND])
def test_chain_of_names_that_do_not_exist_is_empty(buffer: TransformBuffer, time: int) -> None:
    assert buffer.chain("x", time, "y", time, "z") == []


def test_chain_stops_at_a_name_that_does_not_exist(buffer: TransformBuffer) -> None:
    with pytest.raises(ConnectivityException, match="between 'a' and 'NO_PARENT'"):
        buffer.chain("a", SECOND, "x", SECOND, "y")
    with pytest.raises(ConnectivityException, match="between 'NO_PARENT' and 'b'"):
        buffer.chain("a", SECOND, "b", SECOND, "x")


def test_chain_at_the_latest_time_needs_the_frames(buffer: TransformBuffer) -> None:
    with pytest.raises(LookupException, match=r"^$"):
        buffer.chain("a", 0, "b", 0, "x")
