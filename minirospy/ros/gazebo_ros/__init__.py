"""The simulation: a node with the names of Gazebo's node, based on MuJoCo.

Source: http://wiki.ros.org/gazebo_ros.
"""
