"""Meshes of polylines, and heights of terrains."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from minirospy.core.meshes.errors import MeshError
from minirospy.core.meshes.mesh import Mesh

__all__ = ["polyline_mesh", "terrain"]

MAX_POINTS = 2000  # maximum points per polyline; triangulation takes quadratic time
MIN_EAR = 1e-12  # m^2
NO_ELEVATION = -12_000.0  # m; deeper than any sea, so lower values mark missing data
MAX_TERRAIN = 2049  # maximum pixels per side: four million cells


def polyline_mesh(points: Sequence[tuple[float, float]], height: float) -> Mesh:
    """Return the prism from z = 0 to ``height`` over a simple polygon. Raise MeshError if it has no area."""
    outline = [points[index] for index in range(len(points)) if points[index] != points[index - 1]]
    if not 3 <= len(outline) <= MAX_POINTS:
        raise MeshError(f"a polyline has 3 to {MAX_POINTS} points, not {len(outline)}")
    corners = np.array(outline, np.float64)
    x, y = corners.T
    if x @ np.roll(y, -1) - y @ np.roll(x, -1) < 0:
        corners = corners[::-1].copy()
    count = len(corners)
    top = np.array(_ears(corners), np.int32).reshape(-1, 3) + count
    ring = np.arange(count, dtype=np.int32)
    after = np.roll(ring, -1)
    sides = np.concatenate(
        [np.stack([ring, after, after + count], 1), np.stack([ring, after + count, ring + count], 1)]
    )
    vertices = np.zeros((2 * count, 3))
    vertices[:count, :2] = vertices[count:, :2] = corners
    vertices[count:, 2] = height
    return Mesh.checked(vertices, np.concatenate([top, (top - count)[:, ::-1], sides]).astype(np.int32))


def _ears(points: NDArray[np.float64]) -> list[tuple[int, int, int]]:
    """Return the triangles of a counter-clockwise polygon, by ear clipping."""
    left = list(range(len(points)))
    result: list[tuple[int, int, int]] = []
    while len(left) > 3:
        # Three collinear points form an ear without area, which is clipped only if there is no other ear.
        ears = (at for limit in (MIN_EAR, 0.0) for at in range(len(left)) if _is_ear(points, left, at, limit))
        at = next(ears, None)
        if at is None:
            raise MeshError("a polyline crosses itself")
        result.append((left[at - 1], left[at], left[(at + 1) % len(left)]))
        del left[at]
    return [*result, (left[0], left[1], left[2])]


def _is_ear(points: NDArray[np.float64], left: list[int], at: int, limit: float) -> bool:
    """Return whether twice the area of a corner's triangle is at least ``limit``, and no other corner is in the triangle."""
    a, b, c = left[at - 1], left[at], left[(at + 1) % len(left)]

    def side(p: NDArray[np.float64], q: NDArray[np.float64], r: NDArray[np.float64]) -> NDArray[np.float64]:
        value: NDArray[np.float64] = (q[0] - p[0]) * (r[..., 1] - p[1]) - (q[1] - p[1]) * (r[..., 0] - p[0])
        return value

    pa, pb, pc = points[a], points[b], points[c]
    if side(pa, pb, pc) < limit:
        return False
    others = points[[each for each in left if each not in (a, b, c)]]
    sides = np.minimum(np.minimum(side(pa, pb, others), side(pb, pc, others)), side(pc, pa, others))
    # Unless ``limit`` is 0, a corner on an edge counts as inside: it would later leave a triangle without area.
    return bool(((sides <= 0) if not limit else (sides < 0)).all())


def terrain(path: str) -> NDArray[np.float64]:
    """Return a greyscale image's heights (0 to 1), first row at the smallest y. Raise MeshError if the image is unreadable.

    A floating-point image contains elevations in metres, as in digital elevation models. Height 1 is the highest elevation;
    height 0 is sea level, or the lowest elevation if all are above or all below sea level.
    """
    try:
        from PIL import Image
    except ImportError:
        raise MeshError("reading the heightmap needs the library Pillow: minirospy[images]", path) from None
    try:
        with Image.open(path) as picture:
            if max(picture.size) > MAX_TERRAIN:
                raise MeshError(f"the heightmap is larger than {MAX_TERRAIN} pixels", path)
            if picture.mode == "F":
                return _relative(np.asarray(picture, np.float64)[::-1])
            pixels = np.asarray(picture.convert("I" if picture.mode.startswith("I") else "L"), np.float64)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise MeshError(f"the heightmap cannot be read: {error}", path) from None
    scale = 65535.0 if pixels.max() > 255 else 255.0
    return np.clip(pixels[::-1] / scale, 0.0, 1.0)


def _relative(elevations: NDArray[np.float64]) -> NDArray[np.float64]:
    known = np.isfinite(elevations) & (elevations > NO_ELEVATION)
    if not known.any():
        raise ValueError("it has no elevation")
    lowest, highest = elevations[known].min(), elevations[known].max()
    if highest > 0:
        lowest = max(lowest, 0.0)
    heights: NDArray[np.float64] = np.where(known, elevations - lowest, 0.0) / max(highest - lowest, 1e-9)
    return np.clip(heights, 0.0, 1.0)
