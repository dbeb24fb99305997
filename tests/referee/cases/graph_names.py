"""rosgraph's names, environment and network helpers."""

import os

import rosgraph
import rosgraph.names as names
import rosgraph.network
import rosgraph.rosenv
from referee import outcome, show

for value in ("", "/", "a", "/a/", "//a//b/", "~a", "/a/b"):
    show(
        repr(value),
        names.canonicalize_name(value),
        names.namespace(value),
        bool(names.is_global(value)),
        bool(names.is_private(value)),
        names.is_legal_name(value),
        names.is_legal_base_name(value),
    )
    outcome(f"make_global_ns {value!r}", lambda v=value: names.make_global_ns(v))
for value in ("a b", "1a", "a//b", "a-b", "~", "a/", "/~a"):
    show(repr(value), names.is_legal_name(value), names.is_legal_base_name(value))
for namespace, value in (
    ("/", "a"),
    ("/ns", "a"),
    ("/ns/", "a"),
    ("ns", "a"),
    ("/ns", "/a"),
    ("/ns", "~a"),
    ("~", "a"),
    ("", "a"),
):
    show("join", namespace, value, names.ns_join(namespace, value))
for value in ("", "a", "/a", "~a", "a/b/", "~"):
    show("resolve", repr(value), names.resolve_name(value, "/ns/node"), names.resolve_name(value, "/ns/"),
         names.resolve_name(value, "/ns/node", {"/ns/a": "/other"}))  # fmt: skip
    outcome(f"script_resolve_name {value!r}", lambda v=value: names.script_resolve_name("tool", v))
outcome("make_caller_id", lambda: names.make_caller_id("tool"))
outcome("make_caller_id global", lambda: names.make_caller_id("/tool"))
outcome("get_ros_namespace", names.get_ros_namespace)
outcome("get_ros_namespace env", lambda: names.get_ros_namespace({"ROS_NAMESPACE": "a/b"}))
outcome("get_ros_namespace argv", lambda: names.get_ros_namespace({}, ["x", "__ns:=/of/argv"]))
outcome("anonymous_name", lambda: names.anonymous_name("id").split("_")[0])

LINE = [
    "prog",
    "a",
    "a:=b",
    "/x:=y",
    "~p:=1",
    "_p:=1",
    "__name:=n",
    "--flag:=x",
    "-k",
    "1:=2",
    "a:=",
    "a b:=c",
    "http://h:=1",
]
show("myargv", rosgraph.myargv(["prog", "a", "a:=b", "_p:=1", "__name:=n", "/x:=y", "-k"]))
for word in LINE:
    show("is_legal_remap", word, bool(names.is_legal_remap(word)))
outcome(
    "load_mappings",
    lambda: sorted(names.load_mappings(["a:=b", "_p:=1", "__name:=n", "x", "--f:=1"]).items()),
)
outcome("load_mappings of two", lambda: names.load_mappings(["a:=b:=c"]))
show(
    names.isstring("a"),
    names.isstring(1),
    names.PRIV_NAME,
    names.SEP,
    names.GLOBALNS,
    names.REMAP,
    names.ANYTYPE,
)
show(names.ROS_NAMESPACE, names.MSG_EXT, names.SRV_EXT)

outcome(
    "master uri of the environment", lambda: rosgraph.get_master_uri({"ROS_MASTER_URI": "http://robot:1234"})
)
outcome("master uri of nothing", lambda: rosgraph.get_master_uri({}))
outcome("master uri of argv", lambda: rosgraph.get_master_uri({}, ["x", "__master:=http://h:1/"]))
show(
    rosgraph.rosenv.DEFAULT_MASTER_PORT,
    rosgraph.ROS_MASTER_URI,
    rosgraph.ROS_IP,
    rosgraph.ROS_HOSTNAME,
    rosgraph.ROS_NAMESPACE,
    rosgraph.ROS_IPV6,
)
show(rosgraph.rosenv.DEFAULT_MASTER_URI)

network = rosgraph.network
outcome("host", network.get_host_name)
outcome("local address", network.get_local_address)
outcome("override", network.get_address_override)
outcome("bind", network.get_bind_address)
outcome("bind to all", lambda: network.get_bind_address("10.1.1.1"))
outcome("bind to loopback", lambda: network.get_bind_address("127.0.0.1"))
outcome("uri", lambda: network.create_local_xmlrpc_uri(1234).replace("1234", "PORT"))
outcome("ipv6", network.use_ipv6)
outcome("is local", lambda: [network.is_local_address(host) for host in ("localhost", "127.0.0.1")])
outcome("local addresses", lambda: "127.0.0.1" in network.get_local_addresses())
for url in ("http://robot:123/", "http://robot", "robot:1", "", "rosrpc://robot:9"):
    outcome(f"parse {url!r}", lambda u=url: network.parse_http_host_and_port(u))
del os.environ["ROS_HOSTNAME"]
os.environ["ROS_IP"] = "127.0.0.1"
outcome("override by ip", network.get_address_override)
outcome("host by ip", network.get_host_name)
header = network.encode_ros_handshake_header({"topic": "/t", "type": "std_msgs/Bool"})
outcome("encoded", lambda: header)
outcome("decoded", lambda: sorted(network.decode_ros_handshake_header(header).items()))
try:
    network.decode_ros_handshake_header(b"\x09\x00\x00\x00a=b")
except network.ROSHandshakeException as error:
    show("too short", type(error).__name__)
