"""Colour and depth pictures against geometry."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("mujoco", reason="the simulation needs mujoco-core")

from collections.abc import Iterator

from minirospy.core.sdf.model import (
    Box,
    Light,
    Link,
    Material,
    MeshShape,
    Model,
    Plane,
    Pose,
    Sphere,
    Visual,
    World,
)
from minirospy.ros.gazebo_ros.physics import Simulation, SimulationError, rendering
from minirospy.ros.gazebo_ros.physics.rendering import Renderer
from tests.ros.simulation.worlds import at

RED, GREEN = (1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0)


def visible(name: str, visual: Visual, pose: Pose) -> Model:
    return Model(name, {"link": Link("link", visuals=(visual,))}, pose=pose, is_static=True)


@pytest.fixture
def simulation() -> Simulation:
    wall = visible("wall", Visual("v", Box((1.0, 2.0, 2.0)), material=Material(RED)), at(x=3.5, z=1.0))
    floor = visible("floor", Visual("v", Plane(size=(50, 50)), material=Material(GREEN)), at())
    sun = Light("sun", "directional", at(z=10), direction=(-0.3, 0.1, -0.9))
    return Simulation(World(models=(floor, wall), lights=(sun,)))


@pytest.fixture
def renderer(simulation: Simulation) -> Iterator[Renderer]:
    try:
        renderer = simulation.renderer(160, 120)
    except SimulationError as error:
        pytest.skip(str(error))
    yield renderer
    renderer.close()


def test_colours_are_where_the_shapes_are(renderer: Renderer) -> None:
    renderer.capture(at(z=1.0), math.radians(60))
    picture = renderer.color()

    assert picture.shape == (120, 160, 3)
    middle, bottom, top = picture[60, 80], picture[-1, 80], picture[0, 2]
    assert middle[0] > 100 > middle[1]
    assert bottom[1] > 100 > bottom[0]
    assert top == pytest.approx([178, 178, 178], abs=3)  # the background


def test_depths_are_those_of_the_geometry(renderer: Renderer) -> None:
    renderer.capture(at(z=1.0), math.radians(60), near=0.05, far=20.0)
    depths = renderer.depth()

    assert depths.shape == (120, 160)
    assert depths[50:70, 70:90] == pytest.approx(np.full((20, 20), 3.0), abs=0.002)
    focal = 80 / math.tan(math.radians(30))
    row = 115
    assert depths[row, 80] == pytest.approx(1.0 * focal / (row + 0.5 - 60), rel=0.002)
    assert depths[0, 2] == math.inf


def test_a_camera_sees_models_that_come_and_go(simulation: Simulation, renderer: Renderer) -> None:
    ball = Visual("v", Sphere(0.5), material=Material(GREEN))
    simulation.add_model(visible("ball", ball, at(x=2.0, z=1.0)))
    renderer.capture(at(z=1.0), math.radians(60))
    assert renderer.depth()[60, 80] == pytest.approx(1.5, abs=0.01)

    simulation.remove_model("ball")
    renderer.capture(at(z=1.0), math.radians(60))
    assert renderer.depth()[60, 80] == pytest.approx(3.0, abs=0.01)


def test_visuals_touch_nothing(simulation: Simulation, renderer: Renderer) -> None:
    hits = simulation.cast_rays(at(z=1.0), np.array([[1.0, 0.0, 0.0]]), 10.0)
    assert hits.distances[0] == math.inf


def test_an_unreadable_visual_is_a_warning(simulation: Simulation, renderer: Renderer) -> None:
    from minirospy.core.sdf.model import MeshShape

    simulation.add_model(visible("broken", Visual("v", MeshShape("/no/such.dae")), at()))
    assert simulation.warnings == ["model 'broken': visual 'v': /no/such.dae: No such file or directory"]


def test_missing_opengl_is_one_line_with_the_libraries(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(backend: str) -> object:
        raise ImportError(f"no {backend}")

    monkeypatch.setattr(rendering, "import_context", missing)
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    with pytest.raises(SimulationError, match=r"cameras need OpenGL: .*glfw: no glfw") as caught:
        Simulation().renderer(32, 32)
    assert "\n" not in str(caught.value)
    if sys.platform == "linux":
        assert "egl: no egl" in str(caught.value)


def test_a_picture_has_a_size() -> None:
    with pytest.raises(SimulationError, match="a picture of 0x10 is not possible"):
        Simulation().renderer(0, 10)


QUARTERS = np.array([[RED[:3], GREEN[:3]], [(0.0, 0.0, 1.0), (1.0, 1.0, 0.0)]])
OBJ = """mtllib board.mtl
v 0 1 -1
v 0 -1 -1
v 0 -1 1
v 0 1 1
vt 0 0
vt 1 0
vt 1 1
vt 0 1
usemtl painted
f 1/1 2/2 3/3 4/4
"""


def write_picture(folder: Path) -> str:
    """Write a picture with a red, a green, a blue and a yellow quarter; return its path."""
    image = pytest.importorskip("PIL.Image")
    path = folder / "quarters.png"
    pixels = (255 * QUARTERS).astype(np.uint8).repeat(32, axis=0).repeat(32, axis=1)
    image.fromarray(pixels).save(path)
    return str(path)


def seen(renderer: Renderer) -> NDArray[np.float64]:
    """Return which of red, green and blue are bright in the middles of the quarters of a board 2 m ahead."""
    renderer.capture(at(x=-2.0), math.radians(60))
    picture = renderer.color()
    rows, columns = (42, 78), (62, 98)
    return np.array([[picture[row, column] > 100 for column in columns] for row in rows]).astype(float)


def drawn(visual: Visual) -> tuple[NDArray[np.float64], list[str]]:
    simulation = Simulation(World(models=(visible("board", visual, at()),)))
    try:
        renderer = simulation.renderer(160, 120)
    except SimulationError as error:
        pytest.skip(str(error))
    try:
        return seen(renderer), simulation.warnings
    finally:
        renderer.close()


def test_a_mesh_shows_its_texture(tmp_path: Path) -> None:
    write_picture(tmp_path)
    (tmp_path / "board.mtl").write_text("newmtl painted\nmap_Kd quarters.png\n")
    (tmp_path / "board.obj").write_text(OBJ)
    colors, warnings = drawn(Visual("v", MeshShape(str(tmp_path / "board.obj"))))
    assert colors.tolist() == QUARTERS.tolist()
    assert warnings == []


def test_a_box_shows_its_texture(tmp_path: Path) -> None:
    material = Material((1.0, 1.0, 1.0, 1.0), texture=write_picture(tmp_path))
    colors, warnings = drawn(Visual("v", Box((0.2, 2.0, 2.0)), material=material))
    assert colors.tolist() == QUARTERS.tolist()
    assert warnings == []


def test_a_picture_that_cannot_be_read_is_named_once(tmp_path: Path) -> None:
    pytest.importorskip("PIL")
    broken = tmp_path / "broken.png"
    broken.write_bytes(b"no picture")
    colors, warnings = drawn(Visual("v", Box((0.2, 2.0, 2.0)), material=Material(RED, texture=str(broken))))
    assert colors.tolist() == [[list(RED[:3])] * 2] * 2
    (line,) = warnings
    assert line.startswith(f"model 'board': the picture {broken} is not shown: ")
