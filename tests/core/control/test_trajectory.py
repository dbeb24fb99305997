"""Segments against polynomials that numpy solves, paths of segments, and the checks of received points."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.core.control.trajectory import (
    NEVER,
    JointPath,
    JointTolerances,
    PastTrajectoryError,
    Point,
    Segment,
    State,
    Tail,
    TrajectoryError,
    parse_points,
    wraparound_offset,
)

SECOND = 1_000_000_000
VALUES = st.floats(-10, 10)
DURATIONS = st.integers(SECOND // 100, 20 * SECOND)


def reference(first: State, last: State, duration: float) -> np.polynomial.Polynomial:
    """Return the polynomial that meets all conditions that both ends have, from a linear system."""
    both = [(a, b) for a, b in zip(first, last, strict=True) if a is not None and b is not None]
    degree = 2 * len(both) - 1
    rows, values = [], []
    for order, conditions in enumerate(both):
        for x, value in zip((0.0, duration), conditions, strict=True):
            rows.append(
                [
                    math.perm(power, order) * x ** (power - order) if power >= order else 0.0
                    for power in range(degree + 1)
                ]
            )
            values.append(value)
    return np.polynomial.Polynomial(np.linalg.solve(np.array(rows), np.array(values)))


@given(
    st.tuples(VALUES, VALUES, VALUES),
    st.tuples(VALUES, VALUES, VALUES),
    DURATIONS,
    st.sampled_from([1, 2, 3]),
)
def test_segments_are_the_polynomials_of_numpy(
    first: tuple[float, ...], last: tuple[float, ...], duration: int, conditions: int
) -> None:
    start = State(*first[:conditions], *[None] * (3 - conditions))
    end = State(*last[:conditions], *[None] * (3 - conditions))
    segment = Segment(5 * SECOND, start, 5 * SECOND + duration, end)
    seconds = duration / SECOND
    polynomial = reference(start, end, seconds)
    scale = sum(abs(c) * seconds**power for power, c in enumerate(polynomial.coef)) + 1.0

    for fraction in (0.0, 0.1, 0.5, 0.77, 1.0):
        elapsed = int(duration * fraction)
        x = elapsed / SECOND
        expected = [polynomial(x), polynomial.deriv(1)(x), polynomial.deriv(2)(x)]
        found = segment.sample(5 * SECOND + elapsed)
        for order, (value, right) in enumerate(zip(found, expected, strict=True)):
            assert value == pytest.approx(right, abs=1e-9 * scale / min(seconds, 1.0) ** order)


@given(
    st.lists(st.tuples(VALUES, VALUES, VALUES), min_size=3, max_size=6),
    st.lists(DURATIONS, min_size=5, max_size=5),
    st.sampled_from([1, 2, 3]),
)
def test_neighbouring_segments_are_continuous(
    states: list[tuple[float, ...]], durations: list[int], conditions: int
) -> None:
    """Position, velocity and acceleration are equal at both sides of a point, as far as the points specify them."""
    knots = [State(*state[:conditions], *[None] * (3 - conditions)) for state in states]
    start = 0
    segments = []
    for first, last, duration in zip(knots, knots[1:], durations, strict=False):
        segments.append(Segment(start, first, start + duration, last))
        start += duration
    for before, after in pairwise(segments):
        knot = after.start
        for found, right in zip(
            before.sample(knot)[:conditions], after.sample(knot)[:conditions], strict=True
        ):
            assert found == pytest.approx(right, abs=1e-6)


@pytest.mark.parametrize(
    ("first", "last", "kind"),
    [
        (State(0.0, 1.0, 1.0), State(1.0, None, None), "line"),
        (State(0.0, None, None), State(1.0, 1.0, 1.0), "line"),
        (State(0.0, None, 1.0), State(1.0, 1.0, 1.0), "line"),
        (State(0.0, 1.0, None), State(1.0, 1.0, 1.0), "cubic"),
        (State(0.0, 1.0, 1.0), State(1.0, 1.0, 1.0), "quintic"),
    ],
)
def test_a_segment_uses_what_both_ends_have(first: State, last: State, kind: str) -> None:
    coefficients = Segment(0, first, 2 * SECOND, last).coefficients[:6]
    degree = max(power for power, value in enumerate(coefficients) if value)
    assert degree == {"line": 1, "cubic": 3, "quintic": 5}[kind]


def test_a_segment_holds_its_ends_outside() -> None:
    segment = Segment(SECOND, State(1.0, 2.0, 3.0), 3 * SECOND, State(4.0, 5.0, 6.0))
    assert segment.sample(SECOND - 1) == (1.0, 0.0, 0.0)
    assert segment.sample(SECOND) == (1.0, 2.0, 3.0)
    assert segment.sample(3 * SECOND) == pytest.approx((4.0, 5.0, 6.0))
    assert segment.sample(3 * SECOND + 1) == (4.0, 0.0, 0.0)


def test_a_segment_without_duration_holds_its_start() -> None:
    """So in ROS a goal with one point at time 0 of a stamp in the future does not move."""
    segment = Segment(SECOND, State(1.0), SECOND, State(2.0))
    assert segment.sample(SECOND) == (1.0, 0.0, 0.0)
    assert segment.sample(SECOND + 1) == (1.0, 0.0, 0.0)


def test_a_segment_that_ends_before_it_starts_is_refused() -> None:
    with pytest.raises(TrajectoryError, match="end_time < start_time"):
        Segment(2, State(0.0), 1, State(0.0))


@given(VALUES, VALUES, DURATIONS, st.floats(0.0, 1.0))
def test_a_line_stays_between_its_ends(first: float, last: float, duration: int, fraction: float) -> None:
    """Cubic and quintic segments may overshoot, as in ROS, because they meet the velocities; lines do not."""
    segment = Segment(0, State(first, None, None), duration, State(last, None, None))
    position = segment.sample(int(duration * fraction))[0]
    assert min(first, last) - 1e-12 <= position <= max(first, last) + 1e-12


@given(VALUES, VALUES, DURATIONS, st.floats(0.0, 1.0), st.booleans())
def test_a_spline_between_two_stops_stays_between_them(
    first: float, last: float, duration: int, fraction: float, is_cubic: bool
) -> None:
    acceleration = None if is_cubic else 0.0
    segment = Segment(0, State(first, 0.0, acceleration), duration, State(last, 0.0, acceleration))
    position = segment.sample(int(duration * fraction))[0]
    assert min(first, last) - 1e-12 <= position <= max(first, last) + 1e-12


def path_of(times: list[int], start: int = 0, offset: float = 0.0) -> JointPath:
    """Return the path that holds 0 until ``start``, then reaches position k + 1 at each of the times after it."""
    points = [Point(time, [float(index + 1)]) for index, time in enumerate(times)]
    parsed = parse_points(["j"], points, 0, 0)
    hold = Segment(0, State(0.0), 0, State(0.0))
    bridge = Segment(start, State(0.0), start + times[0], State(1.0 + offset, None, None))
    return JointPath([hold, bridge], Tail(parsed, 0, 0, start, offset, JointTolerances()))


def test_a_path_walks_through_its_segments() -> None:
    path = path_of([10, 20, 30], start=5, offset=100.0)
    seen = []
    for time in (0, 4, 5, 14, 15, 20, 25, 34, 35, 1000):
        if time >= path.next_start:
            path.advance(time)
        seen.append((path.current.start, round(path.current.sample(time)[0] * 10) / 10, path.next_start))
    assert seen == [
        (0, 0.0, 5),
        (0, 0.0, 5),
        (5, 0.0, 15),
        (5, 90.9, 15),
        (15, 101.0, 25),
        (15, 101.5, 25),
        (25, 102.0, NEVER),
        (25, 102.9, NEVER),
        (25, 103.0, NEVER),
        (25, 103.0, NEVER),
    ]


def test_a_path_is_sampled_at_any_time() -> None:
    path = path_of([10, 20, 30], start=5)
    path.advance(27)
    assert path.sample(-1) is None
    assert [path.sample(time) for time in (0, 10, 20, 31, 99)] == [
        (0.0, 0.0, 0.0),
        (0.5, pytest.approx(1e8), 0.0),
        (1.5, pytest.approx(1e8), 0.0),
        (pytest.approx(2.6), pytest.approx(1e8), 0.0),
        (3.0, 0.0, 0.0),
    ]
    assert [segment.start for segment in path_of([10, 20, 30], start=5).until(15)] == [0, 5, 15]


def test_a_path_skips_segments_that_a_late_cycle_has_missed() -> None:
    path = path_of([10, 20, 30])
    path.advance(25)
    assert (path.current.start, path.next_start) == (20, NEVER)


@pytest.mark.parametrize(
    ("before", "after", "reached"),
    [
        (0.0, 3.0, 3.0),
        (0.0, 4.0, 4.0 - math.tau),
        (10.0, 0.0, 2 * math.tau),
        (-20.0, 1.0, 1.0 - 3 * math.tau),
        (0.0, math.pi, math.pi),
        (0.0, -math.pi, -math.pi),
        (math.pi, 0.0, 0.0),
        (0.0, 3 * math.pi, math.pi),
        (0.0, 0.0, 0.0),
    ],
)
def test_continuous_joints_go_the_shorter_way(before: float, after: float, reached: float) -> None:
    """A half turn goes towards the position that was given."""
    assert after + wraparound_offset(before, after) == pytest.approx(reached, abs=1e-9)


class TestParsePoints:
    names = ("a", "b")

    def parse(self, *times: int, stamp: int = 0, now: int = 100 * SECOND) -> tuple[int, str]:
        points = [Point(time, [0.0, 0.0]) for time in times]
        parsed = parse_points(self.names, points, stamp, now)
        return parsed.first, parsed.warning

    def refusal(self, *points: Point) -> str:
        with pytest.raises(TrajectoryError) as caught:
            parse_points(self.names, points, 0, 100 * SECOND)
        return str(caught.value)

    def test_all_points_are_used_if_they_are_in_the_future(self) -> None:
        assert self.parse(1, 2) == (0, "")
        assert self.parse(0, 1, stamp=100 * SECOND + 1) == (0, "")

    def test_a_first_point_at_time_zero_is_skipped_silently(self) -> None:
        assert self.parse(0, SECOND) == (1, "")

    def test_points_in_the_past_are_dropped_with_a_warning(self) -> None:
        assert self.parse(0, SECOND, 2 * SECOND, 3 * SECOND, stamp=98_500_000_000) == (
            2,
            "Dropping first 2 trajectory point(s) out of 4, as they occur before the current time.\n"
            "First valid point will be reached in 0.500s.",
        )
        assert self.parse(0, SECOND, stamp=100 * SECOND)[0] == 1  # a point at the present is in the past
        assert self.parse(0, SECOND, stamp=100 * SECOND)[1].startswith("Dropping first 1 ")

    def test_a_trajectory_in_the_past_is_refused(self) -> None:
        with pytest.raises(PastTrajectoryError) as caught:
            self.parse(0, SECOND, stamp=97_250_000_000)
        assert str(caught.value) == (
            "Dropping all 2 trajectory point(s), as they occur before the current time.\n"
            "Last point is 1.750000s in the past."
        )
        with pytest.raises(PastTrajectoryError, match=r"Last point is 0\.000000s in the past"):
            self.parse(0)

    @pytest.mark.parametrize("times", [(1, 1), (2, 1), (1, 2, 2), (1, 3, 2)])
    def test_times_must_increase_strictly(self, times: tuple[int, ...]) -> None:
        with pytest.raises(TrajectoryError) as caught:
            self.parse(*times)
        assert str(caught.value) == (
            "Trajectory message contains waypoints that are not strictly increasing in time."
        )

    def test_a_point_before_the_start_in_the_future_is_refused(self) -> None:
        with pytest.raises(TrajectoryError) as caught:
            self.parse(-1, 5, stamp=200 * SECOND)
        assert str(caught.value) == "Quintic spline segment can't be constructed: end_time < start_time."

    def test_sizes_must_match(self) -> None:
        good = Point(1, [0.0, 0.0])
        mismatch = "Size mismatch in trajectory point position, velocity or acceleration data."
        assert self.refusal(Point(1, [0.0, 0.0], [0.0])) == mismatch
        assert self.refusal(Point(1, [0.0, 0.0], [], [0.0] * 3)) == mismatch
        assert self.refusal(good, Point(2, [0.0, 0.0], [0.0])) == mismatch
        assert self.refusal(Point(1, [], [0.0, 0.0])) == mismatch
        assert self.refusal(Point(1, [])) == (
            "Quintic spline segment can't be constructed: Endpoint positions can't be empty."
        )
        assert self.refusal(good, Point(2, [])) == (
            "Can't construct segment from ROS message: Start/end points data size mismatch."
        )
        for count in (1, 3):
            assert self.refusal(Point(1, [0.0] * count)) == (
                "Invalid trajectory point at index: 0. "
                "Size mismatch in joint names, position, velocity or acceleration data."
            )

    @pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e200])
    def test_values_must_be_usable(self, value: float) -> None:
        for kind, point in {
            "position": Point(2, [0.0, value]),
            "velocity": Point(2, [0.0, 0.0], [0.0, value]),
            "acceleration": Point(2, [0.0, 0.0], [0.0, 0.0], [0.0, value]),
        }.items():
            text = self.refusal(Point(1, [0.0, 0.0]), point)
            assert text == (
                f"Invalid trajectory point at index: 1. The {kind} of joint 'b' is {value}, "
                "which is not a usable number."
            )

    def test_points_that_are_dropped_are_not_checked(self) -> None:
        """MoveIt's first point has a time of 0 and may lack derivatives; ROS drops it first."""
        parsed = parse_points(self.names, [Point(0, []), Point(1, [0.0, 0.0])], 0, 100)
        assert parsed.first == 1


@given(
    st.floats(-9e99, 9e99),
    st.floats(-9e99, 9e99),
    st.floats(-9e99, 9e99),
    st.integers(1, 2**31 * SECOND),
    st.floats(0.0, 1.0),
)
def test_usable_values_give_finite_samples(
    position: float, velocity: float, acceleration: float, duration: int, fraction: float
) -> None:
    first, last = State(position, velocity, acceleration), State(-position, -velocity, -acceleration)
    for state in ((first, last), (last, first)):
        segment = Segment(0, state[0], duration, state[1])
        assert all(map(math.isfinite, segment.sample(int(duration * fraction))))
