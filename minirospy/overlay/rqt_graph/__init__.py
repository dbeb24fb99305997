"""rqt_graph, which is not here: the import raises ImportError with what to do."""

from minirospy.ros.elsewhere import rqt_graph as rqt_graph
