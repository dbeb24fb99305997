"""qt_dotgraph, which is not here: the import raises ImportError with what to do."""

from minirospy.ros.elsewhere import qt_dotgraph as qt_dotgraph
