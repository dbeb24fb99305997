"""tf2_py, provided by minirospy: the buffer of transforms. Source: http://wiki.ros.org/tf2_py."""

from minirospy.errors import ConnectivityException as ConnectivityException
from minirospy.errors import ExtrapolationException as ExtrapolationException
from minirospy.errors import InvalidArgumentException as InvalidArgumentException
from minirospy.errors import LookupException as LookupException
from minirospy.errors import TimeoutException as TimeoutException
from minirospy.errors import TransformException as TransformException
from minirospy.frames.core import BufferCore as BufferCore
