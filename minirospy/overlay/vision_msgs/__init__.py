"""vision_msgs, which is not here: the import raises ImportError with what to do."""

from minirospy.compat.elsewhere import vision_msgs as vision_msgs
