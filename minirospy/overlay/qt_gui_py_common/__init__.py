"""qt_gui_py_common, which is not here: the import raises ImportError with what to do."""

from minirospy.compat.elsewhere import qt_gui_py_common as qt_gui_py_common
