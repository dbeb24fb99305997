"""smach.user_data, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.ros.smach.smach.user_data import Const, Remapper, UserData, get_const

__all__ = [
    "Const",
    "Remapper",
    "UserData",
    "get_const",
]
