"""Colour and depth pictures against geometry."""

from __future__ import annotations

import math
import sys

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="the simulation needs mujoco-core")

from collections.abc import Iterator

from minirospy.core.sdf.model import Box, Light, Link, Material, Model, Plane, Pose, Sphere, Visual, World
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
