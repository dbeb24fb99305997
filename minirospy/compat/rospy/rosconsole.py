"""rospy.rosconsole, filled in by minirospy: the command rosconsole."""

NAME = "rosconsole"

__all__ = ["NAME"]
