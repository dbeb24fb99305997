"""Control of robots' joints: hardware, controllers and the mathematics of both, without ROS's topics, threads or sockets.

The shells are in `ros/controller_manager/` and in the packages of the controllers. Source: http://wiki.ros.org/ros_control.
"""
