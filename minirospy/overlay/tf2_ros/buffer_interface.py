"""tf2_ros.buffer_interface, provided by minirospy: what buffers and buffer clients share. Source: http://wiki.ros.org/tf2_ros."""

from std_msgs.msg import Header as Header

from minirospy.ros.tf2_ros.tf2_ros.interface import BufferInterface as BufferInterface
from minirospy.ros.tf2_ros.tf2_ros.interface import ConvertRegistration as ConvertRegistration
from minirospy.ros.tf2_ros.tf2_ros.interface import NotImplementedException as NotImplementedException
from minirospy.ros.tf2_ros.tf2_ros.interface import Stamped as Stamped
from minirospy.ros.tf2_ros.tf2_ros.interface import TransformRegistration as TransformRegistration
from minirospy.ros.tf2_ros.tf2_ros.interface import TypeException as TypeException
from minirospy.ros.tf2_ros.tf2_ros.interface import convert as convert
