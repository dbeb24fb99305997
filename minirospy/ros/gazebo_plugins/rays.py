"""The rays of a ``<ray>`` sensor, and the base class of plugins that cast them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from minirospy import client as rospy
from minirospy.base.xml_text import XmlElement
from minirospy.core.sdf.model import Pose, Sensor
from minirospy.ros.gazebo_ros.parameters import PluginError, number_of, text_of
from minirospy.ros.gazebo_ros.physics import Simulation
from minirospy.ros.gazebo_ros.plugins import RayFan, SensorPlugin

__all__ = ["RayPlugin", "Rays", "read_rays"]

MAX_RAYS = 1_000_000  # maximum number of rays per sensor; more would exhaust the memory


@dataclass(frozen=True)
class Rays(RayFan):
    """A sensor's rays, row after row.

    min_angle, max_angle: of a row, in rad. count: of a row. noise_mean, noise_deviation: of distances, in m.
    """

    min_angle: float
    max_angle: float
    count: int
    noise_mean: float = 0.0
    noise_deviation: float = 0.0

    def cast(self, simulation: Simulation, pose: Pose) -> NDArray[np.float64]:
        """Return each ray's measured distance from a pose, or infinity if it hits nothing."""
        return simulation.cast_rays(pose, self.directions, self.max_range, min_range=self.min_range).distances

    def noisy(self, simulation: Simulation, ranges: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the distances with noise added, within the range limits. Infinite distances stay unchanged."""
        if self.noise_deviation <= 0 and self.noise_mean == 0:
            return ranges
        noise = simulation.random.normal(self.noise_mean, self.noise_deviation, len(ranges))
        return np.where(np.isfinite(ranges), np.clip(ranges + noise, self.min_range, self.max_range), ranges)


class RayPlugin(SensorPlugin):
    """Base class for plugins of ray sensors with one topic. Parameters: topicName, frameName."""

    def load_rays(self, topic: str, kind: type[rospy.Message]) -> None:
        """Read the sensor's rays and create the publisher, by default for ``topic``."""
        self.shown_rays = self.rays = read_rays(self.sensor)
        self.frame_id = self.frame("frameName", "/world")
        self.publisher = self.output_to(self.text("topicName", topic), kind)

    def nearest(self) -> float:
        """Return the shortest distance that any ray measures, at most the maximum range."""
        return float(min(np.min(self.rays.cast(self.simulation, self.sensor_pose)), self.rays.max_range))


def read_rays(sensor: Sensor) -> Rays:
    """Read ``<ray>`` or ``<lidar>``. Raise PluginError if a value is invalid."""
    ray = sensor.element.first("ray") or sensor.element.first("lidar")
    scan = _child(ray, "scan")
    horizontal, vertical = _child(scan, "horizontal"), _child(scan, "vertical")
    low, high, count = _angles(horizontal, 640)
    bottom, top, rows = _angles(vertical, 1)
    if count * rows > MAX_RAYS:
        raise PluginError(f"the sensor has {count} x {rows} rays: at most {MAX_RAYS} are possible")
    around = np.linspace(low, high, count) if count > 1 else np.array([(low + high) / 2])
    upwards = np.linspace(bottom, top, rows) if rows > 1 else np.array([(bottom + top) / 2])
    pitch, yaw = (grid.ravel() for grid in np.meshgrid(upwards, around, indexing="ij"))
    columns = (np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch))
    limits, noise = _child(ray, "range"), _child(ray, "noise")
    is_noisy = noise is not None and text_of(noise, "type") in ("gaussian", "gaussian_quantized")
    return Rays(
        np.stack(columns, axis=1),
        number_of(limits, "min", 0.0),
        number_of(limits, "max", 0.0),
        low,
        high,
        count,
        number_of(noise, "mean", 0.0) if is_noisy else 0.0,
        number_of(noise, "stddev", 0.0) if is_noisy else 0.0,
    )


def _angles(element: XmlElement | None, samples: int) -> tuple[float, float, int]:
    if element is None:
        return 0.0, 0.0, 1
    count = int(number_of(element, "samples", samples) * number_of(element, "resolution", 1.0))
    return number_of(element, "min_angle", 0.0), number_of(element, "max_angle", 0.0), max(1, count)


def _child(element: XmlElement | None, tag: str) -> XmlElement | None:
    return element.first(tag) if element is not None else None
