"""tf2_ros, provided by minirospy: buffers, listeners and broadcasters of transforms. Source: http://wiki.ros.org/tf2_ros."""

from actionlib_msgs.msg import GoalStatus as GoalStatus
from geometry_msgs.msg import TransformStamped as TransformStamped
from std_msgs.msg import Header as Header
from tf2_msgs.msg import LookupTransformAction as LookupTransformAction
from tf2_msgs.msg import LookupTransformGoal as LookupTransformGoal
from tf2_msgs.msg import TFMessage as TFMessage
from tf2_msgs.srv import FrameGraph as FrameGraph
from tf2_msgs.srv import FrameGraphResponse as FrameGraphResponse

from minirospy.base.errors import ConnectivityException as ConnectivityException
from minirospy.base.errors import ExtrapolationException as ExtrapolationException
from minirospy.base.errors import InvalidArgumentException as InvalidArgumentException
from minirospy.base.errors import LookupException as LookupException
from minirospy.base.errors import TimeoutException as TimeoutException
from minirospy.base.errors import TransformException as TransformException
from minirospy.ros.tf2_ros.tf2_ros.broadcasters import (
    StaticTransformBroadcaster as StaticTransformBroadcaster,
)
from minirospy.ros.tf2_ros.tf2_ros.broadcasters import TransformBroadcaster as TransformBroadcaster
from minirospy.ros.tf2_ros.tf2_ros.buffer import (
    DEFAULT_CAN_TRANSFORM_POLLING_SCALE as DEFAULT_CAN_TRANSFORM_POLLING_SCALE,
)
from minirospy.ros.tf2_ros.tf2_ros.buffer import Buffer as Buffer
from minirospy.ros.tf2_ros.tf2_ros.client import BufferClient as BufferClient
from minirospy.ros.tf2_ros.tf2_ros.core import BufferCore as BufferCore
from minirospy.ros.tf2_ros.tf2_ros.interface import BufferInterface as BufferInterface
from minirospy.ros.tf2_ros.tf2_ros.interface import ConvertRegistration as ConvertRegistration
from minirospy.ros.tf2_ros.tf2_ros.interface import NotImplementedException as NotImplementedException
from minirospy.ros.tf2_ros.tf2_ros.interface import Stamped as Stamped
from minirospy.ros.tf2_ros.tf2_ros.interface import TransformRegistration as TransformRegistration
from minirospy.ros.tf2_ros.tf2_ros.interface import TypeException as TypeException
from minirospy.ros.tf2_ros.tf2_ros.interface import convert as convert
from minirospy.ros.tf2_ros.tf2_ros.listener import TransformListener as TransformListener
from minirospy.ros.tf2_ros.tf2_ros.server import BufferServer as BufferServer
from tf2_ros import buffer as buffer
from tf2_ros import buffer_client as buffer_client
from tf2_ros import buffer_interface as buffer_interface
from tf2_ros import static_transform_broadcaster as static_transform_broadcaster
from tf2_ros import transform_broadcaster as transform_broadcaster
from tf2_ros import transform_listener as transform_listener
