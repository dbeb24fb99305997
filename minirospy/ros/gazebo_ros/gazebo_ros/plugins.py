"""gazebo_ros.plugins: the base classes of minirospy's plugins in Python. See docs/simulation.md."""

from __future__ import annotations

from minirospy.ros.gazebo_ros.plugins import ModelPlugin, PluginError, SensorPlugin, WorldPlugin

__all__ = ["ModelPlugin", "PluginError", "SensorPlugin", "WorldPlugin"]
