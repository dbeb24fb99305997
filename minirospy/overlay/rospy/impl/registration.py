"""rospy.impl.registration, provided by minirospy."""

from minirospy.ros.rospy.rospy.impl.registration import Registration, get_service_manager, get_topic_manager

__all__ = ["Registration", "get_service_manager", "get_topic_manager"]
