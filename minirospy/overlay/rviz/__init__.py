"""rviz, which is not here: the import raises ImportError with what to do."""

from minirospy.compat.elsewhere import rviz as rviz
