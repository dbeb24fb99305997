"""smach_ros: states that use topics, services and actions, and introspection of running containers.

Importing it makes smach log through rospy and stop at rospy's shutdown, as in ROS. Source: http://wiki.ros.org/smach.
"""

from __future__ import annotations

from minirospy import client as rospy
from minirospy.ros.smach.smach.log import set_loggers
from minirospy.ros.smach.smach.util import set_shutdown_check

set_loggers(rospy.loginfo, rospy.logwarn, rospy.logdebug, rospy.logerr)
set_shutdown_check(rospy.is_shutdown)
