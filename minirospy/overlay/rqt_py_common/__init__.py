"""rqt_py_common, which is not here: the import raises ImportError with what to do."""

from minirospy.ros.elsewhere import rqt_py_common as rqt_py_common
