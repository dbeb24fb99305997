"""smach.log, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.ros.smach.smach.log import logdebug, logerr, loginfo, logwarn, set_loggers

__all__ = [
    "logdebug",
    "logerr",
    "loginfo",
    "logwarn",
    "set_loggers",
]
