"""The library of models and worlds: each one is read without a warning, and robots have room in it."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import minirospy.ros.gazebo_ros.paths as paths_module
from minirospy.core.sdf.model import Box, Cylinder, World
from minirospy.core.sdf.poses import compose, inverse, rotate
from minirospy.core.sdf.read import parse_model, parse_world
from minirospy.ros.gazebo_ros.paths import resource_paths

HERE = Path(paths_module.__file__).parent
PATHS = resource_paths({})
MODELS = sorted(path.name for path in (HERE / "models").iterdir())
WORLDS = sorted(path.name for path in (HERE / "worlds").glob("*.world"))
MAX_BYTES = 40_000

BY_NAME = ["empty", "shapes", "mud", "rubble", "willowgarage", "elevator_ros"]
"""The worlds that gazebo_ros's launch files name."""


def read_world(name: str) -> World:
    path = PATHS.find_world(f"worlds/{name}")
    assert path is not None
    return parse_world(Path(path).read_bytes(), PATHS.resolve, file=path)


@pytest.mark.parametrize("name", MODELS)
def test_each_model_is_read_without_a_warning(name: str) -> None:
    text = f'<sdf version="1.6"><world name="w"><include><uri>model://{name}</uri></include></world></sdf>'
    world = parse_world(text, PATHS.resolve)
    assert world.warnings == ()
    assert [model.warnings for model in world.models] == [()] * len(world.models)
    assert [model.name for model in world.models] + [light.name for light in world.lights] == [name]
    assert all(path.stat().st_size < MAX_BYTES for path in (HERE / "models" / name).iterdir())


@pytest.mark.parametrize("name", WORLDS)
def test_each_world_is_read_without_a_warning(name: str) -> None:
    world = read_world(name)
    assert world.warnings == ()
    assert all(model.warnings == () for model in world.models)
    assert {"ground_plane"} <= {model.name for model in world.models}
    assert [light.name for light in world.lights] == ["sun"]
    assert (HERE / "worlds" / name).stat().st_size < MAX_BYTES


def test_the_worlds_of_the_launch_files_exist() -> None:
    assert {f"{name}.world" for name in BY_NAME} <= set(WORLDS)


def test_a_model_stands_on_the_ground() -> None:
    path = HERE / "models" / "unit_box"
    model = parse_model((path / "model.sdf").read_bytes(), PATHS.resolve)
    box = model.links["link"].collisions[0]
    assert box.geometry == Box((1.0, 1.0, 1.0))
    assert box.pose.position == (0.0, 0.0, 0.5)
    assert model.links["link"].inertial.pose.position == (0.0, 0.0, 0.5)


@pytest.mark.parametrize(
    ("world", "x", "y"),
    [
        ("house", 0.0, 0.0),
        ("house", -3.0, 1.0),
        ("turtlebot3_world", -2.0, -0.5),
        ("willowgarage", 0.0, 0.0),
        ("empty", 0.0, 0.0),
    ],
)
def test_a_robot_has_room_at_the_usual_start(world: str, x: float, y: float) -> None:
    assert distance_to_obstacles(read_world(f"{world}.world"), x, y) > 0.25


def distance_to_obstacles(world: World, x: float, y: float) -> float:
    """Return the distance of a point 0.1 m above the floor to the boxes and upright cylinders of static models."""
    nearest = math.inf
    for model in world.models:
        for link in model.links.values():
            for collision in link.collisions:
                pose = compose(compose(model.pose, link.pose), collision.pose)
                back = inverse(pose)
                px, py, pz = rotate(back.orientation, (x, y, 0.1))
                here = (px + back.position[0], py + back.position[1], pz + back.position[2])
                shape = collision.geometry
                if isinstance(shape, Box):
                    outside = (
                        max(abs(value) - side / 2, 0.0) for value, side in zip(here, shape.size, strict=True)
                    )
                    nearest = min(nearest, math.hypot(*outside))
                elif isinstance(shape, Cylinder):
                    above = max(abs(here[2]) - shape.length / 2, 0.0)
                    nearest = min(
                        nearest, math.hypot(max(math.hypot(here[0], here[1]) - shape.radius, 0.0), above)
                    )
    return nearest
