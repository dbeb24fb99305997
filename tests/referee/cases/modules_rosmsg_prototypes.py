"""rosmsg's functions for prototypes and for its own command, in programs that call them."""

import re
import sys

import rosmsg
import rospkg
from geometry_msgs.msg import PoseArray, PoseStamped
from nav_msgs.msg import Odometry, Path
from referee import outcome, printed, show
from sensor_msgs.msg import CameraInfo, JointState
from std_msgs.msg import Header, UInt8MultiArray
from std_srvs.srv import SetBoolRequest
from visualization_msgs.msg import Marker

show("# messages as YAML")
only_header = lambda message: ["header"] if "header" in message.__slots__ else ["frame_id"]  # noqa: E731
for message in (
    Header(),
    JointState(position=[1] * 6),
    PoseArray(),
    PoseStamped(),
    Odometry(),
    Path(),
    CameraInfo(),
    Marker(),
    UInt8MultiArray(data=b"ab"),
    SetBoolRequest(),
):
    for style in (None, False, True, 0, 1):
        outcome(
            f"{message._type} {style}",
            lambda m=message, f=style: rosmsg.get_yaml_for_msg(m, flow_style_=f, fill_arrays_=True),
        )
    outcome("all", lambda m=message: rosmsg.get_yaml_for_msg(m, "  "))
outcome("header only", lambda: rosmsg.get_yaml_for_msg(PoseStamped(), field_filter=only_header))
outcome(
    "without", lambda: rosmsg.get_yaml_for_msg(Header(), field_filter=rosmsg.create_names_filter(["seq"]))
)
outcome("filter", lambda: rosmsg.create_names_filter(["seq", "stamp"])(Header()))
outcome("dictionary", lambda: rosmsg.get_yaml_for_msg({"a": Header(), "b": [1] * 9}, ">>"))

show("# default values")
for name in (
    "int8",
    "uint64[]",
    "char[3]",
    "byte",
    "float32",
    "bool",
    "string",
    "empty",
    "time",
    "duration",
    "Header",
    "Pose",
    "geometry_msgs/Pose[]",
    "nope/Nope",
):
    outcome(name, lambda n=name: rosmsg.get_array_type_instance(n))
    outcome(name, lambda n=name: rosmsg.get_array_type_instance(n, "geometry_msgs"))

show("# usage")
show(
    rosmsg.MAX_DEFAULT_NON_FLOW_ITEMS,
    rosmsg.RosMsgProtoException.__mro__[1:2],
    rosmsg.RosMsgProtoArgsException.__mro__[1:2],
)
outcome("messages", lambda: rosmsg.fullusage(".msg"))
outcome("services", lambda: rosmsg.fullusage(".srv"))


def call(label, function, *words):
    sys.argv = ["rosmsg", *words]

    def run():
        try:
            return function()
        except SystemExit as end:
            return f"exit {end.code}"
        except rosmsg.ROSMsgException as error:
            return f"raises {re.sub(r'/[^ ]*/', '', str(error))}"

    printed(label + " " + " ".join(words), run)


show("# commands")
rospack = rospkg.RosPack()
outcome("debug", lambda: rosmsg.rosmsg_debug(rospack, ".nope", "std_msgs/Bool"))
call("debug", lambda: rosmsg.rosmsg_debug(rospack, ".msg", "std_msgs/Header"))
for words in (
    ["std_msgs/Header"],
    ["Nope"],
    ["MultiArrayLayout"],
    ["std_msgs/Bool.msg"],
    ["a", "b"],
    ["a::b"],
    ["a.b"],
    ["-z"],
    ["--help"],
    ["-b", "/nope.bag", "Bool"],
):
    call("show", lambda: rosmsg.rosmsg_cmd_show(".msg", "message type"), "show", *words)
    call("info", lambda: rosmsg.rosmsg_cmd_show(".srv", "service type", "info"), "info", *words)
for words in (
    ["std_msgs/Header"],
    ["std_msgs/Nope"],
    ["nope/Nope"],
    ["Nope"],
    ["MultiArrayLayout"],
    ["a", "b"],
):
    call("md5", lambda: rosmsg.rosmsg_cmd_md5(".msg", "message type"), "md5", *words)
for words in (["std_srvs"], ["std_srvs", "-s"], ["a", "b"]):
    call("package", lambda: rosmsg.rosmsg_cmd_package(".srv", "service type"), "package", *words)
outcome("md5", lambda: rosmsg.rosmsg_md5(".msg", "nope/Nope"))
outcome("md5", lambda: rosmsg.rosmsg_md5(".srv", "std_msgs/Nope"))
outcome("text", lambda: rosmsg.get_msg_text("std_msgs/Nope/x"))
outcome("text", lambda: rosmsg.get_srv_text("std_msgs/Nope/x"))
outcome("list", lambda: rosmsg.rosmsg_cmd_list(".nope", "", ["list"]))
outcome("packages", lambda: rosmsg.rosmsg_cmd_packages(".nope", "", ["packages"]))
outcome("types", lambda: rosmsg.list_types("std_msgs", ".nope"))

show("# prototypes")
for words in (
    ["msg", "std_msgs/Header"],
    ["msg", "Header"],
    ["srv", "SetBool"],
    ["srv", "std_srvs/SetBool", "-H"],
    ["msg", "std_msgs/Header", "-f", "1"],
    ["msg", "std_msgs/Header", "-x", "seq,stamp", "-p", "  "],
    ["msg", "sensor_msgs/JointState", "-e", "-f", "0"],
    ["msg"],
    [],
    ["msg", "Nope"],
    ["msg", "nope/Nope"],
    ["srv", "nope/Nope"],
    ["nope", "std_msgs/Bool"],
    ["nope", "Bool"],
    ["msg", "a::b"],
    ["msg", "nope/Nope", "-s"],
    ["msg", "-s"],
    ["nope", "Bool", "-s"],
    ["msg", "std_msgs/Bool", "-z"],
):
    call("prototype", lambda w=words: rosmsg.rosmsg_cmd_prototype(w), *words)

# The prototypes have called init_rosmsg_proto().
for style in (None, 0, 1):
    outcome(f"in order {style}", lambda f=style: rosmsg.get_yaml_for_msg(PoseStamped(), flow_style_=f))
