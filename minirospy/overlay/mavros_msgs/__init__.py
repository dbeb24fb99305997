"""mavros_msgs, which is not here: the import raises ImportError with what to do."""

from minirospy.compat.elsewhere import mavros_msgs as mavros_msgs
