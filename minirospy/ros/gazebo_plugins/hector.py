"""libhector_gazebo_ros_imu.so, libhector_gazebo_ros_gps.so and libhector_gazebo_ros_sonar.so: sensors with drift.

Not supported: dynamic reconfigure of the noise, set_accel_bias, set_rate_bias and set_reference_geopose.
"""

from __future__ import annotations

import math

import numpy as np
from geometry_msgs.msg import Vector3Stamped
from numpy.typing import NDArray
from sensor_msgs.msg import Imu, NavSatFix, NavSatStatus, Range
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from minirospy.core.sdf.model import Pose, Vector
from minirospy.core.sdf.poses import compose, pose_from_rpy, rotate, rotate_back
from minirospy.ros.gazebo_plugins.rays import RayPlugin, read_rays
from minirospy.ros.gazebo_ros.messages import to_pose, to_vector
from minirospy.ros.gazebo_ros.parameters import numbers_of
from minirospy.ros.gazebo_ros.physics import SimLink
from minirospy.ros.gazebo_ros.plugins import PeriodicPlugin, PluginBase

__all__ = ["ErrorModel", "HectorGps", "HectorImu", "HectorSonar"]

Values = NDArray[np.float64]

EQUATORIAL_RADIUS = 6378137.0  # m; WGS 84
FLATTENING = 1.0 / 298.257223563
DRIFT_FREQUENCY = 1.0 / 3600.0  # default drift frequency in Hz: one drift lasts an hour


class ErrorModel:
    """Offset, drift, noise and scale error of a one- or three-axis measurement.

    Parameters, with a prefix such as ``accel``: Offset, Drift, DriftFrequency, GaussianNoise, ScaleError.
    """

    def __init__(self, plugin: PluginBase, prefix: str, axes: int) -> None:
        self._random = plugin.simulation.random

        def read(name: str, default: float) -> Values:
            tag = f"{prefix}{name}" if prefix else name[0].lower() + name[1:]
            numbers = numbers_of(plugin.element, tag, (1, axes)) or (default,)
            values: Values = np.broadcast_to(np.array(numbers), axes).copy()
            return values

        self.offset, self.drift = read("Offset", 0.0), read("Drift", 0.0)
        self.frequency = read("DriftFrequency", DRIFT_FREQUENCY)
        self.noise, self.scale = read("GaussianNoise", 0.0), read("ScaleError", 1.0)
        self.reset()

    @property
    def bias(self) -> Values:
        """Return the sum of the offset and the current drift."""
        return self.current + self.offset

    def reset(self) -> None:
        """Draw a new random drift."""
        self.current: Values = self._normal(self.drift)

    def measured(self, value: Vector | Values, seconds: float) -> Values:
        """Return a measured value: advance the drift by ``seconds``, then add all errors."""
        change = seconds * self._normal(np.sqrt(2 * self.frequency) * self.drift)
        self.current = np.exp(-seconds * self.frequency) * self.current + change
        return np.asarray(value) * self.scale + self.bias + self._normal(self.noise)

    def _normal(self, deviation: Values) -> Values:
        return deviation * self._random.standard_normal(len(deviation)) if deviation.any() else 0 * deviation


class _HectorPlugin(PeriodicPlugin):
    """Base class of link plugins that publish at ``updateRate``."""

    default_rate = 0.0

    def load(self) -> None:
        """Find the link."""
        name = self.text("bodyName")
        self.body: SimLink = self.link(name)[0] if name else self.model.canonical_link
        self.rate = self.number("updateRate", self.default_rate)
        self._last_ns = self.simulation.time_ns

    def reset(self) -> None:
        """Start a new update period."""
        super().reset()
        self._last_ns = self.simulation.time_ns

    def sense(self) -> None:
        """Measure, once per update period."""
        now_ns = self.simulation.time_ns
        self.measure((now_ns - self._last_ns) / 1e9)
        self._last_ns = now_ns

    def measure(self, seconds: float) -> None:
        """Publish a measurement; ``seconds`` is the time since the last measurement."""


