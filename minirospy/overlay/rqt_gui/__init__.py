"""rqt_gui, which is not here: the import raises ImportError with what to do."""

from minirospy.ros.elsewhere import rqt_gui as rqt_gui
