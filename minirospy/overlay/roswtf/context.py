"""roswtf.context, which is not here: the import raises ImportError with what to use."""

from minirospy.compat.elsewhere import roswtf_context as context