class HectorGps(_HectorPlugin):
    """A GPS. Parameters: topicName, velocityTopicName, frameId, status, reference{Latitude,Longitude,Heading,Altitude}.

    The error parameters of the position have no prefix, those of the velocity have the prefix ``velocity``.
    """

    default_rate = 4.0

    def load(self) -> None:
        """Compute the earth's radii at the reference position."""
        super().load()
        self._latitude = self.number("referenceLatitude", 49.9)
        self._longitude = self.number("referenceLongitude", 8.9)
        self._heading = math.radians(self.number("referenceHeading", 0.0))
        self._altitude = self.number("referenceAltitude", 0.0)
        self._frame = self.frame("frameId", "/world")
        self._status = NavSatStatus(
            status=int(self.number("status", NavSatStatus.STATUS_FIX)), service=int(self.number("service", 0))
        )
        squared = 2 * FLATTENING - FLATTENING**2  # the square of the eccentricity
        latitude = math.radians(self._latitude)
        share = 1 / (1 - squared * math.sin(latitude) ** 2)
        prime = EQUATORIAL_RADIUS * math.sqrt(share)
        self._radii = (prime * (1 - squared) * share, prime * math.cos(latitude))
        self._position, self._velocity = ErrorModel(self, "", 3), ErrorModel(self, "velocity", 3)
        self._fixes = self.publish_to(self.text("topicName", "fix"), NavSatFix)
        self._speeds = self.publish_to(self.text("velocityTopicName", "fix_velocity"), Vector3Stamped)

    def reset(self) -> None:
        """Draw new random drifts."""
        super().reset()
        self._position.reset()
        self._velocity.reset()

    def measure(self, seconds: float) -> None:
        """Publish position and velocity."""
        state = self.body.state
        vx, vy, vz = self._velocity.measured(state.linear, seconds).tolist()
        x, y, z = self._position.measured(state.pose.position, seconds).tolist()
        self._position.current = self._position.current + seconds * self._velocity.current
        cosine, sine = math.cos(self._heading), math.sin(self._heading)
        fix = NavSatFix(header=self.header(self._frame), status=self._status)
        fix.latitude = self._latitude + math.degrees((cosine * x + sine * y) / self._radii[0])
        fix.longitude = self._longitude - math.degrees((-sine * x + cosine * y) / self._radii[1])
        fix.altitude = self._altitude + z
        variances = self._position.drift**2 + self._position.noise**2
        fix.position_covariance = np.diag(variances).ravel().tolist()
        fix.position_covariance_type = NavSatFix.COVARIANCE_TYPE_DIAGONAL_KNOWN
        self._fixes.publish(fix)
        speed = Vector3Stamped(header=fix.header)
        speed.vector = to_vector((cosine * vx + sine * vy, -sine * vx + cosine * vy, vz))
        self._speeds.publish(speed)


