"""Joint control: hardware, controllers and their mathematics, without topics, threads or sockets.

The code that connects it to ROS is in `ros/controller_manager/` and in the controllers' packages. Source:
http://wiki.ros.org/ros_control.
"""
