"""smach_ros, provided by minirospy: states that use ROS, and introspection. Source: http://wiki.ros.org/smach."""

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