class HectorImu(_HectorPlugin):
    """An IMU. Parameters: topicName, biasTopicName, serviceName, frameId, rpyOffset; errors with prefixes accel, rate, yaw."""

    def load(self) -> None:
        """Read the parameters, create the publishers and offer the service."""
        super().load()
        topic = self.text("topicName", "imu")
        self._frame = self.frame("frameId", self.text("bodyName", self.body.name))
        roll, pitch, yaw = self.numbers("rpyOffset", (0.0, 0.0, 0.0))
        self._offset = pose_from_rpy((0.0, 0.0, 0.0), (roll, pitch, yaw))
        self._accel, self._turn = ErrorModel(self, "accel", 3), ErrorModel(self, "rate", 3)
        self._yaw = ErrorModel(self, "yaw", 1)
        if (noise := self.number("gaussianNoise", 0.0)) > 0:
            self._accel.noise[:] = self._turn.noise[:] = noise
        self._velocity: Vector | None = None
        self._publisher = self.publish_to(topic, Imu)
        self._biases = self.publish_to(self.text("biasTopicName", f"{topic}/bias"), Imu)
        self.serve(self.text("serviceName", f"{topic}/calibrate"), Empty, self._calibrate)

    def reset(self) -> None:
        """Draw new random drifts."""
        super().reset()
        self._velocity = None
        for model in (self._accel, self._turn, self._yaw):
            model.reset()

    def measure(self, seconds: float) -> None:
        """Publish the orientation, angular velocity and acceleration (including gravity)."""
        state = self.body.state
        last, self._velocity = self._velocity, state.linear
        if last is None or seconds <= 0:
            return
        turned = compose(Pose((0.0, 0.0, 0.0), state.pose.orientation), self._offset)
        gravity = self.simulation.physics.gravity
        ax, ay, az = (
            (new - old) / seconds - g for new, old, g in zip(state.linear, last, gravity, strict=True)
        )
        acceleration = self._accel.measured(rotate_back(turned.orientation, (ax, ay, az)), seconds).tolist()
        rates = self._turn.measured(rotate_back(turned.orientation, state.angular), seconds).tolist()
        self._yaw.measured(np.zeros(1), seconds)

        # As in an attitude filter, the orientation's error comes from the accelerometer and the compass.
        strength = math.hypot(*gravity)
        bx, by, bz = self._accel.bias.tolist()
        dx, dy, _ = rotate(state.pose.orientation, (bx, by, bz))
        tilt = (0.5 * dy / strength, -0.5 * dx / strength) if strength else (0.0, 0.0)
        length = math.sqrt(1 + tilt[0] ** 2 + tilt[1] ** 2)
        tilted = Pose((0.0, 0.0, 0.0), (tilt[0] / length, tilt[1] / length, 0.0, 1 / length))
        error = compose(pose_from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, float(self._yaw.bias[0]))), tilted)

        message = Imu(header=self.header(self._frame))
        message.orientation = to_pose(compose(error, turned)).orientation
        message.angular_velocity = to_vector((rates[0], rates[1], rates[2]))
        message.linear_acceleration = to_vector((acceleration[0], acceleration[1], acceleration[2]))
        message.angular_velocity_covariance = np.diag(self._turn.noise**2).ravel().tolist()
        message.linear_acceleration_covariance = np.diag(self._accel.noise**2).ravel().tolist()
        level = (self._accel.noise[:2] / strength) ** 2 if strength else np.array([-1.0, -1.0])
        message.orientation_covariance = np.diag([*level, self._yaw.noise[0] ** 2]).ravel().tolist()
        self._publisher.publish(message)

        bias = Imu(header=message.header)
        bias.orientation = to_pose(error).orientation
        rx, ry, rz = self._turn.bias.tolist()
        bias.angular_velocity = to_vector((rx, ry, rz))
        bias.linear_acceleration = to_vector((bx, by, bz))
        self._biases.publish(bias)

    def _calibrate(self, _request: EmptyRequest) -> EmptyResponse:
        def clear() -> EmptyResponse:
            self._turn.current = np.zeros(3)
            return EmptyResponse()

        return self.call(clear)


class HectorSonar(RayPlugin):
    """A range sensor. Parameters: topicName, frameId, updateRate; error parameters without a prefix."""

    def load(self) -> None:
        """Read the sensor's ray configuration."""
        self.rays = read_rays(self.sensor)
        self._frame = self.frame("frameId", "/sonar_link")
        self._errors = ErrorModel(self, "", 1)
        self.rate = self.number("updateRate", 10.0)
        heights = np.arcsin(self.rays.directions[:, 2])
        self._view = min(abs(self.rays.max_angle - self.rays.min_angle), float(np.ptp(heights)))
        self._publisher = self.publish_to(self.text("topicName", "sonar"), Range)
        self._last_ns = self.simulation.time_ns

    def reset(self) -> None:
        """Draw a new random drift."""
        super().reset()
        self._errors.reset()
        self._last_ns = self.simulation.time_ns

    def sense(self) -> None:
        """Publish the shortest distance."""
        rays, now_ns = self.rays, self.simulation.time_ns
        shortest = self.nearest()
        if shortest < rays.max_range:
            measured = self._errors.measured(np.array([shortest]), (now_ns - self._last_ns) / 1e9)
            shortest = float(np.clip(measured[0], rays.min_range, rays.max_range))
        self._last_ns = now_ns
        header, limits = self.header(self._frame), (rays.min_range, rays.max_range)
        self._publisher.publish(Range(header, Range.ULTRASOUND, self._view, *limits, shortest))
