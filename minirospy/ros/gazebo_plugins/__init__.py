"""Plugins of simulated robots and sensors, under the names of Gazebo's plugins. Source: http://wiki.ros.org/gazebo_plugins."""
