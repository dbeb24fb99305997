"""rqt_py_common, which is not here: the import raises ImportError with what to do."""

from minirospy.compat.elsewhere import rqt_py_common as rqt_py_common
