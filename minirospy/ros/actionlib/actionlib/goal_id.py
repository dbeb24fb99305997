"""Ids of goals: unique by the node's name, a number and the time."""

from __future__ import annotations

import itertools

from actionlib_msgs.msg import GoalID

from minirospy import client as rospy

__all__ = ["GoalIDGenerator"]


class GoalIDGenerator:
    """Makes ids that begin with ``name``, the node's where it is None."""

    _numbers = itertools.count(1)

    def __init__(self, name: str | None = None) -> None:
        self.name = name or rospy.get_name()

    def set_name(self, name: str) -> None:
        """Begin the ids with ``name`` from now on."""
        self.name = name

    def generate_ID(self) -> GoalID:
        """Return a GoalID that no other goal of this process has, stamped with the present. Raise ROSInitException."""
        now = rospy.Time.now()
        return GoalID(stamp=now, id=f"{self.name}-{next(self._numbers)}-{now.secs}.{now.nsecs}")
