"""libgazebo_ros_imu.so and libgazebo_ros_imu_sensor.so: inertial sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from geometry_msgs.msg import Quaternion
from sensor_msgs.msg import Imu as ImuMsg
from std_srvs.srv import Empty, EmptyResponse

from minirospy.core.sdf.model import IDENTITY, Pose, Vector
from minirospy.core.sdf.poses import compose, inverse, pose_from_rpy, rotate_back
from minirospy.ros.gazebo_ros.messages import to_vector
from minirospy.ros.gazebo_ros.plugins import ModelPlugin, PluginBase, PluginError, SensorPlugin, Timer

if TYPE_CHECKING:
    from minirospy.ros.gazebo_ros.physics import SimLink

__all__ = ["Imu", "ImuSensor", "offset_of"]


class _Accelerometer:
    """Measures the motion of a point on a link. The acceleration is the change in velocity since the last measurement."""

    def __init__(self, link: SimLink, place: Pose) -> None:
        self._link = link
        self._place = place
        self._last: tuple[int, Vector] | None = None

    def measure(self, time_ns: int) -> tuple[Pose, Vector, Vector]:
        """Return the pose in the world, and the angular velocity and acceleration in the sensor's axes."""
        state = self._link.state
        pose = compose(state.pose, self._place)
        ax, ay, az = (a - b for a, b in zip(pose.position, state.pose.position, strict=True))
        wx, wy, wz = state.angular
        vx, vy, vz = state.linear
        velocity = (vx + wy * az - wz * ay, vy + wz * ax - wx * az, vz + wx * ay - wy * ax)
        acceleration: Vector = (0.0, 0.0, 0.0)
        if self._last is not None and time_ns > self._last[0]:
            seconds = (time_ns - self._last[0]) / 1e9
            x, y, z = ((new - old) / seconds for new, old in zip(velocity, self._last[1], strict=True))
            acceleration = (x, y, z)
        self._last = (time_ns, velocity)
        return pose, rotate_back(pose.orientation, state.angular), rotate_back(pose.orientation, acceleration)


def offset_of(plugin: PluginBase) -> Pose:
    """Return the pose given by xyzOffset and rpyOffset."""
    x, y, z = plugin.numbers("xyzOffset", (0.0, 0.0, 0.0))
    roll, pitch, yaw = plugin.numbers("rpyOffset", (0.0, 0.0, 0.0))
    return pose_from_rpy((x, y, z), (roll, pitch, yaw))


def _message(plugin: PluginBase, frame: str, noise: float, values: tuple[Pose, Vector, Vector]) -> ImuMsg:
    pose, angular, acceleration = values
    message = ImuMsg()
    message.header.stamp = plugin.now
    message.header.frame_id = frame
    if noise > 0:
        drawn = plugin.simulation.random.normal(0.0, noise, 10).tolist()
        pose = pose._replace(orientation=tuple(a + b for a, b in zip(pose.orientation, drawn, strict=False)))
        angular = tuple(a + b for a, b in zip(angular, drawn[4:], strict=False))
        acceleration = tuple(a + b for a, b in zip(acceleration, drawn[7:], strict=False))
    message.orientation = Quaternion(*pose.orientation)
    message.angular_velocity = to_vector(angular)
    message.linear_acceleration = to_vector(acceleration)
    diagonal = [noise * noise if index % 4 == 0 else 0.0 for index in range(9)]
    message.orientation_covariance = diagonal
    message.angular_velocity_covariance = diagonal
    message.linear_acceleration_covariance = diagonal
    return message


class Imu(ModelPlugin):
    """gazebo_ros_imu: reports accelerations without gravity.

    Parameters: bodyName (required), topicName, serviceName, frameName, updateRate, gaussianNoise, xyzOffset, rpyOffset.
    """

    def load(self) -> None:
        """Find the link."""
        body = self.text("bodyName")
        if not body:
            raise PluginError("imu plugin missing <bodyName>, cannot proceed")
        link, place = self.link(body)
        self._place = compose(place, offset_of(self))
        self._meter = _Accelerometer(link, self._place)
        self._link = link
        self._noise = self.number("gaussianNoise", 0.0)
        self._frame = self.frame("frameName", body)
        self._rate = self.number("updateRate", 0.0)
        self._publisher = self.publish_to(self.text("topicName", "/default_imu"), ImuMsg)
        self.serve(self.text("serviceName", "/default_imu"), Empty, lambda _: EmptyResponse())
        self.reset()

    def reset(self) -> None:
        """Begin the period again."""
        self._timer = Timer(self._rate)
        self._meter = _Accelerometer(self._link, self._place)

    def update(self) -> None:
        """Publish if the period has passed."""
        now_ns = self.simulation.time_ns
        if not self._timer.is_due(now_ns) or not self._publisher.get_num_connections():
            return
        self._publisher.publish(_message(self, self._frame, self._noise, self._meter.measure(now_ns)))


class ImuSensor(SensorPlugin):
    """gazebo_ros_imu_sensor: reports accelerations like a real accelerometer, +9.8 upwards at rest.

    Parameters: frameName (required), topicName, updateRateHZ, gaussianNoise, rpyOffset, initialOrientationAsReference.
    """

    def load(self) -> None:
        """Read the parameters."""
        self.default_namespace = self.model.name
        self._frame = self.frame("frameName", "")
        if not self._frame:
            raise PluginError("missing <frameName>, cannot proceed")
        self._noise = self.number("gaussianNoise", 0.0)
        self._offset = offset_of(self)._replace(position=(0.0, 0.0, 0.0))
        self._meter = _Accelerometer(self.sensor_link, self.sensor.pose)
        self._reference = IDENTITY
        if self.flag("initialOrientationAsReference", False):
            self._reference = Pose((0.0, 0.0, 0.0), inverse(self.sensor_pose).orientation)
        self._publisher = self.publish_to(self.text("topicName", "imu_data"), ImuMsg)
        self.rate = self.number("updateRateHZ", 1.0)

    def reset(self) -> None:
        """Restart the period."""
        super().reset()
        self._meter = _Accelerometer(self.sensor_link, self.sensor.pose)

    def is_needed(self) -> bool:
        """Return whether there is a subscriber."""
        return self._publisher.get_num_connections() > 0

    def sense(self) -> None:
        """Publish a measurement."""
        pose, angular, acceleration = self._meter.measure(self.simulation.time_ns)
        gx, gy, gz = rotate_back(pose.orientation, self.simulation.physics.gravity)
        ax, ay, az = acceleration
        turned = compose(self._reference, pose._replace(position=(0.0, 0.0, 0.0)))
        shown = compose(self._offset, turned)
        values = (shown, angular, (ax - gx, ay - gy, az - gz))
        self._publisher.publish(_message(self, self._frame, self._noise, values))
