"""Operations on quaternions (x, y, z, w), vectors and rigid transforms in plain floats, without an array library.

A quaternion's length need not be exactly one: tf2 accepts a squared length within 0.01 of 1 and never
normalizes, and neither do the functions here. Source: Shoemake, "Animating rotation with quaternion curves" (1985).
"""

from __future__ import annotations

import math

__all__ = ["IDENTITY", "Quaternion", "Vector", "compose", "invert", "multiply", "rotate", "slerp"]

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
IDENTITY: Quaternion = (0.0, 0.0, 0.0, 1.0)
_Matrix = tuple[Vector, Vector, Vector]


def multiply(p: Quaternion, q: Quaternion) -> Quaternion:
    """Return the rotation that applies ``q`` first, then ``p``."""
    px, py, pz, pw = p
    qx, qy, qz, qw = q
    return (
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy + py * qw + pz * qx - px * qz,
        pw * qz + pz * qw + px * qy - py * qx,
        pw * qw - px * qx - py * qy - pz * qz,
    )


def rotate(q: Quaternion, v: Vector) -> Vector:
    """Return ``q v q*``, the rotated vector, scaled by the quaternion's squared length."""
    x, y, z, w = q
    a, b, c = v
    scale = w * w - x * x - y * y - z * z
    along = 2.0 * (x * a + y * b + z * c)
    turn = 2.0 * w
    return (
        scale * a + along * x + turn * (y * c - z * b),
        scale * b + along * y + turn * (z * a - x * c),
        scale * c + along * z + turn * (x * b - y * a),
    )


def invert(translation: Vector, rotation: Quaternion) -> tuple[Vector, Quaternion]:
    """Return the inverse of a transform; the conjugate is used as the inverse of the rotation."""
    x, y, z, w = rotation
    inverse = (-x, -y, -z, w)
    a, b, c = translation
    return rotate(inverse, (-a, -b, -c)), inverse


def slerp(p: Quaternion, q: Quaternion, ratio: float) -> Quaternion:
    """Return the rotation at ``ratio`` on the shortest path from ``p`` (0) to ``q`` (1), at constant angular speed."""
    px, py, pz, pw = p
    qx, qy, qz, qw = q
    dot = px * qx + py * qy + pz * qz + pw * qw
    length = math.sqrt((px * px + py * py + pz * pz + pw * pw) * (qx * qx + qy * qy + qz * qz + qw * qw))
    if dot < 0:
        # -q is the same rotation as q, but closer to p.
        dot, qx, qy, qz, qw = -dot, -qx, -qy, -qz, -qw
    cosine = dot / length
    if cosine >= 1.0:
        return p

    angle = math.acos(cosine)
    scale = 1.0 / math.sin(angle)
    s = math.sin((1.0 - ratio) * angle)
    t = math.sin(ratio * angle)
    return (
        (px * s + qx * t) * scale,
        (py * s + qy * t) * scale,
        (pz * s + qz * t) * scale,
        (pw * s + qw * t) * scale,
    )


def compose(first: tuple[Vector, Quaternion], second: tuple[Vector, Quaternion]) -> tuple[Vector, Quaternion]:
    """Return the transform that applies ``second`` first, then ``first``.

    Uses rotation matrices, as tf2 does to compose the two halves of a lookup with a fixed frame. The matrices normalize
    the quaternions and determine the sign of the result.
    """
    m, n = _matrix(first[1]), _matrix(second[1])
    product = _product(m, n)
    x, y, z = second[0]
    a, b, c = first[0]
    moved = (
        m[0][0] * x + m[0][1] * y + m[0][2] * z + a,
        m[1][0] * x + m[1][1] * y + m[1][2] * z + b,
        m[2][0] * x + m[2][1] * y + m[2][2] * z + c,
    )
    return moved, _quaternion(product)


def _matrix(q: Quaternion) -> _Matrix:
    x, y, z, w = q
    s = 2.0 / (x * x + y * y + z * z + w * w)
    return (
        (1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)),
        (s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)),
        (s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)),
    )


def _product(m: _Matrix, n: _Matrix) -> _Matrix:
    rows = [
        (
            row[0] * n[0][0] + row[1] * n[1][0] + row[2] * n[2][0],
            row[0] * n[0][1] + row[1] * n[1][1] + row[2] * n[2][1],
            row[0] * n[0][2] + row[1] * n[1][2] + row[2] * n[2][2],
        )
        for row in m
    ]
    return rows[0], rows[1], rows[2]


def _quaternion(m: _Matrix) -> Quaternion:
    """Return a rotation matrix's quaternion, computed from the trace or, if that is small, the largest diagonal element."""
    trace = m[0][0] + m[1][1] + m[2][2]
    if trace > 0.0:
        root = math.sqrt(trace + 1.0)
        s = 0.5 / root
        return (m[2][1] - m[1][2]) * s, (m[0][2] - m[2][0]) * s, (m[1][0] - m[0][1]) * s, root * 0.5

    diagonal = (m[0][0], m[1][1], m[2][2])
    i = diagonal.index(max(diagonal))
    j, k = (i + 1) % 3, (i + 2) % 3
    root = math.sqrt(m[i][i] - m[j][j] - m[k][k] + 1.0)
    s = 0.5 / root
    found = [0.0, 0.0, 0.0, (m[k][j] - m[j][k]) * s]
    found[i] = root * 0.5
    found[j] = (m[j][i] + m[i][j]) * s
    found[k] = (m[k][i] + m[i][k]) * s
    return found[0], found[1], found[2], found[3]
