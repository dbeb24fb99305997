"""Calls of tf.transformations with random arguments, and their results, with the real module or minirospy's.

Run as a program under the interpreter that has the real tf, it prints the results as JSON; it imports nothing from this
folder.
"""

from __future__ import annotations

import json
import random
import sys
from typing import Any

Call = tuple[str, list[Any], dict[str, Any]]


def calls(module: Any, seed: int) -> list[Call]:
    """Return calls with arguments generated from a seed. The module itself makes the matrices to be decomposed."""
    rng = random.Random(seed)

    def vector(n: int = 3) -> list[float]:
        return [rng.uniform(-2, 2) for _ in range(n)]

    def listed(matrix: Any) -> Any:
        return matrix.tolist()

    angle, quaternion, other = rng.uniform(-3, 3), vector(4), vector(4)
    points = [vector(5) for _ in range(3)]
    normal, direction, point = vector(), vector(), vector()
    made: list[Call] = [
        ("identity_matrix", [], {}),
        ("translation_matrix", [point], {}),
        ("reflection_matrix", [point, normal], {}),
        ("rotation_matrix", [angle, direction], {}),
        ("rotation_matrix", [angle, direction, point], {}),
        ("scale_matrix", [angle], {}),
        ("scale_matrix", [angle, point], {}),
        ("scale_matrix", [angle, point, direction], {}),
        ("projection_matrix", [point, normal], {}),
        ("projection_matrix", [point, normal, direction], {}),
        ("projection_matrix", [point, normal], {"perspective": vector()}),
        ("projection_matrix", [point, normal], {"perspective": vector(), "pseudo": True}),
        ("clip_matrix", [-1.0, 2.0, -3.0, 4.0, 1.0, 9.0], {}),
        ("clip_matrix", [-1.0, 2.0, -3.0, 4.0, 1.0, 9.0, True], {}),
        ("clip_matrix", [1.0, 0.0, -3.0, 4.0, 1.0, 9.0], {}),
        ("clip_matrix", [-1.0, 2.0, -3.0, 4.0, 0.0, 9.0, True], {}),
        ("orthogonalization_matrix", [[10.0, 9.0, 8.0], [90.0, 80.0, 70.0]], {}),
        ("superimposition_matrix", [points, [vector(5) for _ in range(3)]], {}),
        ("superimposition_matrix", [points, [vector(5) for _ in range(3)]], {"scaling": True}),
        ("superimposition_matrix", [points, [vector(5) for _ in range(3)]], {"usesvd": False}),
        ("superimposition_matrix", [points, [vector(4) for _ in range(3)]], {}),
        ("quaternion_about_axis", [angle, direction], {}),
        ("quaternion_about_axis", [angle, [0.0, 0.0, 0.0]], {}),
        ("quaternion_matrix", [quaternion], {}),
        ("quaternion_matrix", [[0.0, 0.0, 0.0, 0.0]], {}),
        ("quaternion_multiply", [quaternion, other], {}),
        ("quaternion_conjugate", [quaternion], {}),
        ("quaternion_inverse", [quaternion], {}),
        *[("quaternion_slerp", [quaternion, other, fraction], {}) for fraction in (0.0, 0.3, 0.99, 1.0)],
        ("quaternion_slerp", [quaternion, quaternion, 0.5], {}),
        ("quaternion_slerp", [quaternion, other, 0.3, 1], {}),
        ("quaternion_slerp", [quaternion, other, 0.3, 0, False], {}),
        ("random_quaternion", [[0.1, 0.4, 0.7]], {}),
        ("random_rotation_matrix", [[0.1, 0.4, 0.7]], {}),
        ("unit_vector", [vector()], {}),
        ("unit_vector", [points], {}),
        ("unit_vector", [points, 0], {}),
        ("unit_vector", [points, 1], {}),
        ("vector_norm", [vector(6)], {}),
        ("vector_norm", [points], {"axis": 0}),
        ("vector_norm", [points], {"axis": 1}),
        ("vector_norm", [[]], {}),
        ("arcball_map_to_sphere", [[100.0, 20.0], [50.0, 60.0], 80.0], {}),
        ("arcball_map_to_sphere", [[300.0, 20.0], [50.0, 60.0], 80.0], {}),
        (
            "arcball_constrain_to_axis",
            [module.unit_vector(point).tolist(), module.unit_vector(normal).tolist()],
            {},
        ),
        ("arcball_constrain_to_axis", [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]], {}),
        ("arcball_nearest_axis", [[0.0, 0.6, 0.8], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]], {}),
        ("euler_matrix", [1, 2, 3], {}),
        ("euler_matrix", [1, 2, 3, (0, 1, 0, 1)], {}),
        ("euler_matrix", [1, 2, 3, "abc"], {}),
        ("euler_from_quaternion", [(0.0, 0.0, 0.0, 0.0)], {}),
    ]
    for axes in module._AXES2TUPLE:
        angles = [rng.choice([0.0, rng.uniform(-3, 3), 1.5707963267948966]) for _ in range(3)]
        made += [("euler_matrix", [*angles, axes], {}), ("quaternion_from_euler", [*angles, axes], {})]
        regular = vector()
        made += [
            ("euler_from_matrix", [listed(module.euler_matrix(*regular, axes)), axes], {}),
            ("euler_from_quaternion", [module.quaternion_from_euler(*regular, axes).tolist(), axes], {}),
        ]
    rotation = listed(module.rotation_matrix(angle, direction, point))
    plane_direction = (
        module.numpy.cross(normal, direction).tolist()
        if hasattr(module, "numpy")
        else _cross(normal, direction)
    )
    shear = listed(module.shear_matrix(0.7, plane_direction, point, normal))
    composed = listed(
        module.compose_matrix([1.5, 0.5, 2.0], [0.1, 0.2, -0.3], [0.4, 0.5, 0.6], point, [0.1, 0.2, 0.3, 1.0])
    )
    made += [
        ("translation_from_matrix", [rotation], {}),
        ("reflection_from_matrix", [listed(module.reflection_matrix(point, normal))], {}),
        ("rotation_from_matrix", [rotation], {}),
        ("rotation_from_matrix", [listed(module.scale_matrix(3.0))], {}),
        ("scale_from_matrix", [listed(module.scale_matrix(1.7, point))], {}),
        ("scale_from_matrix", [listed(module.scale_matrix(1.7, point, direction))], {}),
        ("projection_from_matrix", [listed(module.projection_matrix(point, normal))], {}),
        ("projection_from_matrix", [listed(module.projection_matrix(point, normal, direction))], {}),
        ("projection_from_matrix", [listed(module.projection_matrix(point, normal, None, other[:3]))], {}),
        ("projection_from_matrix", [listed(module.projection_matrix(point, normal, None, other[:3], True)), True], {}),
        ("shear_matrix", [0.7, plane_direction, point, normal], {}),
        ("shear_matrix", [0.7, normal, point, normal], {}),
        ("decompose_matrix", [composed], {}),
        ("decompose_matrix", [rotation], {}),
        ("decompose_matrix", [[[0.0] * 4] * 4], {}),
        ("compose_matrix", [], {"scale": [-1.0, 2.0, 3.0], "angles": [0.1, 0.2, 0.3]}),
        ("concatenate_matrices", [rotation, shear, composed], {}),
        ("inverse_matrix", [composed], {}),
        ("is_same_transform", [rotation, rotation], {}),
        ("is_same_transform", [rotation, shear], {}),
        ("quaternion_from_matrix", [rotation], {}),
        *[("quaternion_from_matrix", [listed(module.rotation_matrix(3.1, axis))], {})
          for axis in ([1, 0, 0], [0, 1, 0], [0, 0, 1], direction)],
    ]  # fmt: skip
    return made


