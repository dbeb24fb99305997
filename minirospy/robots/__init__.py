"""Robots as nodes: their joints' states and the frames of their links, on the public node API.

Source: http://wiki.ros.org/robot_state_publisher, http://wiki.ros.org/joint_state_publisher.
"""
