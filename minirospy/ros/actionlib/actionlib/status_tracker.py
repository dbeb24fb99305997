"""The names of actionlib.status_tracker."""

from minirospy.ros.actionlib.actionlib import StatusTracker
from minirospy.ros.submodules import modules_on_first_use

__all__ = ["StatusTracker"]

__getattr__ = modules_on_first_use(
    "actionlib.status_tracker",
    "actionlib_msgs goal_id_generator=actionlib.goal_id_generator rospy",
)
