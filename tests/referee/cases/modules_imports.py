"""Modules that programs use without importing them: in ROS the package imports them."""

import genpy
import rosgraph
import roslib
import rosmsg
import rosnode
import rosparam
import rospkg
import rospy
import rosservice
import rostopic
import rosunit
from referee import outcome, show

outcome("folder", lambda: roslib.packages.get_pkg_dir("std_msgs").endswith("std_msgs"))
outcome("launcher", lambda: roslib.launcher.load_manifest("std_msgs"))
show(roslib.exceptions.ROSLibException.__name__)
show(rospkg.rospack.RosPack is rospkg.RosPack, rospkg.manifest.Manifest is rospkg.Manifest)
show(rospkg.common.ResourceNotFound is rospkg.ResourceNotFound, rospkg.environment.ROS_ROOT)
show(rosgraph.names.ns_join("/a", "b"), rosgraph.masterapi.Master is rosgraph.Master)
show(rosgraph.network.use_ipv6(), rosgraph.rosenv.ROS_IP, rosgraph.roslogging.RosStreamHandler.__name__)
show(
    rosgraph.xmlrpc.XmlRpcNode.__name__,
    genpy.message.Message is genpy.Message,
    genpy.rostime.Time is genpy.Time,
)
show(rosunit.pyunit.unitrun is rosunit.unitrun, callable(rosunit.core.create_xml_runner))
show(callable(rosunit.baretest.print_runner_summary), callable(rosunit.junitxml.read_all))
show([module.__name__ for module in (rosmsg, rosnode, rosparam, rospy, rosservice, rostopic)])
