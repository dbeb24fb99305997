"""Rotations compared with matrices."""

from __future__ import annotations

import math

import numpy
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from minirospy.core.tf2.rotation import IDENTITY, Quaternion, Vector, compose, invert, multiply, rotate, slerp

number = st.floats(-10, 10)
vectors = st.tuples(number, number, number)


@st.composite
def rotations(draw: st.DrawFn) -> Quaternion:
    x, y, z, w = draw(st.tuples(*[st.floats(-1, 1)] * 4))
    length = math.sqrt(x * x + y * y + z * z + w * w)
    assume(length > 0.1)
    return x / length, y / length, z / length, w / length


def matrix(q: Quaternion) -> numpy.ndarray[tuple[int, ...], numpy.dtype[numpy.float64]]:
    x, y, z, w = q
    cross = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    result: numpy.ndarray[tuple[int, ...], numpy.dtype[numpy.float64]] = (
        numpy.eye(3) + 2 * w * cross + 2 * cross @ cross
    )
    return result


@given(rotations(), rotations(), vectors)
def test_products_and_rotated_vectors_are_those_of_matrices(p: Quaternion, q: Quaternion, v: Vector) -> None:
    assert rotate(q, v) == pytest.approx(matrix(q) @ v, abs=1e-9)
    assert matrix(multiply(p, q)) == pytest.approx(matrix(p) @ matrix(q), abs=1e-9)


@given(rotations(), rotations(), vectors, vectors)
def test_composed_transforms(p: Quaternion, q: Quaternion, v: Vector, w: Vector) -> None:
    moved, turned = compose((v, p), (w, q))
    assert moved == pytest.approx(matrix(p) @ w + v, abs=1e-9)
    assert matrix(turned) == pytest.approx(matrix(p) @ matrix(q), abs=1e-7)
    nowhere, still = compose(invert(v, p), (v, p))
    assert nowhere == pytest.approx((0, 0, 0), abs=1e-9)
    assert matrix(still) == pytest.approx(numpy.eye(3), abs=1e-9)


@given(rotations(), rotations(), st.floats(0, 1))
def test_slerp_turns_at_constant_speed_on_the_shortest_way(
    p: Quaternion, q: Quaternion, ratio: float
) -> None:
    def angle(a: Quaternion, b: Quaternion) -> float:
        return 2 * math.acos(min(1.0, abs(sum(x * y for x, y in zip(a, b, strict=True)))))

    between = slerp(p, q, ratio)
    assert angle(p, between) == pytest.approx(ratio * angle(p, q), abs=1e-5)
    assert angle(between, q) == pytest.approx((1 - ratio) * angle(p, q), abs=1e-5)


def test_slerp_of_equal_rotations_is_that_rotation() -> None:
    assert slerp(IDENTITY, IDENTITY, 0.3) == IDENTITY
