"""rostest.rostest_parent, which is not here: the import raises ImportError with what to use."""

from minirospy.compat.elsewhere import rostest_rostest_parent as rostest_parent
