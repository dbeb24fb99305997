"""Shapes as triangles."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from minirospy.core.meshes.errors import MeshError
from minirospy.core.sdf.model import Heightmap, MeshShape, Polyline
from minirospy.ros.gazebo_ros import triangles
from minirospy.ros.gazebo_ros.triangles import read_triangles

OBJ = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\no a\nusemtl red\nf 1 2 3\no b\nf 1 2 4\n"


def test_mesh_of_a_file_has_its_scale_and_colors(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(OBJ)
    (tmp_path / "a.mtl").write_text("newmtl red\nKd 1 0 0\n")
    found = read_triangles(MeshShape(str(tmp_path / "a.obj"), (2.0, 1.0, 1.0)))
    assert found.corners.shape == (6, 3)
    assert found.corners[1].tolist() == [2, 0, 0]
    assert found.colors is not None
    assert found.colors[0].tolist() == [1, 0, 0, 1]
    part = read_triangles(MeshShape(str(tmp_path / "a.obj"), submesh="b"))
    assert part.corners.tolist() == [[0, 0, 0], [1, 0, 0], [0, 0, 1]]


def test_prism_is_closed() -> None:
    found = read_triangles(Polyline(((0, 0), (1, 0), (0, 1)), 2.0))
    assert found.colors is None
    assert len(found.corners) == 3 * (1 + 1 + 6)
    assert found.corners[:, 2].max() == 2


def test_terrain_covers_its_size(tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    heights = np.zeros((129, 129), np.uint8)
    heights[0, -1] = 255  # the first row is the one with the largest y
    image.fromarray(heights).save(tmp_path / "hill.png")
    corners = read_triangles(
        Heightmap(str(tmp_path / "hill.png"), (10.0, 20.0, 3.0), (1.0, 0.0, 0.5))
    ).corners
    assert corners.min(axis=0).tolist() == [-4, -10, 0.5]
    assert corners.max(axis=0).tolist() == [6, 10, 3.5]
    assert corners[corners[:, 2].argmax()].tolist() == [6, 10, 3.5]
    assert len(corners) <= 6 * 80 * 80


def test_large_or_broken_files_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.obj").write_text(OBJ)
    (tmp_path / "b.obj").write_text("v 0 0 0\n")
    monkeypatch.setattr(triangles, "MAX_TRIANGLES", 1)
    with pytest.raises(MeshError, match="2 triangles, of which at most 1 are shown"):
        read_triangles(MeshShape(str(tmp_path / "a.obj")))
    with pytest.raises(MeshError, match="no faces"):
        read_triangles(MeshShape(str(tmp_path / "b.obj")))
