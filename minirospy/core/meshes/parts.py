"""Convex parts of a mesh for collisions.

A physics engine collides only convex bodies. A convex part of a mesh that is closed and oriented outwards is used unchanged. The
treatment of any other part depends on its body. If the body never moves, each flat patch of the surface becomes a thin prism, so
that a robot can stand in a room that is a single mesh. If the body moves, the convex hull of the part is used, or the result of a
function that splits hollow parts.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from minirospy.core.meshes.errors import MeshError
from minirospy.core.meshes.mesh import Mesh

__all__ = ["Parts", "collision_parts", "connected_parts", "is_convex", "is_hollow"]

MAX_HULLS = 32  # maximum hulls for a moving mesh; a mesh with more parts gets a single hull
# Maximum flat patches in a static mesh. A finer mesh is simplified, because a world may have many meshes.
MAX_PRISMS = 1500
MIN_PRISMS = 100  # the limit on a mesh's flat patches is at least this number
PRISMS_PER_METER = 200  # limit on a mesh's flat patches, per metre of its longest side
MAX_CONVEX = 5000  # maximum triangles in a part that is tested for convexity; more would take seconds
MAX_RAYS = 200  # maximum rays, cast from the largest triangles to detect a hollow mesh
MAX_TESTS = 2_000_000  # maximum ray-triangle tests, which take 0.2 s
HOLLOW = 0.1  # minimum fraction of a hollow mesh's surface that faces other parts of it, as in a cup
THICKNESS = 0.02  # m; thickness of the prism below a flat patch of the surface
FLAT = 1e-6  # fraction of the mesh's size; anything thinner has no hull
# Fraction of the part's size; no vertex of a convex part is further than this in front of a face
TOLERANCE = 1e-4

Points = NDArray[np.float64]
Triangles = NDArray[np.int32]


class Parts(NamedTuple):
    """Meshes whose convex hulls are used for collisions; ``are_exact`` if together they equal the original mesh."""

    meshes: list[Mesh]
    are_exact: bool


def collision_parts(
    mesh: Mesh, *, is_static: bool, split: Callable[[Mesh, int], list[Mesh] | None] = lambda part, most: None
) -> Parts:
    """Return the convex parts of a mesh, for collisions.

    ``split`` returns at most the given number of convex parts of a hollow moving part, or None to use its hull.
    """
    mesh = _welded(mesh)
    if not _has_area(mesh).any():
        raise MeshError("the mesh has no area")
    parts = connected_parts(mesh)
    if not is_static:
        if len(parts) > MAX_HULLS:
            return Parts([_thickened(mesh)], False)
        hollow = list(map(is_hollow, parts))
        most = MAX_HULLS // max(sum(hollow), 1)  # maximum hulls per hollow part
        hulls: list[Mesh] = []
        for part, splits in zip(parts, hollow, strict=True):
            hulls += (split(part, most) if splits and most > 1 else None) or [_thickened(part)]
        return Parts(hulls, all(map(is_convex, parts)))

    convex: list[Mesh] = []
    others: list[Mesh] = []
    for part in parts:
        (convex if is_convex(part) else others).append(part)
    if len(convex) > MAX_PRISMS:
        others, convex = parts, []
    if not others:
        return Parts(convex, True)
    return Parts(convex + _prisms(Mesh.join(others)), False)


def connected_parts(mesh: Mesh) -> list[Mesh]:
    """Return the mesh's connected components, in the order of their first triangles."""
    labels = _labels(len(mesh.vertices), mesh.triangles)
    of_triangle = labels[mesh.triangles[:, 0]]
    order = np.argsort(of_triangle, kind="stable")
    _, starts = np.unique(of_triangle[order], return_index=True)
    return [
        _compact(mesh.vertices, mesh.triangles[np.sort(rows)])
        for rows in sorted(np.split(order, starts[1:]), key=lambda rows: int(rows.min()))
    ]


def is_convex(part: Mesh) -> bool:
    """Return whether a connected mesh is closed, oriented outwards, and has no vertices in front of its faces."""
    triangles, vertices = part.triangles, part.vertices
    if len(triangles) < 4 or len(triangles) > MAX_CONVEX:
        return False
    edges = _edges(triangles)
    forward = edges[:, 0] * len(vertices) + edges[:, 1]
    backward = edges[:, 1] * len(vertices) + edges[:, 0]
    if len(np.unique(forward)) != len(forward) or not np.array_equal(np.sort(forward), np.sort(backward)):
        return False

    size = float(np.ptp(vertices, axis=0).max())
    normals = _normals(part)
    offsets = np.einsum("ij,ij->i", normals, vertices[triangles[:, 0]])
    for start in range(0, len(normals), 512):  # in blocks, to limit the memory
        rows = slice(start, start + 512)
        heights = normals[rows] @ vertices.T - offsets[rows, None]
        if heights.max() > TOLERANCE * size:
            return False
    # Also require a volume, because a flat part passes the tests above.
    return bool(np.linalg.matrix_rank(vertices - vertices[0], tol=FLAT * max(size, 1e-12)) == 3)


