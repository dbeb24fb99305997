"""Topics for the simulation's window, which is the dashboard's view Simulation, below /gazebo/window.

Gazebo's window receives the same data through Gazebo's own transport:

========== ================================ ================================================================================
shapes     visualization_msgs/MarkerArray   the visible shapes, latched; frames are ``world`` (models that are static) and
                                            ``model::link``; the text of a shape is the URI of its picture
poses      tf2_msgs/TFMessage               the poses of ``model::link`` in ``world``, latched, at most 30 times a second
state      diagnostic_msgs/DiagnosticStatus the world's name, ``running`` or ``paused``, time, real-time factor, rate, step,
                                            and the camera's pose (x y z, quaternion) if the world file has one
joints     sensor_msgs/JointState           all joints that can move, as ``model::joint``
contacts   visualization_msgs/MarkerArray   points and normals of contacts
rays       visualization_msgs/MarkerArray   the rays of laser scanners and range sensors
step       std_msgs/UInt32 (subscribed)     advances a paused simulation by so many steps
========== ================================ ================================================================================

The service ``list_models`` (std_srvs/Trigger) returns the names of the models that can be inserted, one per line. All rates are
in wall time. Nothing is computed without subscribers.
"""

from __future__ import annotations

import functools
import os
import threading
import time as wall
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Quaternion, Transform, TransformStamped, Vector3
from numpy.typing import NDArray
from sensor_msgs.msg import JointState
from std_msgs.msg import ColorRGBA, UInt32
from std_srvs.srv import Trigger, TriggerResponse
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from minirospy import client as rospy
from minirospy.base.clock import SignalSafeEvent
from minirospy.core.sdf.model import Pose, World
from minirospy.ros.gazebo_ros.loop import LoopClosed, SimulationLoop
from minirospy.ros.gazebo_ros.markers import has_moved, marker_of, model_markers
from minirospy.ros.gazebo_ros.messages import time_of
from minirospy.ros.gazebo_ros.physics import SimulationError
from minirospy.ros.gazebo_ros.plugins import PluginHost

if TYPE_CHECKING:
    from minirospy.ros.gazebo_ros.physics import SimModel

__all__ = ["Window", "model_names", "ray_lengths"]

PERIOD_SECONDS = 1 / 30  # seconds between pose messages
SLOW_SECONDS = 0.1  # seconds between messages with joints, contacts or rays
STATE_SECONDS = 0.2  # seconds between state messages
MAX_STEPS = 1_000_000  # per message
STEPS_AT_ONCE = 50  # steps between checks for other requests
MAX_CONTACTS = 2000  # maximum number of contacts to publish
MAX_RAYS = 360  # maximum number of rays to publish per sensor
ENDLESS_RAY = 100.0  # m; drawn length of a ray that hits nothing if the sensor's range is infinite
NORMAL_LENGTH = 0.12  # m
POINT_SIZE = 0.022  # m
RAY_WIDTH = 0.01  # m
CONTACT_COLOR = ColorRGBA(1.0, 0.25, 0.15, 1.0)
NORMAL_COLOR = ColorRGBA(1.0, 0.8, 0.1, 1.0)
RAY_COLOR = ColorRGBA(0.1, 0.45, 1.0, 0.45)


