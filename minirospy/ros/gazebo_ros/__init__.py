"""The simulation: a node that answers under the names of Gazebo's, on MuJoCo.

Source: http://wiki.ros.org/gazebo_ros.
"""
