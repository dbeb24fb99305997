"""rosmsg, roslib and genpy called from Python code."""

import genpy
import roslib
import roslib.message
import roslib.names
import roslib.packages
import rosmsg
import rospkg
from referee import outcome, show

rospack = rospkg.RosPack()
for name in ("std_msgs/Bool", "std_msgs/Header", "geometry_msgs/Pose"):
    outcome(f"text {name}", lambda n=name: rosmsg.get_msg_text(n))
outcome("service text", lambda: rosmsg.get_srv_text("std_srvs/SetBool"))
for name in ("std_msgs/Nope", "nope/Bool", "Bool"):
    for ask in (rosmsg.get_msg_text, rosmsg.get_srv_text):
        try:
            ask(name)
        except rosmsg.ROSMsgException as error:
            show(name, type(error).__name__)
outcome("list", lambda: rosmsg.list_srvs("std_srvs"))
outcome("list", lambda: "std_msgs/Bool" in rosmsg.list_msgs("std_msgs", rospack))
outcome("list types", lambda: rosmsg.list_types("std_srvs", mode=rosmsg.MODE_SRV))
outcome("list none", lambda: rosmsg.list_srvs("std_msgs"))
outcome("md5", lambda: rosmsg.rosmsg_md5(rosmsg.MODE_MSG, "std_msgs/Header"))
outcome("md5", lambda: rosmsg.rosmsg_md5(rosmsg.MODE_SRV, "std_srvs/SetBool"))
outcome("search", lambda: sorted(rosmsg.rosmsg_search(rospack, rosmsg.MODE_MSG, "Header")))
outcome(
    "packages", lambda: "std_srvs" in [name for name, _ in rosmsg.iterate_packages(rospack, rosmsg.MODE_SRV)]
)
show(rosmsg.MODE_MSG, rosmsg.MODE_SRV)

outcome("class", lambda: roslib.message.get_message_class("std_msgs/Bool").__name__)
outcome("class", lambda: roslib.message.get_message_class("std_msgs/Nope"))
outcome("class", lambda: roslib.message.get_message_class("Nope"))
outcome("class", lambda: roslib.message.get_service_class("std_srvs/SetBool").__name__)
outcome("class", lambda: roslib.message.get_service_class("std_srvs/Nope"))
outcome("folder", lambda: roslib.packages.get_pkg_dir("std_msgs").endswith("std_msgs"))
outcome("folder", lambda: roslib.packages.get_pkg_dir("nope_nope", required=False))
show(
    roslib.names.resource_name("a", "b"),
    roslib.names.package_resource_name("a/b"),
    roslib.names.is_legal_resource_name("a/b"),
)
show([c.__name__ for c in roslib.packages.InvalidROSPkgException.__mro__][:3])
show(roslib.is_interactive())

text = f"""float32 x
float32[] more
Header header
{"=" * 80}
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
"""
made = genpy.dynamic.generate_dynamic("my_pkg/Made", text)
show(sorted(made))
message = made["my_pkg/Made"](x=1.5)
show(message._type, message._slot_types, message)
values = {"x": 2.0, "more": [1.0], "header": "auto"}
keys = {"auto": made["std_msgs/Header"](frame_id="f")}
outcome("fill", lambda: genpy.message.fill_message_args(message, [values], keys=keys))
show(message)
outcome("arguments", lambda: genpy.message.get_printable_message_args(message))
