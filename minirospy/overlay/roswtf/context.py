"""roswtf.context, which is not here: the import raises ImportError with what to use."""

from minirospy.ros.elsewhere import roswtf_context as context
