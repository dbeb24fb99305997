"""tf.transformations compared with recorded results of the real module (`transformations_calls.py`)."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy
import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.ros.tf.tf import transformations
from tests.ros.tf2_ros.transformations_calls import Call, is_near, results

RECORDED: list[tuple[list[Call], list[Any]]] = json.loads(
    (Path(__file__).parent / "transformations.json").read_text(encoding="utf-8")
)
AXES = sorted(transformations._AXES2TUPLE)
angle = st.floats(-3, 3)


@pytest.mark.parametrize("number", range(len(RECORDED)))
def test_results_are_those_of_the_real_module(number: int) -> None:
    made, real = RECORDED[number]
    different = [
        f"{name}{tuple(arguments)}: {was} but ours {is_}"
        for (name, arguments, _), was, is_ in zip(made, real, results(transformations, made), strict=True)
        if not is_near(was, is_)
    ]
    assert not different


@given(angle, angle, angle, st.sampled_from(AXES))
def test_angles_become_a_rotation_and_angles_again(roll: float, pitch: float, yaw: float, axes: str) -> None:
    quaternion = transformations.quaternion_from_euler(roll, pitch, yaw, axes)
    matrix = transformations.euler_matrix(roll, pitch, yaw, axes)
    assert isinstance(quaternion, numpy.ndarray)
    assert numpy.allclose(transformations.quaternion_matrix(quaternion), matrix)
    again = transformations.euler_from_quaternion(quaternion, axes)
    assert all(type(each) is float for each in again)
    assert numpy.allclose(transformations.euler_matrix(*again, axes), matrix, atol=1e-6)


def test_shears_are_taken_apart() -> None:
    """The real module decomposes shears by eigenvectors, of which a shear has too few; its results are off by some percent."""
    matrix = transformations.shear_matrix(0.7, [1, -2, 0], [1, 2, 3], [0, 0, 5])
    found, direction, _, normal = transformations.shear_from_matrix(matrix)
    assert found == pytest.approx(0.7, rel=0.1)
    assert abs(numpy.dot(direction, [1, -2, 0])) == pytest.approx(math.sqrt(5), rel=0.01)
    assert abs(normal[2]) == pytest.approx(1, rel=0.01)
    again = transformations.shear_matrix(found, direction, [1, 2, 3], normal)
    assert numpy.allclose(again, matrix, atol=0.1)


def test_sets_of_points_are_superimposed() -> None:
    points = numpy.random.default_rng(1).random((3, 10))
    matrix = transformations.compose_matrix(angles=[0.1, 0.2, 0.3], translate=[1, 2, 3], scale=[2, 2, 2])
    moved = numpy.dot(matrix, numpy.vstack([points, numpy.ones(10)]))
    for by_singular_values in (True, False):
        found = transformations.superimposition_matrix(points, moved, True, by_singular_values)
        assert numpy.allclose(found, matrix)


def test_a_ball_turns_with_the_mouse() -> None:
    ball = transformations.Arcball()
    ball.place([320, 320], 320)
    ball.down([500, 250])
    ball.drag([475, 275])
    # These are the numbers in the real module's example.
    assert ball.matrix().sum() == pytest.approx(3.90583455)
    ball = transformations.Arcball(initial=[0, 0, 0, 1])
    ball.place([320, 320], 320)
    ball.setaxes([1, 1, 0], [-1, 1, 0])
    ball.setconstrain(True)
    assert ball.getconstrain()
    ball.down([400, 200])
    ball.drag([200, 400])
    assert ball.matrix().sum() == pytest.approx(0.2055924)
    ball.next()
    with pytest.raises(ValueError, match="initial not a quaternion or matrix"):
        transformations.Arcball([1, 2])
    assert numpy.allclose(transformations.Arcball(numpy.identity(4)).matrix(), numpy.identity(4))


def test_angles_of_a_quaternion_need_no_numpy() -> None:
    code = (
        "import sys, tf; from tf.transformations import euler_from_quaternion;"
        "print(euler_from_quaternion((0, 0, 0.6, 0.8))[2], 'numpy' in sys.modules)"
    )
    out = subprocess.check_output([sys.executable, "-c", code], text=True).split()
    assert float(out[0]) == pytest.approx(2 * math.atan2(0.6, 0.8))
    assert out[1] == "False"
