"""rospy.service: its logger, and the names of rospy.core that ROS's has by a star import."""

from __future__ import annotations

import logging

from minirospy.compat.rospy.passing import passing_on

__all__ = ["logger"]

logger = logging.getLogger("rospy.service")
__getattr__, __dir__ = passing_on("rospy.service", "rospy.core")
