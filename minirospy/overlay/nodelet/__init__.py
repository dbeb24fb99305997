"""nodelet, which is not here: the import raises ImportError with what to do."""

from minirospy.ros.elsewhere import nodelet as nodelet