def is_hollow(part: Mesh) -> bool:
    """Return whether a mesh's hull is much larger than the mesh: many rays that leave its surface hit the mesh again."""
    if is_convex(part) or len(part.triangles) < 4:
        return False
    corners, crosses = part.corners, part.crosses
    areas = np.linalg.norm(crosses, axis=1)
    count = max(1, min(MAX_RAYS, MAX_TESTS // len(areas)))
    chosen = np.argsort(-areas, kind="stable")[:count]
    hits = sum(
        areas[row]
        for row in chosen.tolist()
        if len(_hits(corners, corners[row].mean(axis=0), crosses[row] / max(areas[row], 1e-300)))
    )
    return bool(hits > HOLLOW * areas[chosen].sum())


def _welded(mesh: Mesh) -> Mesh:
    """Merge equal vertices, and drop triangles without area."""
    points = mesh.vertices[mesh.triangles].reshape(-1, 3)
    size = max(float(np.ptp(points, axis=0).max()), 1e-12)
    grid = np.round((points - points.min(axis=0)) / (size * 1e-7)).astype(np.int64)
    _, first, index = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    triangles = index.reshape(-1, 3).astype(np.int32)
    vertices = points[first]
    result = Mesh(vertices, triangles)
    keep = _has_area(result)
    return Mesh(vertices, triangles[keep]) if keep.any() else result


def _labels(count: int, triangles: Triangles) -> NDArray[np.int64]:
    """Return, for each vertex, the smallest index of a vertex connected to it."""
    labels = np.arange(count)
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]]]).astype(np.int64)
    while True:
        left, right = labels[pairs[:, 0]], labels[pairs[:, 1]]
        lower = np.minimum(left, right)
        if np.array_equal(left, right):
            return labels
        # Attach each root to a smaller one, then shorten all paths.
        np.minimum.at(labels, left, lower)
        np.minimum.at(labels, right, lower)
        while True:
            shorter = labels[labels]
            if np.array_equal(shorter, labels):
                break
            labels = shorter


def _compact(vertices: Points, triangles: Triangles) -> Mesh:
    used, index = np.unique(triangles, return_inverse=True)
    return Mesh(vertices[used], index.reshape(-1, 3).astype(np.int32))


