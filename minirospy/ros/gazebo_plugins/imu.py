"""libgazebo_ros_imu.so and libgazebo_ros_imu_sensor.so: inertial sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from geometry_msgs.msg import Quaternion, Vector3
from sensor_msgs.msg import Imu as ImuMsg
from std_srvs.srv import Empty, EmptyResponse

from minirospy.core.sdf.model import IDENTITY, Pose, Vector
from minirospy.core.sdf.poses import add, compose, cross, difference, inverse, pose_from_rpy, rotate_back
from minirospy.ros.gazebo_ros.plugins import PeriodicPlugin, PluginBase, SensorPlugin

if TYPE_CHECKING:
    from minirospy.ros.gazebo_ros.physics import SimLink

__all__ = ["Imu", "ImuSensor", "offset_of"]


class _Accelerometer:
    """Measures the motion of a point on a link. The acceleration is the velocity change since the last measurement."""

    def __init__(self, link: SimLink, place: Pose) -> None:
        self._link = link
        self._place = place
        self._last: tuple[int, Vector] | None = None

    def measure(self, time_ns: int) -> tuple[Pose, Vector, Vector]:
        """Return the pose in the world frame, and the angular velocity and acceleration in the sensor's frame."""
        state = self._link.state
        pose = compose(state.pose, self._place)
        arm = difference(pose.position, state.pose.position)
        velocity = add(state.linear, cross(state.angular, arm))
        acceleration: Vector = (0.0, 0.0, 0.0)
        if self._last is not None and time_ns > self._last[0]:
            seconds = (time_ns - self._last[0]) / 1e9
            x, y, z = difference(velocity, self._last[1])
            acceleration = (x / seconds, y / seconds, z / seconds)
        self._last = (time_ns, velocity)
        return pose, rotate_back(pose.orientation, state.angular), rotate_back(pose.orientation, acceleration)


def offset_of(plugin: PluginBase) -> Pose:
    """Return the pose given by xyzOffset and rpyOffset."""
    x, y, z = plugin.numbers("xyzOffset", (0.0, 0.0, 0.0))
    roll, pitch, yaw = plugin.numbers("rpyOffset", (0.0, 0.0, 0.0))
    return pose_from_rpy((x, y, z), (roll, pitch, yaw))


def _message(plugin: PluginBase, frame: str, noise: float, values: tuple[Pose, Vector, Vector]) -> ImuMsg:
    pose, angular, acceleration = values
    noisy = plugin.noisy((*pose.orientation, *angular, *acceleration), noise)
    diagonal = [noise * noise if index % 4 == 0 else 0.0 for index in range(9)]
    turn, rates, change = Quaternion(*noisy[:4]), Vector3(*noisy[4:7]), Vector3(*noisy[7:])
    return ImuMsg(plugin.header(frame), turn, diagonal, rates, diagonal, change, diagonal)


class Imu(PeriodicPlugin):
    """gazebo_ros_imu: reports acceleration without gravity.

    Parameters: bodyName (required), topicName, serviceName, frameName, updateRate, gaussianNoise, xyzOffset, rpyOffset.
    """

    def load(self) -> None:
        """Find the link."""
        body = self.required("bodyName", "imu plugin")
        self._link, place = self.link(body)
        self._place = compose(place, offset_of(self))
        self._meter = _Accelerometer(self._link, self._place)
        self._noise = self.number("gaussianNoise", 0.0)
        self._frame = self.frame("frameName", body)
        self.rate = self.number("updateRate", 0.0)
        self._publisher = self.output_to(self.text("topicName", "/default_imu"), ImuMsg)
        self.serve(self.text("serviceName", "/default_imu"), Empty, lambda _: EmptyResponse())

    def reset(self) -> None:
        """Start a new update period."""
        super().reset()
        self._meter = _Accelerometer(self._link, self._place)

    def sense(self) -> None:
        """Publish a measurement."""
        values = self._meter.measure(self.simulation.time_ns)
        self._publisher.publish(_message(self, self._frame, self._noise, values))


class ImuSensor(SensorPlugin):
    """gazebo_ros_imu_sensor: reports acceleration like a real accelerometer, with +9.8 upwards at rest.

    Parameters: frameName (required), topicName, updateRateHZ, gaussianNoise, rpyOffset, initialOrientationAsReference.
    """

    def load(self) -> None:
        """Read the parameters."""
        self.default_namespace = self.model.name
        self._frame = self.required("frameName", "").lstrip("/")
        self._noise = self.number("gaussianNoise", 0.0)
        self._offset = offset_of(self)._replace(position=(0.0, 0.0, 0.0))
        self._meter = _Accelerometer(self.sensor_link, self.sensor.pose)
        self._reference = IDENTITY
        if self.flag("initialOrientationAsReference", False):
            self._reference = Pose((0.0, 0.0, 0.0), inverse(self.sensor_pose).orientation)
        self._publisher = self.output_to(self.text("topicName", "imu_data"), ImuMsg)
        self.rate = self.number("updateRateHZ", 1.0)

    def reset(self) -> None:
        """Start a new update period."""
        super().reset()
        self._meter = _Accelerometer(self.sensor_link, self.sensor.pose)

    def sense(self) -> None:
        """Publish a measurement."""
        pose, angular, acceleration = self._meter.measure(self.simulation.time_ns)
        gravity = rotate_back(pose.orientation, self.simulation.physics.gravity)
        turned = compose(self._reference, pose._replace(position=(0.0, 0.0, 0.0)))
        shown = compose(self._offset, turned)
        values = (shown, angular, difference(acceleration, gravity))
        self._publisher.publish(_message(self, self._frame, self._noise, values))
