"""qt_gui, which is not here: the import raises ImportError with what to do."""

from minirospy.ros.elsewhere import qt_gui as qt_gui
