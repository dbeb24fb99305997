"""The pure model of the board."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.board.model import (
    BUTTONS,
    PINS,
    BoardModel,
    Change,
    Force,
    Function,
    Operation,
    OperationError,
    Press,
    Pull,
    Release,
    Setup,
    Write,
)

pins = st.integers(-1, PINS)
levels = st.integers(-1, 2)
operations = st.one_of(
    st.builds(Setup, pins, st.integers(-1, 2), st.integers(19, 23), st.none() | levels),
    st.builds(Write, st.lists(st.tuples(pins, levels), max_size=4)),
    st.builds(Press, pins),
    st.builds(Release, pins),
    st.builds(Force, pins, levels),
)


def test_a_fresh_board_is_all_inputs_at_0() -> None:
    board = BoardModel()
    assert len(board.pins) == 54
    assert {pin.function for pin in board.pins} == {Function.IN}
    assert {pin.level for pin in board.pins} == {0}


def test_a_wired_button_reads_1_while_pressed_whatever_the_pull() -> None:
    board = BoardModel()
    for pull in Pull:
        board.apply(Setup(11, Function.IN, pull))
        assert board.pins[11].level == 0
        assert [(change.pin, change.edge) for change in board.apply(Press(11))] == [(11, True)]
        assert board.pins[11].level == 1
        board.apply(Release(11))


def test_a_button_on_a_pin_with_pull_up_connects_to_ground() -> None:
    board = BoardModel()
    board.apply(Setup(20, Function.IN, Pull.UP))
    assert board.pins[20].level == 1
    board.apply(Press(20))
    assert board.pins[20].level == 0
    board.apply(Release(20))
    assert board.pins[20].level == 1


def test_an_output_shows_its_latch_not_the_world() -> None:
    board = BoardModel()
    board.apply(Press(12))
    assert board.apply(Setup(12, Function.OUT))[0].edge
    assert board.pins[12].level == 0
    board.apply(Write([(12, 1)]))
    assert board.pins[12].level == 1


def test_the_latch_outlives_the_direction() -> None:
    board = BoardModel()
    board.apply(Setup(7, Function.OUT, Pull.OFF, 1))
    board.apply(Setup(7, Function.IN))
    assert board.pins[7].level == 0
    board.apply(Setup(7, Function.OUT))
    assert board.pins[7].level == 1


def test_several_pins_are_written_together() -> None:
    board = BoardModel()
    for pin in (2, 3):
        board.apply(Setup(pin, Function.OUT))
    changes = board.apply(Write([(2, 1), (3, 1)]))
    assert [change.pin for change in changes] == [2, 3]
    assert board.apply(Write([(2, 1), (3, 1)])) == []


def test_force_drives_an_input_and_sets_an_output() -> None:
    board = BoardModel()
    board.apply(Force(17, 1))
    assert (board.pins[17].level, board.pins[17].latch) == (1, 0)
    board.apply(Setup(18, Function.OUT))
    board.apply(Force(18, 1))
    assert (board.pins[18].level, board.pins[18].world) == (1, None)


def test_change_without_an_edge_is_reported_as_such() -> None:
    (change,) = BoardModel().apply(Setup(5, Function.OUT))
    assert isinstance(change, Change)
    assert not change.edge


@given(st.lists(operations, max_size=20))
def test_any_operation_is_carried_out_whole_or_refused(several: list[Operation]) -> None:
    board = BoardModel()
    for operation in several:
        before = list(board.pins)
        try:
            changes = board.apply(operation)
        except OperationError:
            assert board.pins == before
            continue
        differing = {pin for pin in range(PINS) if board.pins[pin] != before[pin]}
        assert {change.pin for change in changes} == differing
        for change in changes:
            assert change.state == board.pins[change.pin]
            assert change.edge == (change.state.level != before[change.pin].level)
            assert change.state.level in {0, 1}


def test_a_person_comes_walks_and_leaves() -> None:
    board = BoardModel()
    assert board.person is None
    assert [board.move_person(where) for where in ((0.5, 0.0), (0.5, 0.0), None)] == [True, False, True]
    with pytest.raises(OperationError, match="a position is two lengths in metres"):
        board.move_person((math.nan, 0.0))
    assert board.person is None


@pytest.mark.parametrize("pin", BUTTONS)
def test_forcing_a_button_ends_with_its_release(pin: int) -> None:
    board = BoardModel()
    board.apply(Force(pin, 1))
    board.apply(Release(pin))
    assert board.pins[pin].level == 0
