"""smach_ros: states that use topics, services and actions, and servers that show running containers.

Importing this package makes smach log through rospy and stop at rospy's shutdown, as in ROS. Source:
http://wiki.ros.org/smach.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from minirospy import client as rospy
from minirospy.ros.smach.smach.log import set_loggers
from minirospy.ros.smach.smach.util import set_shutdown_check

if TYPE_CHECKING:
    from minirospy.ros.smach_ros.smach_ros.action_server_wrapper import ActionServerWrapper
    from minirospy.ros.smach_ros.smach_ros.condition_state import ConditionState
    from minirospy.ros.smach_ros.smach_ros.introspection import IntrospectionClient, IntrospectionServer
    from minirospy.ros.smach_ros.smach_ros.monitor_state import MonitorState
    from minirospy.ros.smach_ros.smach_ros.service_state import ServiceState
    from minirospy.ros.smach_ros.smach_ros.simple_action_state import SimpleActionState
    from minirospy.ros.smach_ros.smach_ros.util import set_preempt_handler

__all__ = [
    "ActionServerWrapper",
    "ConditionState",
    "IntrospectionClient",
    "IntrospectionServer",
    "MonitorState",
    "ServiceState",
    "SimpleActionState",
    "set_preempt_handler",
]

set_loggers(rospy.loginfo, rospy.logwarn, rospy.logdebug, rospy.logerr)
set_shutdown_check(rospy.is_shutdown)
