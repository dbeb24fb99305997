"""The functions on names with None, bytes and other types, which programs pass by mistake."""

import genmsg.msgs
import genpy.message
import rosgraph.names as names
import rosgraph.network as network
import roslib.names
import rospy.names
from referee import show

VALUES = (None, "", "a", "/a", "~a", "a b", "-a:=b", "~a:=b", 5, b"/a", ["a"], {"a": 1}, ())


def result(function, *arguments):
    """Return a call's result, or the type of its exception; a false value becomes False."""
    try:
        return repr(function(*arguments) or False)
    except ValueError as error:
        return f"{type(error).__name__} {error}"
    except Exception as error:  # noqa: BLE001 - whatever it is
        return type(error).__name__


for function in (
    names.isstring, names.is_global, names.is_private, names.is_legal_remap, names.is_legal_name, names.is_legal_base_name,
    names.namespace, names.canonicalize_name, names.make_global_ns, names.make_caller_id, rospy.names.is_global,
    rospy.names.is_private, rospy.names.namespace, rospy.names.canonicalize_name, rospy.names.make_global_ns,
    roslib.names.resource_name_base, roslib.names.resource_name_package, roslib.names.package_resource_name,
    roslib.names.is_legal_resource_name, roslib.names.is_legal_resource_base_name,
):  # fmt: skip
    show(function.__name__, *(result(function, value) for value in VALUES))
for function in (
    genmsg.msgs.is_valid_msg_field_name, genmsg.msgs.is_valid_msg_type, genmsg.msgs.is_builtin,
    genmsg.msgs.is_header_type, genmsg.msgs.bare_msg_type, genpy.message.isstring, genpy.message.is_simple,
):  # fmt: skip
    show(function.__name__, *(result(function, value) for value in VALUES[:10]))
for namespace in (None, "", "/", "/ns", "ns", "ns//", "~", 5):
    for value in (None, "", "a", "/a", "~a", 5, ["a"], {"a": 1}):
        show(
            repr(namespace),
            repr(value),
            result(names.ns_join, namespace, value),
            result(rospy.names.ns_join, namespace, value),
            result(names.resolve_name, value, namespace),
            result(names.script_resolve_name, namespace, value),
            result(roslib.names.resource_name, namespace, value),
        )
show(sorted(names.load_mappings(["a:=b", "~p:=1", "_q:=2", "__name:=n", "-x:=y", "/c:=d", "e"]).items()))
show(names.anonymous_name("a") == names.anonymous_name("a"))
for value in (None, b"", b"a", b"\0\0\0\0", b"\5\0\0\0", "abcd", (), []):
    show(repr(value), result(network.decode_ros_handshake_header, value))
