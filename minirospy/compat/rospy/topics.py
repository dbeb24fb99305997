"""rospy.topics: the names of rospy.core that ROS's has by a star import."""

from __future__ import annotations

from minirospy.compat.rospy.passing import passing_on

__all__: list[str] = []

__getattr__, __dir__ = passing_on("rospy.topics", "rospy.core")
