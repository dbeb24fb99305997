"""Times and durations compared with integers in nanoseconds."""

from __future__ import annotations

import copy
import operator
import pickle
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.times import Duration, Time, TVal
from minirospy.client import time as client_time

BILLION = 10**9
KINDS = pytest.mark.parametrize("kind", [Time, Duration, client_time.Time, client_time.Duration])
spans = st.integers(-(2**62), 2**62)
points = st.integers(0, 2**62)


def duration(nanoseconds: int) -> Duration:
    return Duration(0, nanoseconds)


def point(nanoseconds: int) -> Time:
    return Time(0, nanoseconds)


@given(spans, st.integers(-(2**40), 2**40))
def test_normalised(nanoseconds: int, seconds: int) -> None:
    value = Duration(seconds, nanoseconds)
    assert 0 <= value.nsecs < BILLION
    assert value.to_nsec() == seconds * BILLION + nanoseconds == value.secs * BILLION + value.nsecs
    assert str(value) == str(value.to_nsec())
    assert bool(value) is not value.is_zero()


@given(spans, spans)
def test_durations_are_numbers(a: int, b: int) -> None:
    for operation in (operator.add, operator.sub):
        assert operation(duration(a), duration(b)).to_nsec() == operation(a, b)
    for operation in (operator.eq, operator.ne, operator.lt, operator.le, operator.gt, operator.ge):
        assert operation(duration(a), duration(b)) is operation(a, b)
    assert (-duration(a)).to_nsec() == -a
    assert abs(duration(a)).to_nsec() == abs(a)
    if b:
        assert (duration(a) % duration(b)).to_nsec() == a % b
        whole, rest = divmod(duration(a), duration(b))
        assert (whole, rest.to_nsec()) == divmod(a, b)
        assert duration(a) / duration(b) == pytest.approx(a / b)


@given(points, spans)
def test_arithmetic_of_times_and_durations(a: int, b: int) -> None:
    for operation in (operator.add, operator.sub):
        if operation(a, b) < 0:
            with pytest.raises(TypeError, match="time values must be positive"):
                operation(point(a), duration(b))
        else:
            assert operation(point(a), duration(b)).to_nsec() == operation(a, b)
    if a + b >= 0:
        assert (duration(b) + point(a)) == point(a + b)


@given(points, points)
def test_times_are_ordered(a: int, b: int) -> None:
    assert (point(a) - point(b)).to_nsec() == a - b
    assert type(point(a) - point(b)) is Duration
    for operation in (operator.eq, operator.ne, operator.lt, operator.le, operator.gt, operator.ge):
        assert operation(point(a), point(b)) is operation(a, b)
    assert (hash(point(a)) == hash(point(b))) == (a == b)


@given(spans, st.integers(-1000, 1000))
def test_whole_factors_are_exact(a: int, factor: int) -> None:
    assert (duration(a) * factor).to_nsec() == (factor * duration(a)).to_nsec() == a * factor


@given(st.floats(-1e9, 1e9))
def test_floats_are_cut_off(seconds: float) -> None:
    for value in (Duration(seconds), Duration.from_sec(seconds)):
        # A float this large has a resolution of 1e-7 seconds.
        assert abs(Fraction(value.to_nsec()) / BILLION - Fraction(seconds)) <= Fraction(2, 10**9)
        assert abs(value.to_sec() - seconds) < 2e-7


@KINDS
@pytest.mark.parametrize(
    "arguments", [("x",), (None,), (1.5, 2), (float("nan"),), (float("inf"),), (1, None)]
)
def test_invalid_values_are_refused(kind: type[TVal], arguments: tuple[object, ...]) -> None:
    with pytest.raises((TypeError, ValueError, OverflowError)):
        kind(*arguments)  # type: ignore[arg-type]


def test_time_before_the_epoch_is_refused() -> None:
    for arguments in ((-1,), (0, -1), (-0.5,), (-2, BILLION)):
        with pytest.raises(TypeError, match="time values must be positive"):
            Time(*arguments)


@pytest.mark.parametrize("other", [1, 1.5, "s", None, Time(1)])
def test_time_is_not_a_number(other: object) -> None:
    for operation in (operator.add, operator.mul, operator.truediv, operator.mod):
        with pytest.raises(TypeError):
            operation(Time(5), other)
    assert (Time(5) == other) is False
    assert Time(5) != other


def test_time_is_not_a_duration() -> None:
    assert Time(1) != Duration(1)
    assert len({Time(1), Duration(1)}) == 2
    with pytest.raises(TypeError):
        operator.lt(Time(1), Duration(1))


@KINDS
def test_results_keep_the_class(kind: type[TVal]) -> None:
    value = kind(5, 6)
    assert type(operator.add(value, Duration(1))) is kind
    assert type(copy.deepcopy(value)) is kind
    assert pickle.loads(pickle.dumps(value)) == value
    assert repr(value).endswith(f"{kind.__name__}[5000000006]")
    with pytest.raises(AttributeError):
        value.other = 1  # type: ignore[attr-defined]


@KINDS
def test_set_does_not_normalise(kind: type[TVal]) -> None:
    value = kind()
    value.set(5, 6 * BILLION)
    assert (value.secs, value.nsecs) == (5, 6 * BILLION)
    value.canon()
    assert (value.secs, value.nsecs) == (11, 0)


def test_values_of_numpy_do_not_overflow() -> None:
    numpy = pytest.importorskip("numpy")
    stamp = Time()
    stamp.secs, stamp.nsecs = numpy.int32(3), numpy.uint32(5)
    assert stamp.to_nsec() == 3_000_000_005
    assert stamp - Time(1) == Duration(2, 5)
    stamp.set(numpy.float32(1.5), 0)
    assert stamp.to_nsec() == 1_500_000_000