class Window:
    """Publishes the simulation for the dashboard in a separate thread, which gets its data between two steps."""

    def __init__(
        self, loop: SimulationLoop, plugins: PluginHost, world: World, model_folders: Iterable[str]
    ) -> None:
        self._loop = loop
        self._simulation = loop.simulation
        self._plugins = plugins
        self._world = world
        self._shapes = _publisher("shapes", MarkerArray, latch=True)
        self._poses = _publisher("poses", TFMessage, latch=True)
        self._state = _publisher("state", DiagnosticStatus, latch=True)
        self._joints = _publisher("joints", JointState)
        self._contacts = _publisher("contacts", MarkerArray)
        self._rays = _publisher("rays", MarkerArray)
        self._is_stale = True  # whether models were added, removed or, if static, moved since the last shapes
        self._known: dict[
            SimModel, list[Marker]
        ] = {}  # the markers in the last message that contained shapes
        self._moving: list[tuple[str, int]] = []  # the moving links' scoped names and pose rows
        self._generation = -1  # engine generation for which the pose rows are valid
        self._last: NDArray[np.float64] = np.zeros((0, 7))  # poses in the last message
        self._is_closed = SignalSafeEvent()
        folders = tuple(model_folders)
        rospy.Subscriber("~window/step", UInt32, self._on_step, queue_size=10)
        rospy.Service(
            "~window/list_models", Trigger, lambda _: TriggerResponse(True, "\n".join(model_names(folders)))
        )
        self._thread = threading.Thread(target=self._run, name="window", daemon=True)
        self._thread.start()

    def changed(self) -> None:
        """Ask the thread to publish the shapes again soon. Thread-safe."""
        self._is_stale = True

    def close(self) -> None:
        """End the thread."""
        self._is_closed.set()
        self._thread.join()

    def _run(self) -> None:
        next_slow = next_state = 0.0
        while not self._is_closed.wait(PERIOD_SECONDS):
            now = wall.monotonic()
            try:
                self._publish_shapes_and_poses()
                if now >= next_slow:
                    next_slow = now + SLOW_SECONDS
                    self._publish_slow()
            except LoopClosed:
                return
            except SimulationError as error:  # for example, because a ray's pose is NaN
                rospy.logerr_throttle(10, "the window: %s", error)
            if now >= next_state and _has_subscribers(self._state):
                next_state = now + STATE_SECONDS
                self._state.publish(self._read_state())

    def _publish_shapes_and_poses(self) -> None:
        if self._is_stale and _has_subscribers(self._shapes):
            # Clear the flag before reading the shapes, so that no later change is lost.
            self._is_stale = False
            self._shapes.publish(MarkerArray(self._loop.call(self._read_shapes)))
        if _has_subscribers(self._poses):
            poses = self._loop.call(self._read_poses)
            if poses is not None:
                self._poses.publish(_transforms(*poses))

    def _publish_slow(self) -> None:
        sources: tuple[tuple[rospy.Publisher[Any], Callable[[], object]], ...] = (
            (self._joints, self._read_joints),
            (self._contacts, self._read_contacts),
            (self._rays, self._read_rays),
        )
        for publisher, read in sources:
            if _has_subscribers(publisher):
                publisher.publish(self._loop.call(read))

    # ---- called in the simulation's thread

    def _read_shapes(self) -> list[Marker]:
        markers = [Marker(action=Marker.DELETEALL)]
        markers[0].header.frame_id = "world"
        known, self._known = self._known, {}
        for model in self._simulation.models.values():
            # Create a static model's markers again, because the model may have been moved.
            shapes = known[model] if model in known and not model.is_static else _shapes(model)
            self._known[model] = shapes
            markers += shapes
        return markers

    def _read_poses(self) -> tuple[list[str], NDArray[np.float64], int] | None:
        """Return the links' names, poses and time, or None if no link has moved."""
        simulation = self._simulation
        if self._generation != simulation.engine.generation:
            self._generation = simulation.engine.generation
            self._moving = [
                (link.scoped_name, link.id)
                for model in simulation.models.values()
                if not model.is_static
                for link in model.links.values()
            ]
            self._last = np.zeros((0, 7))
            if not self._moving:
                return [], self._last, simulation.time_ns
        poses = simulation.body_poses()[[row for _, row in self._moving]]
        if not has_moved(self._last, poses):
            return None
        self._last = poses
        return [name for name, _ in self._moving], poses, simulation.time_ns

    def _read_state(self) -> DiagnosticStatus:
        loop, physics = self._loop, self._simulation.physics
        values = {
            "time": self._simulation.time,
            "real_time_factor": 0.0 if loop.is_paused else loop.real_time_factor,
            "max_update_rate": loop.update_rate,
            "time_step": physics.step,
        }
        return DiagnosticStatus(
            level=DiagnosticStatus.OK,
            name=self._world.name,
            message="paused" if loop.is_paused else "running",
            values=[KeyValue(key, repr(value)) for key, value in values.items()]
            + _camera(self._world.camera),
        )

    def _read_joints(self) -> JointState:
        message = JointState()
        message.header.stamp = time_of(self._simulation.time_ns)
        for model in self._simulation.models.values():
            for joint in model.joints.values():
                if joint.has_axis:
                    message.name.append(f"{model.name}::{joint.name}")
                    message.position.append(joint.position)
                    message.velocity.append(joint.velocity)
                    message.effort.append(joint.effort)
        return message

    def _read_contacts(self) -> MarkerArray:
        positions, normals = self._simulation.contact_points()
        starts, ends = (
            positions[:MAX_CONTACTS],
            positions[:MAX_CONTACTS] + NORMAL_LENGTH * normals[:MAX_CONTACTS],
        )
        points = _new_marker("contacts", Marker.SPHERE_LIST, CONTACT_COLOR, POINT_SIZE)
        points.points = _points(starts)
        lines = _new_marker("normals", Marker.LINE_LIST, NORMAL_COLOR, POINT_SIZE / 4)
        lines.points = _points(np.stack((starts, ends), axis=1).reshape(-1, 3))
        return self._array([points, lines])

    def _read_rays(self) -> MarkerArray:
        markers = [Marker(action=Marker.DELETEALL)]
        markers[0].header.frame_id = "world"
        for plugin in self._plugins.ray_sensors():
            rays = plugin.shown_rays
            assert rays is not None
            directions = rays.directions[:: -(-len(rays.directions) // MAX_RAYS) or 1]
            pose = plugin.sensor_pose
            hits = self._simulation.cast_rays(pose, directions, rays.max_range, min_range=rays.min_range)
            ends = directions * ray_lengths(hits.distances, rays.max_range)[:, None]
            lines = _new_marker(
                f"{plugin.sensor_link.scoped_name}::{plugin.sensor.name}", Marker.LINE_LIST, RAY_COLOR
            )
            lines.scale.x = RAY_WIDTH
            (lines.pose.position.x, lines.pose.position.y, lines.pose.position.z) = pose.position
            lines.pose.orientation = Quaternion(*pose.orientation)
            starts = directions * rays.min_range
            lines.points = _points(np.stack((starts, ends), axis=1).reshape(-1, 3))
            markers.append(lines)
        return self._array(markers)

    def _array(self, markers: list[Marker]) -> MarkerArray:
        stamp = time_of(self._simulation.time_ns)
        for marker in markers:
            marker.header.stamp = stamp
        return MarkerArray(markers)

    # ---- requests

    def _on_step(self, message: UInt32) -> None:
        """Advance a paused simulation. Handle other requests between steps, and stop if it is unpaused."""
        remaining = min(message.data, MAX_STEPS)
        try:
            while remaining > 0 and self._loop.is_paused and not self._is_closed.is_set():
                count = min(remaining, STEPS_AT_ONCE)
                self._loop.call(functools.partial(self._loop.step, count))
                remaining -= count
        except LoopClosed:
            pass


def ray_lengths(distances: NDArray[np.float64], max_range: float) -> NDArray[np.float64]:
    """Return the lengths at which to draw rays. A ray that hits nothing ends at the maximum range, if that is finite."""
    end = max_range if np.isfinite(max_range) else ENDLESS_RAY
    return np.where(np.isfinite(distances), distances, end).clip(max=max_range)


def model_names(folders: Iterable[str]) -> list[str]:
    """Return the names of the models in these folders. A model is a subfolder with a model.config or model.sdf."""
    found = set()
    for folder in folders:
        try:
            found |= {each.name for each in Path(folder).iterdir() if _is_model(each)}
        except OSError:  # a folder in the search path may be missing
            continue
    return sorted(found)


def _is_model(folder: Path) -> bool:
    # Path.is_file raises PermissionError for files in unreadable folders.
    return any(os.path.isfile(folder / name) for name in ("model.config", "model.sdf"))


def _camera(pose: Pose | None) -> list[KeyValue]:
    if pose is None:
        return []
    return [KeyValue("camera", " ".join(f"{value:.6g}" for value in (*pose.position, *pose.orientation)))]


def _publisher(name: str, kind: type[rospy.Message], *, latch: bool = False) -> rospy.Publisher[Any]:
    return rospy.Publisher(f"~window/{name}", kind, queue_size=1, latch=latch)


def _has_subscribers(publisher: rospy.Publisher[Any]) -> bool:
    return publisher.get_num_connections() > 0


def _shapes(model: SimModel) -> list[Marker]:
    """Return markers for a model's shapes: a static model's in the world frame, otherwise in each link's frame."""
    if model.is_static:
        return model_markers(model)
    found = []
    for link in model.links.values():
        for index, visual in enumerate(link.record.visuals):
            marker = marker_of(visual, link.scoped_name, index, visual.pose)
            if marker is not None:
                marker.header.frame_id = link.scoped_name
                marker.frame_locked = True
                found.append(marker)
    return found


def _transforms(names: list[str], poses: NDArray[np.float64], time_ns: int) -> TFMessage:
    message = TFMessage()
    stamp = time_of(time_ns)
    for name, (x, y, z, qx, qy, qz, qw) in zip(names, poses.tolist(), strict=True):
        transform = TransformStamped(
            child_frame_id=name, transform=Transform(Vector3(x, y, z), Quaternion(qx, qy, qz, qw))
        )
        transform.header.stamp = stamp
        transform.header.frame_id = "world"
        message.transforms.append(transform)
    return message


def _new_marker(namespace: str, kind: int, color: ColorRGBA, size: float = 1.0) -> Marker:
    marker = Marker(action=Marker.ADD, type=kind, ns=namespace, color=color, scale=Vector3(size, size, size))
    marker.header.frame_id = "world"
    marker.pose.orientation.w = 1.0
    return marker


def _points(rows: NDArray[np.float64]) -> list[Point]:
    return [Point(x, y, z) for x, y, z in rows.tolist()]
