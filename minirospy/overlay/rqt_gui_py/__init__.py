"""rqt_gui_py, which is not here: the import raises ImportError with what to do."""

from minirospy.ros.elsewhere import rqt_gui_py as rqt_gui_py