REMAKE: dict[str, Any] = {
    "reflection_from_matrix": lambda module, found: module.reflection_matrix(*found),
    "rotation_from_matrix": lambda module, found: module.rotation_matrix(*found),
    "scale_from_matrix": lambda module, found: module.scale_matrix(*found),
    "projection_from_matrix": lambda module, found: module.projection_matrix(*found),
}
"""The points found on a plane or an axis depend on the linear algebra library, but the values derived from them do not."""


def _cross(a: list[float], b: list[float]) -> list[float]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def results(module: Any, made: list[Call]) -> list[Any]:
    """Return the result of each call, with arrays as lists, or the exception's type and text."""
    found = []
    for name, arguments, keywords in made:
        # Convert lists to tuples: axes are passed as tuples, which JSON does not have.
        given = [
            tuple(each) if name == "euler_matrix" and isinstance(each, list) else each for each in arguments
        ]
        try:
            returned = getattr(module, name)(*given, **keywords)
            found.append(plain(REMAKE[name](module, returned) if name in REMAKE else returned))
        except Exception as error:  # noqa: BLE001 - whatever it is, ours raises the same
            found.append([type(error).__name__, str(error).partition(":")[0]])
    return found


def plain(value: Any) -> Any:
    """Return a value as JSON represents it."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, (tuple, list)):
        return [plain(each) for each in value]
    return value


def is_near(real: Any, ours: Any) -> bool:
    """Return whether two results are equal; numbers may differ by a relative error of 1e-9."""
    if isinstance(real, list):
        return isinstance(ours, list) and len(real) == len(ours) and all(map(is_near, real, ours))
    if isinstance(real, float) or isinstance(ours, float):
        return bool(abs(real - ours) <= 1e-9 * max(1.0, abs(real)))
    return bool(real == ours)


if __name__ == "__main__":
    import tf.transformations as real

    seeds = [int(each) for each in sys.argv[1:]]
    json.dump([[made := calls(real, seed), results(real, made)] for seed in seeds], sys.stdout)
