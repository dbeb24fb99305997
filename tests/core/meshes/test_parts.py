"""Convex parts of meshes, and prisms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from minirospy.core.meshes.errors import MeshError
from minirospy.core.meshes.mesh import Mesh
from minirospy.core.meshes.parts import MAX_PRISMS, THICKNESS, collision_parts, connected_parts, is_convex
from minirospy.core.meshes.solids import polyline_mesh, terrain


def box(x: float = 0.0, side: float = 1.0) -> Mesh:
    square = ((0, 0), (side, 0), (side, side), (0, side))
    mesh = polyline_mesh(square, side)
    return Mesh(np.add(mesh.vertices, (x, 0.0, 0.0)), mesh.triangles)


def corner() -> Mesh:
    return polyline_mesh(((0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)), 1.0)


def inside_out(mesh: Mesh) -> Mesh:
    return Mesh(mesh.vertices, mesh.triangles[:, ::-1].copy())


def sphere(count: int) -> Mesh:
    """Return a sphere of about 2 * count^2 triangles."""
    u, v = np.meshgrid(np.linspace(0, np.pi, count + 1), np.linspace(0, 2 * np.pi, count + 1), indexing="ij")
    vertices = np.stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)], axis=-1).reshape(-1, 3)
    at = np.arange(count * (count + 1)).reshape(count, count + 1)[:, :-1].ravel()
    next_row = at + count + 1
    quads = [np.stack([at, next_row, next_row + 1], 1), np.stack([at, next_row + 1, at + 1], 1)]
    return Mesh(vertices, np.concatenate(quads).astype(np.int32))


def test_convex_means_closed_outward_and_without_dents() -> None:
    assert is_convex(box())
    assert not is_convex(corner())
    assert not is_convex(inside_out(box()))  # a room
    assert not is_convex(Mesh(box().vertices, box().triangles[:-2]))  # a wall is missing
    flat = Mesh(np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0.0)]), np.array([(0, 1, 2), (0, 2, 1)], np.int32))
    assert not is_convex(flat)


def test_parts_share_no_vertex() -> None:
    parts = connected_parts(Mesh.join([box(), corner(), box(5.0)]))
    assert [len(part.triangles) for part in parts] == [12, len(corner().triangles), 12]
    assert parts[2].vertices[:, 0].min() == 5.0


@pytest.mark.parametrize("is_static", [True, False])
def test_convex_parts_are_used_as_they_are(is_static: bool) -> None:
    parts = collision_parts(Mesh.join([box(), box(5.0)]), is_static=is_static)
    assert parts.are_exact
    assert [len(part.vertices) for part in parts.meshes] == [8, 8]


def test_parts_of_unmerged_triangles_are_merged() -> None:
    mesh = box()
    loose = Mesh(mesh.vertices[mesh.triangles].reshape(-1, 3), np.arange(36, dtype=np.int32).reshape(12, 3))
    parts = collision_parts(loose, is_static=True)
    assert parts.are_exact
    assert len(parts.meshes) == 1


def test_a_static_room_becomes_prisms_below_its_surface() -> None:
    parts = collision_parts(inside_out(box(side=4.0)), is_static=True)

    assert not parts.are_exact
    assert len(parts.meshes) == 6  # one for each flat face
    for part in parts.meshes:
        assert len(part.vertices) == 8
        assert min(np.ptp(part.vertices, axis=0)) == pytest.approx(THICKNESS)
        # Nothing is inside the room.
        assert (((part.vertices > 1e-9) & (part.vertices < 4 - 1e-9)).all(axis=1)).sum() == 0


def test_patches_that_are_not_convex_become_triangles() -> None:
    parts = collision_parts(corner(), is_static=True)
    # The walls are six quadrangles; floor and ceiling are four triangles each.
    assert sorted(len(part.vertices) for part in parts.meshes) == [6] * 8 + [8] * 6


def test_prisms_of_a_thin_wall_stay_in_it() -> None:
    points = ((0, 0), (1, 0), (1, 0.008), (0.5, 0.005), (0, 0.008))
    for part in collision_parts(polyline_mesh(points, 1.0), is_static=True).meshes:
        if np.ptp(part.vertices[:, 0]) > 0.3:
            assert part.vertices[:, 1].min() > -0.0021
            assert part.vertices[:, 1].max() < 0.0101


def test_a_moving_mesh_has_a_hull_for_each_part() -> None:
    parts = collision_parts(Mesh.join([corner(), box(5.0)]), is_static=False)
    assert len(parts.meshes) == 2
    assert not parts.are_exact


def test_a_flat_moving_mesh_is_thickened() -> None:
    flat = Mesh(
        np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0.0)]), np.array([(0, 1, 2), (0, 2, 3)], np.int32)
    )
    (part,) = collision_parts(flat, is_static=False).meshes
    assert np.ptp(part.vertices, axis=0) == pytest.approx((1.0, 1.0, 0.002))


def test_fine_meshes_are_simplified() -> None:
    mesh = Mesh.join([inside_out(sphere(100)), inside_out(sphere(3))])
    parts = collision_parts(mesh, is_static=True)
    assert 100 < len(parts.meshes) <= 2 * MAX_PRISMS
    assert max(np.linalg.norm(part.vertices, axis=1).max() for part in parts.meshes) < 1.1


@pytest.mark.parametrize(("scale", "most"), [(0.1, 200), (1.0, 800), (10.0, 3000)])
def test_small_meshes_have_fewer_prisms(scale: float, most: int) -> None:
    mesh = inside_out(sphere(60)).scaled((scale, scale, scale))
    parts = collision_parts(mesh, is_static=True)
    assert most / 10 < len(parts.meshes) <= most
    radii = np.concatenate([np.linalg.norm(part.vertices, axis=1) for part in parts.meshes])
    assert radii.max() < 1.1 * scale + THICKNESS


def test_many_moving_parts_have_one_hull() -> None:
    parts = collision_parts(Mesh.join([box(2.0 * index) for index in range(40)]), is_static=False)
    assert len(parts.meshes) == 1


@pytest.mark.parametrize(("count", "most"), [(1, 32), (5, 6), (16, 2), (17, None), (30, None)])
def test_hollow_parts_share_the_hulls(count: int, most: int | None) -> None:
    asked: list[int] = []

    def split(part: Mesh, most: int) -> list[Mesh]:
        asked.append(most)
        return [part] * most

    channel = polyline_mesh(((0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)), 1.0)
    channels = [
        Mesh(channel.vertices + np.array([5.0 * index, 0, 0]), channel.triangles) for index in range(count)
    ]
    parts = collision_parts(Mesh.join(channels), is_static=False, split=split)
    assert asked == ([] if most is None else [most] * count)
    assert len(parts.meshes) == count * (most or 1)


def test_polylines_that_cross_or_are_short_are_refused() -> None:
    with pytest.raises(MeshError, match="3 to 2000 points, not 2"):
        polyline_mesh(((0, 0), (1, 1)), 1.0)
    volume = 0.0
    mesh = corner()
    for a, b, c in mesh.vertices[mesh.triangles]:
        volume += a @ np.cross(b, c) / 6
    assert volume == pytest.approx(3.0)


def test_a_terrain_below_the_sea_has_its_heights(tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image", reason="heightmaps need Pillow")
    elevations = np.array([[-430, -400], [-410, -99999]], np.float32)  # the last one is missing
    image.fromarray(elevations).save(tmp_path / "basin.tif")
    assert terrain(str(tmp_path / "basin.tif")).tolist() == [[pytest.approx(2 / 3), 0], [0, 1]]
