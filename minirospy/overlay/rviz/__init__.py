"""rviz, which is not here: the import raises ImportError with what to do."""

from minirospy.ros.elsewhere import rviz as rviz
