"""moveit_msgs, which is not here: the import raises ImportError with what to do."""

from minirospy.compat.elsewhere import moveit_msgs as moveit_msgs
