"""qt_gui_py_common, which is not here: the import raises ImportError with what to do."""

from minirospy.ros.elsewhere import qt_gui_py_common as qt_gui_py_common
