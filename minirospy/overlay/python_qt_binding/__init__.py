"""python_qt_binding, which is not here: the import raises ImportError with what to do."""

from minirospy.ros.elsewhere import python_qt_binding as python_qt_binding
