"""roslaunch.netapi, which is not here: the import raises ImportError with what to use."""

from minirospy.ros.elsewhere import roslaunch_netapi as netapi
