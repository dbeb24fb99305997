"""Triangles of shapes that no marker URI can name: files outside packages, sub-meshes, prisms, terrains. Pure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from minirospy.core.meshes.errors import MeshError
from minirospy.core.meshes.files import read_mesh
from minirospy.core.meshes.mesh import Mesh
from minirospy.core.meshes.solids import polyline_mesh, terrain
from minirospy.core.sdf.model import Color, Heightmap, MeshShape, Polyline

__all__ = ["MAX_TRIANGLES", "Triangles", "read_triangles"]

MAX_TRIANGLES = 20_000  # maximum triangles per shape; each takes 36 to 84 bytes in each message with shapes
MAX_CELLS = 80  # maximum number of cells per side of a heightmap


class Triangles(NamedTuple):
    """Triangle corners (3 n, 3) in m and their colours (3 n, 4), or None if the file has no colours."""

    corners: NDArray[np.float64]
    colors: NDArray[np.float64] | None


def read_triangles(shape: MeshShape | Polyline | Heightmap) -> Triangles:
    """Return a shape's triangles. Raise MeshError if it is unreadable or has more than MAX_TRIANGLES."""
    if isinstance(shape, Heightmap):
        return Triangles(_terrain_corners(shape), None)
    if isinstance(shape, Polyline):
        meshes = [polyline_mesh(shape.points, shape.height)]
    else:
        meshes = read_mesh(shape.path, shape.submesh, shape.scale, is_centered=shape.is_centered)
    count = sum(len(mesh.triangles) for mesh in meshes)
    if count > MAX_TRIANGLES:
        raise MeshError(f"{count} triangles, of which at most {MAX_TRIANGLES} are shown")
    return _joined(meshes)


def _joined(meshes: list[Mesh]) -> Triangles:
    corners: list[NDArray[np.float64]] = []
    colors: list[NDArray[np.float64]] = []
    grey: Color = (0.7, 0.7, 0.7, 1.0)
    has_colors = False
    for mesh in meshes:
        for triangles, color in mesh.by_material():
            corners.append(mesh.vertices[triangles].reshape(-1, 3))
            colors.append(np.tile(np.array(color or grey), (len(corners[-1]), 1)))
            has_colors = has_colors or color is not None
    return Triangles(np.concatenate(corners), np.concatenate(colors) if has_colors else None)


def _terrain_corners(shape: Heightmap) -> NDArray[np.float64]:
    heights = terrain(shape.path)
    rows, columns = (np.unique(np.linspace(0, size - 1, MAX_CELLS + 1).astype(int)) for size in heights.shape)
    sx, sy, sz = shape.size
    x = (columns / (heights.shape[1] - 1) - 0.5) * sx
    y = (rows / (heights.shape[0] - 1) - 0.5) * sy
    grid = np.stack((*np.meshgrid(x, y), heights[np.ix_(rows, columns)] * sz), axis=-1) + shape.position
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, :-1], grid[1:, 1:]
    return np.stack((a, b, d, a, d, c), axis=2).reshape(-1, 3)
