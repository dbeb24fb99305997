"""The base classes of plugins, and the lookup of a plugin's class by the library's name in SDF or URDF.

A package that contains a Python plugin exports it in its package.xml::

    <export><gazebo_ros library="libmy_plugin.so" python="my_package.plugins.MyPlugin"/></export>

and a model uses it as ``<plugin name="..." filename="libmy_plugin.so">``. All methods of a plugin run in the simulation's thread,
between two steps. Callbacks of its subscribers and services run in other threads, and use ``self.call``.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import Header

from minirospy import client as rospy
from minirospy.base.errors import ManifestError
from minirospy.base.times import Time
from minirospy.base.xml_text import XmlElement
from minirospy.core.sdf.model import IDENTITY, Plugin, Pose, Sensor
from minirospy.core.sdf.poses import compose
from minirospy.ros.gazebo_ros.messages import time_of
from minirospy.ros.gazebo_ros.parameters import PluginError, number_of, numbers_of, text_of
from minirospy.workspace.manifest import read_manifest
from minirospy.workspace.packages import Packages

if TYPE_CHECKING:
    from minirospy.ros.gazebo_ros.loop import SimulationLoop
    from minirospy.ros.gazebo_ros.physics import SimJoint, SimLink, SimModel

__all__ = [
    "LIBRARIES",
    "ModelPlugin",
    "PeriodicPlugin",
    "PluginBase",
    "PluginError",
    "PluginHost",
    "SensorPlugin",
    "WorldPlugin",
]

_T = TypeVar("_T")

_RATES = ("odometryRate", "updateRate", "updateRateHZ")

_PLUGINS = "minirospy.ros.gazebo_plugins"
LIBRARIES = {
    "gazebo_ros_control": "minirospy.ros.gazebo_ros_control.plugin:GazeboRosControl",
    "gazebo_ros_diff_drive": f"{_PLUGINS}.diff_drive:DiffDrive",
    "gazebo_ros_skid_steer_drive": f"{_PLUGINS}.skid_steer_drive:SkidSteerDrive",
    "gazebo_ros_planar_move": f"{_PLUGINS}.planar_move:PlanarMove",
    "gazebo_ros_joint_state_publisher": f"{_PLUGINS}.joint_state_publisher:JointStatePublisher",
    "gazebo_ros_laser": f"{_PLUGINS}.laser:Laser",
    "gazebo_ros_gpu_laser": f"{_PLUGINS}.laser:Laser",
    "gazebo_ros_imu": f"{_PLUGINS}.imu:Imu",
    "gazebo_ros_imu_sensor": f"{_PLUGINS}.imu:ImuSensor",
    "gazebo_ros_p3d": f"{_PLUGINS}.p3d:P3D",
    "gazebo_ros_range": f"{_PLUGINS}.range:Range",
    "gazebo_ros_bumper": f"{_PLUGINS}.bumper:Bumper",
    "gazebo_ros_ft_sensor": f"{_PLUGINS}.ft_sensor:ForceTorque",
    "gazebo_mimic_joint_plugin": f"{_PLUGINS}.mimic:MimicJoint",
    "roboticsgroup_gazebo_mimic_joint_plugin": f"{_PLUGINS}.mimic:MimicJoint",
    "roboticsgroup_upatras_gazebo_mimic_joint_plugin": f"{_PLUGINS}.mimic:MimicJoint",
    "gazebo_ros_camera": f"{_PLUGINS}.camera:Camera",
    "gazebo_ros_multicamera": f"{_PLUGINS}.camera:MultiCamera",
    "gazebo_ros_depth_camera": f"{_PLUGINS}.depth_camera:DepthCamera",
    "gazebo_ros_openni_kinect": f"{_PLUGINS}.depth_camera:OpenniKinect",
    "gazebo_ros_block_laser": f"{_PLUGINS}.block_laser:BlockLaser",
    "gazebo_ros_velodyne_laser": f"{_PLUGINS}.velodyne:Velodyne",
    "gazebo_ros_velodyne_gpu_laser": f"{_PLUGINS}.velodyne:Velodyne",
    "gazebo_ros_joint_pose_trajectory": f"{_PLUGINS}.joint_pose_trajectory:JointPoseTrajectory",
    "gazebo_ros_f3d": f"{_PLUGINS}.f3d:F3D",
    "gazebo_ros_vacuum_gripper": f"{_PLUGINS}.vacuum_gripper:VacuumGripper",
    "hector_gazebo_ros_imu": f"{_PLUGINS}.hector:HectorImu",
    "hector_gazebo_ros_gps": f"{_PLUGINS}.hector:HectorGps",
    "hector_gazebo_ros_sonar": f"{_PLUGINS}.hector:HectorSonar",
}
"""Maps a library, without ``lib`` and ``.so``, to a module and class."""


class PluginBase:
    """Base class of all plugins.

    loop: runs the simulation. element: the ``<plugin>`` with its parameters. name: the plugin's name. due_ns: the time of the
    simulation before which :meth:`update` has nothing to do.
    """

    due_ns = 0

    def __init__(self, loop: SimulationLoop, plugin: Plugin) -> None:
        self.loop = loop
        self.simulation = loop.simulation
        self.plugin = plugin
        self.element: XmlElement = plugin.element
        self.name = plugin.name
        self.default_namespace = ""
        self._closing: list[Callable[[], object]] = []

    def load(self) -> None:
        """Read the parameters; create publishers and subscribers. Raise PluginError on failure."""

    def update(self) -> None:
        """Do the plugin's work. Called before each step."""

    def reset(self) -> None:
        """Restore the state after ``load``. Called by reset_simulation after it sets the time to 0."""

    def close(self) -> None:
        """Close the plugin's publishers, subscribers and services."""
        for function in self._closing:
            function()
        self._closing.clear()

    @property
    def title(self) -> str:
        """Return the plugin's name and library, for log messages."""
        return _title(self.plugin, "the world")

    @property
    def namespace(self) -> str:
        """Return ``<robotNamespace>`` or the default as a global name; "" stands for the root namespace."""
        text = self.text("robotNamespace", self.default_namespace)
        return "" if text in ("", "/") else "/" + text.strip("/")

    @property
    def now(self) -> Time:
        """Return the simulation's time."""
        return time_of(self.simulation.time_ns)

    def header(self, frame_id: str) -> Header:
        """Return a message header with the simulation's time."""
        return Header(0, self.now, frame_id)

    def call(self, function: Callable[[], _T]) -> _T:
        """Run a function between two steps. Use this in subscriber and service callbacks."""
        return self.loop.call(function)

    def text(self, tag: str, default: str = "") -> str:
        """Return a parameter's text, or the default if it is missing or empty."""
        return text_of(self.element, tag, default)

    def required(self, tag: str, title: str) -> str:
        """Return a parameter's text. If it is missing or empty, raise PluginError with a message that starts with ``title``."""
        if not (text := self.text(tag)):
            raise PluginError(f"{title} missing <{tag}>, cannot proceed".lstrip())
        return text

    def number(self, tag: str, default: float) -> float:
        """Return a parameter's number. Raise PluginError if the text is not a number, or the number is outside the tag's range.

        As in Gazebo, a negative rate means each step; log a warning about it.
        """
        value = number_of(self.element, tag, default)
        if value < 0 and tag in _RATES:
            rospy.logwarn("%s: <%s> is '%s': each step is used", self.title, tag, self.text(tag))
            return 0.0
        return value

    def numbers(self, tag: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Return a parameter's numbers, as many as in the default. Raise PluginError like :meth:`number`."""
        return numbers_of(self.element, tag, (len(default),)) or default

    def flag(self, tag: str, default: bool) -> bool:
        """Return a parameter's boolean."""
        text = self.text(tag).lower()
        return text in ("true", "1") if text else default

    def frame(self, tag: str, default: str) -> str:
        """Return a parameter's frame name, without a leading slash."""
        return self.text(tag, default).lstrip("/")

    def noisy(self, values: Iterable[float], deviation: float) -> list[float]:
        """Return the values with independent Gaussian noise added."""
        exact = list(values)
        if deviation <= 0:
            return exact
        noise = self.simulation.random.normal(0.0, deviation, len(exact)).tolist()
        return [value + error for value, error in zip(exact, noise, strict=True)]

    def resolve(self, topic: str) -> str:
        """Return a topic's name resolved in the plugin's namespace."""
        return topic if topic.startswith("/") else f"{self.namespace}/{topic}"

    def publish_to(
        self, topic: str, kind: type[rospy.Message], *, latch: bool = False
    ) -> rospy.Publisher[Any]:
        """Return a publisher in the plugin's namespace."""
        publisher = rospy.Publisher(self.resolve(topic), kind, queue_size=1, latch=latch)
        self._closing.append(publisher.unregister)
        return publisher

    def subscribe_to(
        self, topic: str, kind: type[rospy.Message], callback: Callable[..., object]
    ) -> rospy.Subscriber[Any]:
        """Subscribe to a topic in the plugin's namespace."""
        subscriber = rospy.Subscriber(self.resolve(topic), kind, callback, queue_size=1)
        self._closing.append(subscriber.unregister)
        return subscriber

    def serve(self, name: str, kind: type, handler: Callable[..., object]) -> None:
        """Offer a service in the plugin's namespace. As in ROS, log an error if this node already offers that service."""
        try:
            service: rospy.Service[Any] = rospy.Service(self.resolve(name), kind, handler)
        except rospy.ServiceException:  # for example, the same robot was already spawned in this namespace
            rospy.logerr(
                "Tried to advertise a service that is already advertised in this node [%s]",
                self.resolve(name),
            )
            return
        self._closing.append(service.shutdown)


class WorldPlugin(PluginBase):
    """A plugin in ``<world>``."""


class ModelPlugin(PluginBase):
    """A plugin of a model."""

    def __init__(self, loop: SimulationLoop, plugin: Plugin, model: SimModel) -> None:
        super().__init__(loop, plugin)
        self.model = model

    @property
    def title(self) -> str:
        """Return the plugin's name, library and model, for log messages."""
        return _title(self.plugin, f"model '{self.model.name}'")

    def joint(self, name: str) -> SimJoint:
        """Return the joint ``name``. Raise PluginError if the model does not have it."""
        joint = self.model.joints.get(name)
        if joint is None:
            raise PluginError(f"model '{self.model.name}' has no joint '{name}'")
        return joint

    def link(self, name: str) -> tuple[SimLink, Pose]:
        """Return (link ``name``, identity pose) or, if it was merged into another link, (that link, the pose of ``name`` in it).

        Raise PluginError if the link does not exist.
        """
        name = name.removeprefix(f"{self.model.name}::")
        if name in self.model.links:
            return self.model.links[name], IDENTITY
        lumped = self.model.record.lumped.get(name)
        if lumped is not None and lumped[0] in self.model.links:
            return self.model.links[lumped[0]], lumped[1]
        raise PluginError(f"model '{self.model.name}' has no link '{name}'")


class Timer:
    """Reports when a period of simulated time has elapsed. With a rate of 0, each step is a period."""

    def __init__(self, rate: float) -> None:
        self._period = round(1e9 / rate) if rate > 0 else 0
        self.next_ns = 0

    def is_due(self, now_ns: int) -> bool:
        """Return whether the next period has started."""
        if now_ns < self.next_ns - self._period:  # the simulated time was reset
            self.next_ns = now_ns
        if now_ns < self.next_ns:
            return False
        self.next_ns = max(self.next_ns + self._period, now_ns - self._period + 1)
        return True


@dataclass(frozen=True)
class RayFan:
    """A sensor's rays: (n, 3) unit vectors in the sensor's frame, and the minimum and maximum range in m."""

    directions: NDArray[np.float64]
    min_range: float
    max_range: float


class PeriodicPlugin(ModelPlugin):
    """A model plugin. Calls :meth:`sense` ``rate`` times per simulated second, or before each step if ``rate`` is 0."""

    rate = 0.0

    def __init__(self, loop: SimulationLoop, plugin: Plugin, model: SimModel) -> None:
        super().__init__(loop, plugin, model)
        self._timer: Timer | None = None
        self._has_other_work = type(self).update is not PeriodicPlugin.update
        self._outputs: list[rospy.Publisher[Any]] = []

    def output_to(
        self, topic: str, kind: type[rospy.Message], *, latch: bool = False
    ) -> rospy.Publisher[Any]:
        """Return a publisher in the plugin's namespace. The plugin does not run while no output has a subscriber."""
        publisher = self.publish_to(topic, kind, latch=latch)
        self._outputs.append(publisher)
        return publisher

    def is_needed(self) -> bool:
        """Return whether any output has a subscriber. Return True without outputs, because another plugin may use the data."""
        return not self._outputs or any(each.get_num_connections() for each in self._outputs)

    def sense(self) -> None:
        """Measure and publish; subclasses override this method."""

    def update(self) -> None:
        """Call :meth:`sense` if it is due."""
        if self._timer is None:
            self._timer = Timer(self.rate)
        if self._timer.is_due(self.simulation.time_ns):
            if not self._has_other_work:
                self.due_ns = self._timer.next_ns
            if self.is_needed():
                self.sense()

    def reset(self) -> None:
        """Start a new update period."""
        self._timer = None
        self.due_ns = 0


class SensorPlugin(PeriodicPlugin):
    """A sensor plugin. It runs at the sensor's rate unless ``load`` sets ``self.rate``.

    If ``load`` sets ``self.shown_rays``, the simulation's window can show them.
    """

    def __init__(
        self, loop: SimulationLoop, plugin: Plugin, model: SimModel, sensor: Sensor, link: SimLink
    ) -> None:
        super().__init__(loop, plugin, model)
        self.sensor = sensor
        self.sensor_link = link
        self.rate = sensor.update_rate
        self.shown_rays: RayFan | None = None

    @property
    def sensor_pose(self) -> Pose:
        """Return the sensor's pose in the world."""
        return compose(self.sensor_link.pose, self.sensor.pose)


class PluginHost:
    """Loads and runs the plugins of a world and its models."""

    def __init__(self, loop: SimulationLoop) -> None:
        self._loop = loop
        self._plugins: dict[str, list[PluginBase]] = {}  # plugins by model name; "" is the world
        self._running: list[PluginBase] = []
        self._named: set[str] = set()  # missing libraries already logged
        self._exported: dict[str, tuple[str, Path]] | None = None

    def add_world(self, plugins: tuple[Plugin, ...]) -> None:
        """Load the world's plugins."""
        for plugin in plugins:
            if (kind := self._find(plugin, "the world")) is not None:
                self._load("", kind, WorldPlugin, plugin)

    def add_model(self, model: SimModel) -> None:
        """Load the plugins of a model and its sensors."""
        record = model.record
        for plugin in record.plugins:
            if (kind := self._find(plugin, f"model '{model.name}'")) is not None:
                self._load(model.name, kind, ModelPlugin, plugin, model)
        for name, link in record.links.items():
            for sensor in link.sensors:
                for plugin in sensor.plugins:
                    if (
                        kind := self._find(plugin, f"sensor '{sensor.name}' of model '{model.name}'")
                    ) is None:
                        continue
                    if issubclass(kind, SensorPlugin):
                        self._load(model.name, kind, SensorPlugin, plugin, model, sensor, model.links[name])
                    else:
                        self._load(model.name, kind, ModelPlugin, plugin, model)

    def remove_model(self, name: str) -> None:
        """Close a model's plugins."""
        for plugin in self._plugins.pop(name, ()):
            self._close(plugin)
        self._list()

    def update(self) -> None:
        """Run all plugins that are due before a step. Close a plugin that fails, and log its name."""
        now_ns = self._loop.simulation.time_ns
        for plugin in self._running:
            if now_ns < plugin.due_ns:
                continue
            try:
                plugin.update()
            except Exception as error:  # noqa: BLE001 - a plugin's code, which may be the user's
                self._fail(plugin, error)

    def reset(self) -> None:
        """Reset all plugins."""
        for plugin in self._running:
            plugin.due_ns = 0  # a user's plugin may override reset() without calling the base class
            try:
                plugin.reset()
            except Exception as error:  # noqa: BLE001 - a plugin's code, which may be the user's
                self._fail(plugin, error)

    def ray_sensors(self) -> list[SensorPlugin]:
        """Return the sensors with rays."""
        return [
            each for each in self._running if isinstance(each, SensorPlugin) and each.shown_rays is not None
        ]

    def close(self) -> None:
        """Close all plugins."""
        for name in list(self._plugins):
            self.remove_model(name)

    def _list(self) -> None:
        self._running = [plugin for plugins in self._plugins.values() for plugin in plugins]

    def _load(self, owner: str, kind: type[PluginBase], base: type, plugin: Plugin, *context: object) -> None:
        where = _title(plugin, f"model '{owner}'" if owner else "the world")
        if not issubclass(kind, base):
            rospy.logerr("%s is ignored: it must be a %s", where, base.__name__)
            return
        if issubclass(kind, SensorPlugin) and base is not SensorPlugin:
            rospy.logerr("%s is ignored: it must be in a <sensor>", where)
            return
        created: PluginBase | None = None
        try:
            created = kind(self._loop, plugin, *context)
            created.load()
        except PluginError as error:
            rospy.logerr("%s is ignored: %s", where, error)
        except Exception as error:  # noqa: BLE001 - a plugin's code, which may be the user's
            rospy.logerr("%s is ignored: %s: %s", where, type(error).__name__, error)
        else:
            self._plugins.setdefault(owner, []).append(created)
            self._list()
            return
        if created is not None:
            self._close(created)

    def _fail(self, plugin: PluginBase, error: Exception) -> None:
        rospy.logerr("%s failed and is closed: %s: %s", plugin.title, type(error).__name__, error)
        for plugins in self._plugins.values():
            if plugin in plugins:
                plugins.remove(plugin)
        self._close(plugin)
        self._list()

    @staticmethod
    def _close(plugin: PluginBase) -> None:
        try:
            plugin.close()
        except Exception as error:  # noqa: BLE001 - a plugin's code, which may be the user's
            rospy.logerr("%s failed at its end: %s", plugin.title, error)

    def _find(self, plugin: Plugin, owner: str) -> type[PluginBase] | None:
        """Return a plugin library's class. If it is missing, log that once and return None."""
        library = plugin.library
        try:
            if target := LIBRARIES.get(library):
                module, _, name = target.partition(":")
                found: type[PluginBase] = getattr(importlib.import_module(module), name)
                return found
            if self._exported is None:
                self._exported = _exported_plugins()
            if library in self._exported:
                return _load_python(*self._exported[library])
        except PluginError as error:
            if library not in self._named:
                rospy.logerr("lib%s.so of %s is ignored: %s", library, owner, error)
            self._named.add(library)
            return None
        except ImportError as error:
            if target and not (error.name or "").startswith("minirospy."):
                raise
        if library not in self._named:
            self._named.add(library)
            rospy.logwarn(
                "lib%s.so of %s is not part of minirospy's simulation: the topics and motions of plugin '%s' are missing",
                library,
                owner,
                plugin.name,
            )
        return None


def _title(plugin: Plugin, owner: str) -> str:
    return f"plugin '{plugin.name}' ({plugin.library}) of {owner}"


def _exported_plugins() -> dict[str, tuple[str, Path]]:
    found: dict[str, tuple[str, Path]] = {}
    for _, folder in sorted(Packages().folders().items()):
        manifest = folder / "package.xml"
        try:
            if b"gazebo_ros" not in manifest.read_bytes():
                continue
            for export in read_manifest(manifest).exports:
                library, python = (export.attributes.get(key, "") for key in ("library", "python"))
                if export.tag == "gazebo_ros" and library and python:
                    name = library.removesuffix(".so").removeprefix("lib")
                    found.setdefault(name, (python, folder))
        except (ManifestError, OSError) as error:
            rospy.logwarn("plugins of %s are ignored: %s", manifest, error)
    return found


def _load_python(python: str, folder: Path) -> type[PluginBase]:
    module, _, name = python.replace(":", ".").rpartition(".")
    for place in (folder / "src", folder):
        top = module.partition(".")[0]
        if ((place / top).is_dir() or (place / f"{top}.py").is_file()) and str(place) not in sys.path:
            sys.path.append(str(place))
    try:
        found: object = getattr(importlib.import_module(module), name)
    except Exception as error:  # the user's module may raise any exception
        raise PluginError(f"cannot import {python}: {type(error).__name__}: {error}") from error
    if not (isinstance(found, type) and issubclass(found, PluginBase)):
        raise PluginError(f"{python} is not a subclass of ModelPlugin, SensorPlugin or WorldPlugin")
    return found
