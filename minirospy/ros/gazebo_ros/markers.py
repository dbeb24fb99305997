"""Publishes the world as rviz markers: /gazebo/world_markers, in the frame ``world``. The dashboard's window uses window.py.

All visuals of all models are published (latched) whenever a model is added or removed. While there are subscribers,
all are published again when a link moves.
"""

from __future__ import annotations

import functools
import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from geometry_msgs.msg import Point, Vector3
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from minirospy import client as rospy
from minirospy.core.meshes.errors import MeshError
from minirospy.core.sdf.model import (
    Box,
    Color,
    Cylinder,
    Heightmap,
    MeshShape,
    Plane,
    Polyline,
    Pose,
    Sphere,
    Visual,
)
from minirospy.core.sdf.poses import compose
from minirospy.ros.gazebo_ros.messages import time_of, to_pose
from minirospy.ros.gazebo_ros.triangles import read_triangles
from minirospy.workspace.packages import package_name

if TYPE_CHECKING:
    from minirospy.ros.gazebo_ros.physics import SimModel, Simulation

__all__ = ["WorldMarkers", "has_moved", "marker_of", "model_markers"]

TOPIC = "~world_markers"
RATE_HZ = 10.0  # Hz of simulated time, for publishing moving models
GREY: Color = (0.7, 0.7, 0.7, 1.0)
MAX_PLANE = 100.0  # size in m at which larger planes are drawn
PLANE_THICKNESS = 0.001  # m
MIN_CHANGE = 1e-5  # smallest visible change, in m or quaternion units; resting bodies tremble less


class WorldMarkers:
    """Publishes the world's shapes as markers. All methods run in the simulation's thread."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._publisher = rospy.Publisher(TOPIC, MarkerArray, queue_size=2, latch=True)
        self._published: NDArray[np.float64] = np.zeros((0, 7))  # all link poses when last published
        self._known: dict[
            SimModel, tuple[NDArray[np.float64], list[Marker]]
        ] = {}  # each model's link poses and markers
        self._next_ns = 0

    def publish_all(self) -> None:
        """Replace all published markers."""
        self._send([Marker(action=Marker.DELETEALL), *self._all()])

    def _all(self) -> list[Marker]:
        """Return the markers of all models. Reuse the existing markers of models that have not moved."""
        self._published = poses = self._simulation.body_poses()
        known, self._known = self._known, {}
        for model in self._simulation.models.values():
            here = poses[[link.id for link in model.links.values()]]
            before = known.get(model)
            if before is None or has_moved(before[0], here):
                before = here, model_markers(model)
            self._known[model] = before
        return [marker for _, markers in self._known.values() for marker in markers]

    def publish_moved(self) -> None:
        """If there are subscribers and a link has moved, publish all markers, at a low rate."""
        now = self._simulation.time_ns
        if 0 <= self._next_ns - now <= 1e9 / RATE_HZ or not self._publisher.get_num_connections():
            return
        self._next_ns = now + round(1e9 / RATE_HZ)
        if has_moved(self._published, self._simulation.body_poses()):
            # A latched topic keeps only its last message, so publish all markers in one message.
            self._send(self._all())

    def _send(self, markers: list[Marker]) -> None:
        stamp = time_of(self._simulation.time_ns)
        for marker in markers:
            marker.header.frame_id = "world"
            marker.header.stamp = stamp
        self._publisher.publish(MarkerArray(markers))


def has_moved(before: NDArray[np.float64], now: NDArray[np.float64]) -> bool:
    """Return whether any of the (n, 7) poses has visibly changed, or their number has changed."""
    return before.shape != now.shape or bool((abs(now - before) > MIN_CHANGE).any())


def model_markers(model: SimModel) -> list[Marker]:
    """Return the markers for a model's shapes at their current poses, in the frame ``world``."""
    found = []
    for link in model.links.values():
        pose = link.pose
        for index, visual in enumerate(link.record.visuals):
            marker = marker_of(visual, link.scoped_name, index, compose(pose, visual.pose))
            if marker is not None:
                marker.header.frame_id = "world"
                found.append(marker)
    return found


@functools.cache
def _uri(path: str) -> str:
    """Return a file's URI: package:// if the file is in a package, because the dashboard can read such URIs."""
    file = Path(os.path.abspath(path))  # relative if GAZEBO_MODEL_PATH contains relative folders
    for folder in file.parents:
        if name := package_name(folder):
            return f"package://{name}/{file.relative_to(folder).as_posix()}"
    return file.as_uri()


def marker_of(visual: Visual, namespace: str, number: int, pose: Pose) -> Marker | None:
    """Return a marker without a frame for a visual at a pose, or None if its shape cannot be shown.

    The marker's text is the URI of the picture, which rviz ignores.
    """
    marker = Marker(action=Marker.ADD, ns=namespace, id=number, pose=to_pose(pose))
    if visual.material.texture:
        marker.text = _uri(visual.material.texture)
    red, green, blue, opacity = visual.material.color or GREY
    marker.color = ColorRGBA(red, green, blue, opacity * (1 - visual.transparency))
    shape = visual.geometry
    if isinstance(shape, Box):
        marker.type, marker.scale = Marker.CUBE, Vector3(*shape.size)
    elif isinstance(shape, Sphere):
        marker.type, marker.scale = Marker.SPHERE, Vector3(*[2 * shape.radius] * 3)
    elif isinstance(shape, Cylinder):
        marker.type = Marker.CYLINDER
        marker.scale = Vector3(2 * shape.radius, 2 * shape.radius, shape.length)
    elif isinstance(shape, Plane):
        marker.type = Marker.CUBE
        width, height = (min(size, MAX_PLANE) for size in shape.size)
        marker.scale = Vector3(width, height, PLANE_THICKNESS)
    elif not isinstance(shape, MeshShape) or shape.submesh or not _uri(shape.path).startswith("package:"):
        return _add_triangles(marker, shape, is_colored=visual.material.color is not None)
    else:
        marker.type, marker.scale = Marker.MESH_RESOURCE, Vector3(*shape.scale)
        marker.mesh_resource = _uri(shape.path)
        if visual.material.color is None:
            marker.mesh_use_embedded_materials = True
            marker.color = ColorRGBA(0.0, 0.0, 0.0, 0.0)
    return marker


def _add_triangles(
    marker: Marker, shape: MeshShape | Polyline | Heightmap, *, is_colored: bool
) -> Marker | None:
    """Return the marker with a shape's triangles added. If they cannot be read, log the reason once and return None."""
    try:
        points, colors = _triangle_points(shape)
    except MeshError as error:
        _warn_once(str(error))
        return None
    marker.type, marker.scale = Marker.TRIANGLE_LIST, Vector3(1.0, 1.0, 1.0)
    marker.points = points
    if not is_colored:
        marker.colors = colors
    return marker


@functools.lru_cache(maxsize=1000)
def _warn_once(error: str) -> None:
    """Log why a shape is missing, unless that was already logged."""
    rospy.logwarn("a shape is missing in the window: %s", error)


@functools.lru_cache(maxsize=64)
def _triangle_points(shape: MeshShape | Polyline | Heightmap) -> tuple[list[Point], list[ColorRGBA]]:
    """Return the corners and colours of a shape's triangles. Cached, because they are needed at each change of the world."""
    found = read_triangles(shape)
    colors = [] if found.colors is None else [ColorRGBA(*color) for color in found.colors.tolist()]
    return [Point(x, y, z) for x, y, z in found.corners.tolist()], colors
