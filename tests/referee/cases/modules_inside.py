"""The modules that ROS's modules import: programs use them by the way of ROS's, and tests replace them there."""

import importlib

from referee import show

NAMES = """
rospy.client logging os random rosgraph roslib rospy socket struct sys time yaml
rospy.core atexit functools inspect logging os rosgraph rospkg rospy sys threading time traceback urlparse xmlrpcclient
rospy.names os rosgraph struct sys
rospy.rostime genpy rospy threading time
rospy.service rosgraph threading
rospy.topics genpy rosgraph select
rospy.timer genpy rospy threading time
rospy.msproxy rospy
rospy.msg genpy rospy struct
rospy.rosconsole os re rosgraph rospy
rospy.numpy_msg numpy
rospy.impl.registration logging socket threading xmlrpcclient
rospy.impl.masterslave rosgraph socket
rospy.impl.tcpros_base rosgraph select socket
rospy.impl.tcpros_service genpy rosgraph rospy socket
rosgraph sys xmlrpc roslogging
rosgraph.network os platform socket urlparse
rosgraph.names os re sys
rosgraph.xmlrpc rosgraph socket
rosgraph.impl.graph rosgraph random
rosbag.bag bz2 genmsg genpy os roslib rospy yaml
rosbag.rosbag_main optparse os roslib
rosbag.migration genpy rosbag rospkg
roslaunch logging os rospkg sys traceback roslaunch_param_dump
roslaunch.core rosgraph rospkg socket
roslaunch.config rosgraph roslaunch
roslaunch.pmon atexit os signal time
roslaunch.xmlloader loader substitution_args
roslaunch.rlutil rosclean rosgraph roslaunch
roslaunch.substitution_args math os rosgraph rospkg
actionlib.action_server rospy threading
actionlib.simple_action_client rospy threading
actionlib.goal_id_generator rospy
"""

for line in NAMES.strip().splitlines():
    module, *names = line.split()
    imported = importlib.import_module(module)
    show(module, *[getattr(imported, name).__name__ for name in names])
try:
    importlib.import_module("rospy.client").nothing  # noqa: B018
except AttributeError as error:
    show(error)
