"""gazebo_ros.plugins: the base classes of minirospy's Python plugins. See docs/simulation.md."""

from __future__ import annotations

from minirospy.ros.gazebo_ros.plugins import ModelPlugin, PluginError, SensorPlugin, WorldPlugin

__all__ = ["ModelPlugin", "PluginError", "SensorPlugin", "WorldPlugin"]
