"""rospy.rosconsole: the command rosconsole."""

NAME = "rosconsole"

__all__ = ["NAME"]
