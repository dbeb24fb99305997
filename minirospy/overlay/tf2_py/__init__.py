"""tf2_py, provided by minirospy: the buffer of transforms. Source: http://wiki.ros.org/tf2_py."""

from minirospy.base.errors import ConnectivityException as ConnectivityException
from minirospy.base.errors import ExtrapolationException as ExtrapolationException
from minirospy.base.errors import InvalidArgumentException as InvalidArgumentException
from minirospy.base.errors import LookupException as LookupException
from minirospy.base.errors import TimeoutException as TimeoutException
from minirospy.base.errors import TransformException as TransformException
from minirospy.ros.tf2_ros.tf2_ros.core import BufferCore as BufferCore
