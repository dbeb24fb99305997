"""tf2_ros.buffer_interface, provided by minirospy: what buffers and buffer clients share. Source: http://wiki.ros.org/tf2_ros."""

from std_msgs.msg import Header as Header

from minirospy.frames.interface import BufferInterface as BufferInterface
from minirospy.frames.interface import ConvertRegistration as ConvertRegistration
from minirospy.frames.interface import NotImplementedException as NotImplementedException
from minirospy.frames.interface import Stamped as Stamped
from minirospy.frames.interface import TransformRegistration as TransformRegistration
from minirospy.frames.interface import TypeException as TypeException
from minirospy.frames.interface import convert as convert
