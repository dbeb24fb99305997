"""nodelet, which is not here: the import raises ImportError with what to do."""

from minirospy.compat.elsewhere import nodelet as nodelet
