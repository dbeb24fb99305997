"""Generates goal IDs, made unique by the node's name, a counter and the time."""

from __future__ import annotations

import itertools

from actionlib_msgs.msg import GoalID

from minirospy import client as rospy

__all__ = ["GoalIDGenerator"]


class GoalIDGenerator:
    """Generates IDs that start with ``name``, by default the node's name."""

    _numbers = itertools.count(1)

    def __init__(self, name: str | None = None) -> None:
        self.name = name or rospy.get_name()

    def set_name(self, name: str) -> None:
        """Set the prefix for later IDs."""
        self.name = name

    def generate_ID(self) -> GoalID:
        """Return a GoalID that is unique in this process, stamped with the current time.

        Raise ROSInitException if init_node has not been called.
        """
        now = rospy.Time.now()
        return GoalID(stamp=now, id=f"{self.name}-{next(self._numbers)}-{now.secs}.{now.nsecs}")
