"""rospy.core, and its names in rospy."""

import logging
import os

import rospy
import rospy.core
from referee import outcome, show

show(
    rospy.core.is_initialized(),
    rospy.core.is_shutdown(),
    rospy.core.is_shutdown_requested(),
    rospy.core.get_node_uri(),
)
for uri in ("rosrpc://h:5", "rosrpc://h:5/", "http://h:5", "rosrpc://h", "rosrpc://h:x", ""):
    outcome(f"parse_rosrpc_uri {uri}", lambda: rospy.parse_rosrpc_uri(uri))
os.environ.pop("ROS_ROOT", None)
outcome("root", lambda: rospy.get_ros_root())
outcome("root", lambda: rospy.get_ros_root(required=True, env={}))
outcome("root", lambda: rospy.get_ros_root(env={"ROS_ROOT": "/x"}))
outcome("root", lambda: rospy.core.get_ros_root(required=True, env={"ROS_ROOT": "/x"}))
show(rospy.core.MASTER_NAME, rospy.core.ROSRPC, rospy.core.GLOBALNS, rospy.core.REMAP)
show(rospy.DEBUG, rospy.INFO, rospy.WARN, rospy.ERROR, rospy.FATAL, rospy.Header.__name__)
outcome(
    "xmlrpcapi",
    lambda: rospy.core.xmlrpcapi("http://localhost:1") is rospy.core.xmlrpcapi("http://localhost:1"),
)
outcome("xmlrpcapi", lambda: rospy.core.xmlrpcapi("http://localhost:1/").getPid("/x"))
outcome("xmlrpcapi", lambda: rospy.core.xmlrpcapi(""))
outcome("xmlrpcapi", lambda: rospy.core.xmlrpcapi(None))
outcome("xmlrpcapi", lambda: rospy.core.xmlrpcapi(os.environ["ROS_MASTER_URI"]).getPid("/x")[0])
for kind in (rospy.ROSInterruptException, rospy.ROSTimeMovedBackwardsException):
    bases = KeyboardInterrupt, rospy.ROSException, rospy.exceptions.ROSInterruptException
    show(
        kind.__name__,
        [issubclass(kind, base) for base in bases],
        kind is getattr(rospy.exceptions, kind.__name__),
    )
show(issubclass(rospy.core.ParameterInvalid, Exception), issubclass(rospy.core.NullHandler, logging.Handler))
rospy.core.NullHandler().emit(None)
rospy.init_node("n", argv=[])
show(
    rospy.core.is_initialized(),
    rospy.core.is_shutdown(),
    rospy.core.is_shutdown_requested(),
    rospy.core.get_node_uri(),
)
for name in ("rospydebug", "rospyinfo", "rospywarn"):
    outcome(name, lambda: getattr(rospy.core, name)("a line for the %s", "log file"))
from rospy.core import (
    add_preshutdown_hook,
    is_shutdown,
    logdebug,
    logerr,
    logerror,
    loginfo,
    logwarn,
    signal_shutdown,
)

show(
    rospy.core.get_name(),
    rospy.core.get_caller_id(),
    rospy.core.get_namespace(),
    rospy.core.resolve_name("x"),
)
outcome("signal", lambda: signal_shutdown("done"))
show(is_shutdown())
