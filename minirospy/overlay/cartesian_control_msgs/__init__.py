"""cartesian_control_msgs, which is not here: the import raises ImportError with what to do."""

from minirospy.compat.elsewhere import cartesian_control_msgs as cartesian_control_msgs