def _edges(triangles: Triangles) -> NDArray[np.int64]:
    """Return the triangles' edges (3 n, 2): all first edges, then all second ones, then all third ones."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    return edges.astype(np.int64)


def _normals(mesh: Mesh) -> Points:
    normals = mesh.crosses
    lengths: Points = np.linalg.norm(normals, axis=1, keepdims=True)
    result: Points = normals / np.maximum(lengths, 1e-300)
    return result


def _thickened(part: Mesh) -> Mesh:
    """Thicken a flat part, which would otherwise have no hull."""
    centered = part.vertices - part.vertices.mean(axis=0)
    size = max(float(np.ptp(centered, axis=0).max()), 1e-9)
    _, axes = np.linalg.eigh(centered.T @ centered)
    vertices = part.vertices
    for axis in axes.T:
        if float(np.ptp(centered @ axis)) < 1e-4 * size:
            half = axis * max(size * 1e-3, 5e-4)
            vertices = np.concatenate([vertices - half, vertices + half])
    return part if len(vertices) == len(part.vertices) else Mesh(vertices, part.triangles)


def _prisms(mesh: Mesh) -> list[Mesh]:
    """Return a prism below each flat convex patch of the surface."""
    size = float(np.ptp(mesh.vertices, axis=0).max())
    limit = min(max(round(PRISMS_PER_METER * size), MIN_PRISMS), MAX_PRISMS)
    patches = _patches(mesh, limit)
    cell = size / 1000
    simple = mesh
    while patches is None:
        simple = _simplified(mesh, cell)
        patches = _patches(simple, limit)
        cell *= 1.6
    mesh = simple
    depths = _depths(mesh, patches)
    return [
        Mesh(np.concatenate([outline, outline - depth * normal]), np.zeros((0, 3), np.int32))
        for (outline, normal), depth in zip(patches, depths, strict=True)
    ]


def _patches(mesh: Mesh, limit: int) -> list[tuple[Points, Points]] | None:
    """Return the outlines and normals of flat convex patches, or None if there are more than the limit."""
    normals = _normals(mesh)
    patches: list[tuple[Points, Points]] = []
    groups = _coplanar(mesh, normals)
    if len(groups) > limit:
        return None
    for rows in groups:
        outline = _convex_outline(mesh, rows, normals[rows[0]])
        if outline is not None:
            patches.append((outline, normals[rows[0]]))
        else:
            patches.extend((mesh.vertices[mesh.triangles[row]], normals[row]) for row in rows)
    return patches if len(patches) <= 2 * limit else None


def _simplified(mesh: Mesh, cell: float) -> Mesh:
    """Merge all vertices in the same cell of a cubic grid."""
    grid = np.round(mesh.vertices / cell).astype(np.int64)
    _, first, index = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    triangles = index.ravel()[mesh.triangles]
    _, rows = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
    result = Mesh(mesh.vertices[first], triangles[np.sort(rows)].astype(np.int32))
    return _compact(result.vertices, result.triangles[_has_area(result)])


def _has_area(mesh: Mesh) -> NDArray[np.bool_]:
    """Return whether each triangle has an area above zero."""
    corners = mesh.corners
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = np.linalg.norm(mesh.crosses, axis=1)
    longest = np.maximum((first * first).sum(axis=1), (second * second).sum(axis=1))
    result: NDArray[np.bool_] = areas > 1e-9 * longest
    return result


def _coplanar(mesh: Mesh, normals: Points) -> list[NDArray[np.int64]]:
    """Return groups of triangles that are connected by edges and lie in a common plane."""
    count = len(mesh.triangles)
    edges = np.sort(_edges(mesh.triangles), axis=1)
    owners = np.tile(np.arange(count), 3)
    keys = edges[:, 0] * len(mesh.vertices) + edges[:, 1]
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(keys[order][1:] == keys[order][:-1])
    left, right = owners[order][same], owners[order][same + 1]
    flat = np.einsum("ij,ij->i", normals[left], normals[right]) > 1 - 1e-8
    left, right = left[flat], right[flat]
    labels = _labels(count, np.stack([left, right, right], axis=1).astype(np.int32))
    order = np.argsort(labels, kind="stable")
    _, starts = np.unique(labels[order], return_index=True)
    return list(np.split(order, starts[1:]))


def _convex_outline(mesh: Mesh, rows: NDArray[np.int64], normal: Points) -> Points | None:
    """Return the corners of a patch, or None if the patch is not convex."""
    points = mesh.vertices[np.unique(mesh.triangles[rows])]
    first = np.cross(normal, (1.0, 0, 0) if abs(normal[0]) < 0.9 else (0, 1.0, 0))
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    flat = np.stack([points @ first, points @ second], axis=1)
    hull = _hull(flat)
    area = np.linalg.norm(Mesh(mesh.vertices, mesh.triangles[rows]).crosses, axis=1).sum()
    x, y = flat[hull].T
    whole = abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    return points[hull] if abs(whole - area) <= 1e-4 * whole else None


def _hull(points: Points) -> list[int]:
    """Return the indices of the corners of a planar hull (Andrew's monotone chain)."""
    order = np.lexsort((points[:, 1], points[:, 0])).tolist()
    rows = points.tolist()

    def chain(indices: list[int]) -> list[int]:
        result: list[int] = []
        for index in indices:
            x, y = rows[index]
            while len(result) >= 2:
                (ax, ay), (bx, by) = rows[result[-2]], rows[result[-1]]
                if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0:
                    break
                result.pop()
            result.append(index)
        return result[:-1]

    return chain(order) + chain(order[::-1])


def _depths(mesh: Mesh, patches: list[tuple[Points, Points]]) -> Points:
    """Return each prism's thickness, reduced if another surface is close behind, so that thin walls stay thin."""
    depths = np.full(len(patches), THICKNESS)
    if len(patches) * len(mesh.triangles) > 20_000_000:
        return depths
    corners = mesh.corners
    for index, (outline, normal) in enumerate(patches):
        hits = _hits(corners, outline.mean(axis=0), -normal)
        if len(hits):
            depths[index] = min(THICKNESS, max(float(hits.min()), 1e-3))
    return depths


def _hits(corners: Points, start: Points, direction: Points) -> Points:
    """Return the distances at which a ray hits triangles (n, 3, 3), by the Moeller-Trumbore method."""
    origin, first, second = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    cross = np.cross(direction, second)
    determinant = np.einsum("ij,ij->i", first, cross)
    inverse = np.divide(1.0, determinant, out=np.zeros_like(determinant), where=abs(determinant) > 1e-15)
    offset = start - origin
    u = np.einsum("ij,ij->i", offset, cross) * inverse
    q = np.cross(offset, first)
    v = (q @ direction) * inverse
    distance: Points = np.einsum("ij,ij->i", second, q) * inverse
    hits: Points = distance[(inverse != 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 1e-4)]
    return hits
