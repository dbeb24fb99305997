"""Hollow meshes that move: a tray holds a ball if the library coacd is there, and is its hull otherwise."""

from __future__ import annotations

import sys
import types
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="the simulation needs mujoco-core")

from minirospy.core.meshes.mesh import Mesh
from minirospy.core.meshes.parts import is_hollow
from minirospy.core.sdf.model import Collision, Inertial, Link, MeshShape, Model, Pose, Sphere, World
from minirospy.ros.gazebo_ros.physics import Simulation, SimulationError
from tests.ros.simulation.worlds import GROUND, at, single

OUTER, INNER, HEIGHT, BOTTOM = 0.15, 0.13, 0.1, 0.02
SQUARE = ((-1, -1), (1, -1), (1, 1), (-1, 1))
POINTS = [
    (side * x, side * y, z)
    for side, z in ((OUTER, 0.0), (OUTER, HEIGHT), (INNER, HEIGHT), (INNER, BOTTOM))
    for x, y in SQUARE
]
RINGS = [
    (4 * ring + edge, 4 * ring + (edge + 1) % 4, 4 * ring + 4 + (edge + 1) % 4, 4 * ring + 4 + edge)
    for ring in range(3)
    for edge in range(4)
]
FACES = [(0, 3, 2, 1), *RINGS, (12, 13, 14, 15)]


def write_tray(folder: Path) -> str:
    lines = [f"v {x} {y} {z}" for x, y, z in POINTS]
    lines += ["f " + " ".join(str(corner + 1) for corner in face) for face in FACES]
    file = folder / "tray.obj"
    file.write_text("\n".join(lines))
    return str(file)


def boxes() -> list[tuple[np.ndarray, None]]:
    """Return the corners of the tray's bottom and walls, as coacd does."""
    low, high = -OUTER, OUTER
    ranges = [
        ((low, high), (low, high), (0.0, BOTTOM)),
        *[((low, high), wall, (0.0, HEIGHT)) for wall in ((low, -INNER), (INNER, high))],
        *[(wall, (low, high), (0.0, HEIGHT)) for wall in ((low, -INNER), (INNER, high))],
    ]
    return [(np.array([(x, y, z) for x in xs for y in ys for z in zs]), None) for xs, ys, zs in ranges]


def height_of_a_ball_in(tray: str) -> tuple[float, list[str]]:
    """Return the height at which a ball of 4 cm in the moving tray comes to rest, and the warnings."""
    link = Link("l", inertial=Inertial(1.0), collisions=(Collision("c", MeshShape(tray)),))
    ball = single("ball", Sphere(0.02), 0.05, at(z=0.15))
    simulation = Simulation(World(models=(GROUND, Model("tray", {"l": link}, pose=Pose()), ball)))
    simulation.step(1000)
    return simulation.model("ball").pose.position[2], simulation.warnings


@pytest.fixture(autouse=True)
def _home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "home"))


def test_a_tray_is_split_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    fake = types.ModuleType("coacd")
    vars(fake).update(
        set_log_level=lambda level: None,
        Mesh=lambda vertices, triangles: (vertices, triangles),
        run_coacd=lambda mesh, **options: calls.append(options) or boxes(),
    )
    monkeypatch.setitem(sys.modules, "coacd", fake)
    tray = write_tray(tmp_path)

    height, (line,) = height_of_a_ball_in(tray)
    assert height == pytest.approx(BOTTOM + 0.02, abs=2e-3)
    assert line.startswith(f"model 'tray': the mesh {tray} was split into 5 convex parts in ")
    height, warnings = height_of_a_ball_in(tray)
    assert height == pytest.approx(BOTTOM + 0.02, abs=2e-3)
    assert (warnings, len(calls)) == ([], 1)

    for kept in (tmp_path / "home").rglob("*.npz"):
        kept.write_bytes(b"broken")
    assert height_of_a_ball_in(tray)[0] == pytest.approx(BOTTOM + 0.02, abs=2e-3)
    assert len(calls) == 2


def test_without_the_library_the_hull_collides(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "coacd", None)
    tray = write_tray(tmp_path)
    height, (line,) = height_of_a_ball_in(tray)
    assert height == pytest.approx(HEIGHT + 0.02, abs=2e-3)
    assert line.startswith(f"model 'tray': the mesh {tray} moves and is hollow: its convex hull collides (")
    assert "coacd" in line


def test_a_warning_of_a_refused_model_does_not_name_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "coacd", None)
    shapes = (MeshShape(write_tray(tmp_path)), MeshShape("/no/such.stl"))
    collisions = tuple(Collision(f"c{index}", shape) for index, shape in enumerate(shapes))
    simulation = Simulation(World(models=(GROUND,)))
    with pytest.raises(SimulationError, match=r"such\.stl"):
        simulation.add_model(Model("refused", {"link": Link("link", collisions=collisions)}))
    simulation.add_model(single("ball", Sphere(0.1)))
    assert simulation.warnings == []


def test_hollow_meshes() -> None:
    triangles = [(face[0], face[n], face[n + 1]) for face in FACES for n in (1, 2)]
    tray = Mesh(np.array(POINTS), np.array(triangles, np.int32))
    assert is_hollow(tray)
    # A bump on a box is not convex, and not hollow.
    bump = np.array([*POINTS[:8], (0.0, 0.0, HEIGHT + 0.02)])
    top = [(4, 5, 8), (5, 6, 8), (6, 7, 8), (7, 4, 8)]
    sides = [row for row in triangles if max(row) < 8]
    assert not is_hollow(Mesh(bump, np.array(sides + top, np.int32)))
