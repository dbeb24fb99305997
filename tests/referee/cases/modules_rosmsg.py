"""rosmsg, roslib.msgs and roslib.network in programs that inspect types."""

import os

import genmsg
import rosmsg
import rospkg
from referee import outcome, show
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float32MultiArray, Header, String

rospack = rospkg.RosPack()


def kind(label, call):
    """Print a call's result, or the type of its exception."""
    try:
        show(label, "gives", repr(call()))
    except Exception as error:  # noqa: BLE001 - whatever it is
        show(label, "raises", type(error).__name__)


show("# specs as text")
search_path = {
    name: [os.path.join(folder, "msg") for folder in rosmsg._get_package_paths(name, rospack)]
    for name in ("std_msgs", "geometry_msgs", "sensor_msgs")
}
context = genmsg.MsgContext.create_default()
for name in ("std_msgs/Header", "geometry_msgs/PoseStamped", "sensor_msgs/JoyFeedback"):
    spec = genmsg.load_msg_by_type(context, name, search_path)
    genmsg.load_depends(context, spec, search_path)
    outcome(name, lambda s=spec: rosmsg.spec_to_str(context, s))
    outcome(name, lambda s=spec: rosmsg.spec_to_str(context, s, indent="  "))
    show(rosmsg.spec_to_str(context, spec) == rosmsg.get_msg_text(name), rosmsg.rosmsg_md5(".msg", name))

show("# messages as YAML")
for message in (
    Header(),
    String("x"),
    JointState(name=["a"], position=[1.0]),
    Float32MultiArray(data=[1] * 6),
    Imu(),
):
    outcome(message._type, lambda m=message: rosmsg.get_yaml_for_msg(m))
    outcome(message._type, lambda m=message: rosmsg.get_yaml_for_msg(m, flow_style_=True))
    outcome(message._type, lambda m=message: rosmsg.get_yaml_for_msg(m, prefix="  "))
outcome("a list", lambda: rosmsg.get_yaml_for_msg([1, "x"]))

show("# what is not there")
kind("text", lambda: rosmsg.get_msg_text("std_msgs/Nope"))
kind("service text", lambda: rosmsg.get_srv_text("std_srvs/Nope"))
kind("list", lambda: rosmsg.list_msgs("nope"))
kind("list", lambda: rosmsg.list_srvs("nope"))
kind("list", lambda: rosmsg.list_types("std_msgs", ".nope"))
kind("packages", lambda: list(rosmsg.iterate_packages(rospack, ".nope")))
kind("search", lambda: list(rosmsg.rosmsg_search(rospack, ".msg", "Nope")))
outcome(
    "packages",
    lambda: [
        (n, os.path.basename(p)) for n, p in rosmsg.iterate_packages(rospack, ".srv") if n == "std_srvs"
    ],
)

show("# roslib")
import roslib.msgs
import roslib.network

for name in ("int32", "Header", "foo/Bar[3]", "string"):
    show(
        name, roslib.msgs.parse_type(name), roslib.msgs.base_msg_type(name), roslib.msgs.is_builtin(name),
        roslib.msgs.is_valid_constant_type(name), roslib.msgs.resolve_type(name, "pkg"),
    )  # fmt: skip
show(roslib.msgs.PRIMITIVE_TYPES, roslib.msgs.BUILTIN_TYPES, roslib.msgs.HEADER, roslib.msgs.EXT)
outcome("types", lambda: "Float64" in roslib.msgs.list_msg_types("std_msgs", False))
show(callable(roslib.network.get_host_name))
show(type(rospkg.__version__).__name__)
