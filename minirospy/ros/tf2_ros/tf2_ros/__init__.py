"""The API of tf2_ros for nodes: buffers, listeners, broadcasters, buffer servers and clients, based on the public node API.

The path of a transform: broadcaster `sendTransform` -> topic /tf ==> listener `callback` -> core `insert_message` ->
`minirospy.core.tf2`, which computes the result of `lookup_transform`. `import tf2_ros` and `import tf2_py` re-export
these names.
"""

from typing import TYPE_CHECKING

from minirospy.base.ros1_imports import prefer_ros1

if TYPE_CHECKING:
    from actionlib_msgs.msg import GoalStatus
    from geometry_msgs.msg import TransformStamped
    from std_msgs.msg import Header
    from tf2_msgs.msg import LookupTransformAction, LookupTransformGoal, TFMessage
    from tf2_msgs.srv import FrameGraph, FrameGraphResponse

    from minirospy.base.errors import (
        ConnectivityException,
        ExtrapolationException,
        InvalidArgumentException,
        LookupException,
        TimeoutException,
        TransformException,
    )
    from minirospy.ros.tf2_ros.tf2_ros import (
        buffer,
        buffer_client,
        buffer_interface,
        static_transform_broadcaster,
        transform_broadcaster,
        transform_listener,
    )
    from minirospy.ros.tf2_ros.tf2_ros.broadcasters import StaticTransformBroadcaster, TransformBroadcaster
    from minirospy.ros.tf2_ros.tf2_ros.buffer import DEFAULT_CAN_TRANSFORM_POLLING_SCALE, Buffer
    from minirospy.ros.tf2_ros.tf2_ros.client import BufferClient
    from minirospy.ros.tf2_ros.tf2_ros.core import BufferCore
    from minirospy.ros.tf2_ros.tf2_ros.interface import (
        BufferInterface,
        ConvertRegistration,
        NotImplementedException,
        Stamped,
        TransformRegistration,
        TypeException,
        convert,
    )
    from minirospy.ros.tf2_ros.tf2_ros.listener import TransformListener
    from minirospy.ros.tf2_ros.tf2_ros.server import BufferServer

__all__ = [
    "DEFAULT_CAN_TRANSFORM_POLLING_SCALE",
    "Buffer",
    "BufferClient",
    "BufferCore",
    "BufferInterface",
    "BufferServer",
    "ConnectivityException",
    "ConvertRegistration",
    "ExtrapolationException",
    "FrameGraph",
    "FrameGraphResponse",
    "GoalStatus",
    "Header",
    "InvalidArgumentException",
    "LookupException",
    "LookupTransformAction",
    "LookupTransformGoal",
    "NotImplementedException",
    "Stamped",
    "StaticTransformBroadcaster",
    "TFMessage",
    "TimeoutException",
    "TransformBroadcaster",
    "TransformException",
    "TransformListener",
    "TransformRegistration",
    "TransformStamped",
    "TypeException",
    "buffer",
    "buffer_client",
    "buffer_interface",
    "convert",
    "static_transform_broadcaster",
    "transform_broadcaster",
    "transform_listener",
]

# The modules in this package import ROS 1 messages.
# Otherwise, if ROS 2 is sourced, Python would first find the ROS 2 message packages with the same names.
prefer_ros1()
