"""Less common parts of rosgraph: odd URIs, addresses, connection headers, the log handler."""

import logging
import os
import socket

import rosgraph
import rosgraph.names
import rosgraph.network
import rosgraph.roslogging
from referee import outcome, show
from rosgraph.roslogging import RosStreamHandler, _logging_to_rospy_names

network = rosgraph.network
show("# URIs")
for environment in ({}, {"ROS_MASTER_URI": "http://x:1"}, {"ROS_MASTER_URI": "nonsense"}):
    outcome(environment, lambda e=environment: rosgraph.get_master_uri(e, []))
outcome("remapped", lambda: rosgraph.get_master_uri({}, ["program", "__master:=http://y:2"]))
for uri in (
    "http://localhost:11311",
    "http://localhost",
    "localhost:11311",
    "",
    "rosrpc://h:1",
    "http://h:x",
):
    try:
        show(repr(uri), network.parse_http_host_and_port(uri))
    except ValueError:
        show(repr(uri), "is none")
show(
    network.get_host_name(),
    network.get_address_override(),
    network.use_ipv6(),
    network.create_local_xmlrpc_uri(5),
)
show(network.is_local_address("localhost"), network.is_local_address("no.such.invalid"))
show(network.is_local_address(socket.gethostname()), "127.0.0.1" in network.get_local_addresses())
master = rosgraph.Master("/tester")
show(master.handle.getParam("/tester", "/none")[0], master.handle.getPid("/tester")[:1], master.caller_id)
for uri in ("http://localhost:1", "nonsense", "http://no.such.invalid:11311"):
    outcome(f"online {uri}", lambda u=uri: rosgraph.is_master_online(master_uri=u))
os.environ["ROS_MASTER_URI"] = "nonsense"
outcome("bad environment", lambda: rosgraph.Master("/tester"))
outcome("bad environment", rosgraph.is_master_online)
os.environ["ROS_MASTER_URI"] = "http://localhost:1"
outcome("nobody there", rosgraph.is_master_online)
try:
    rosgraph.Master("/tester").getSystemState()
except OSError as error:
    show(type(error).__name__)

show("# names")
for name in ("a\n", "a/b", "a//b", "1a", "", "/", "~a", "a b"):
    show(repr(name), rosgraph.names.is_legal_name(name), rosgraph.names.is_legal_base_name(name))

show("# headers")
outcome("encode", lambda: network.encode_ros_handshake_header({"a": "b", "c": "d=e"}))
for odd in ({"c": b"d"}, {b"c": "\xe4"}, {"a": b"\xff"}, {"b": "1", b"a": b"2", "B": "3"}):
    outcome(f"encode {odd}", lambda odd=odd: network.encode_ros_handshake_header(odd))
for odd in ({"a": None}, {"a": 3}, {3: "a"}):
    try:
        show(network.encode_ros_handshake_header(odd))
    except TypeError:
        show(odd, "TypeError")
outcome("decode", lambda: network.decode_ros_handshake_header(b"\x07\x00\x00\x00\x03\x00\x00\x00a=b"))
for data in (b"\x0b\x00\x00\x00\x03\x00\x00\x00abc", b"\x07\x00\x00\x00\x09\x00\x00\x00abc"):
    try:
        network.decode_ros_handshake_header(data)
    except network.ROSHandshakeException as error:
        show(type(error).__name__)

show("# log")


class Handler(RosStreamHandler):
    """A handler with another line format, as programs define it for another time format."""

    def emit(self, record):
        level, color = _logging_to_rospy_names[record.levelname]
        show("line", level, repr(color), record.getMessage(), repr(rosgraph.roslogging._color_reset))


os.environ["ROSCONSOLE_FORMAT"] = "${severity} ${logger}: ${message}"
logger = logging.getLogger("of_mine")
logger.setLevel(logging.DEBUG)
logger.propagate = False
logger.addHandler(Handler(colorize=False))
logger.addHandler(RosStreamHandler(colorize=False))
logger.info("hello %s", "you")
logger.warning("careful")
logger.critical("the end")
show(issubclass(rosgraph.roslogging.RospyLogger, logging.Logger))
rosgraph.roslogging.RospyLogger.findCaller = lambda self, *args, **kwargs: ("(file)", 0, "(function)", None)
path = rosgraph.roslogging.configure_logging("of_mine", logging.INFO, filename="mine.log")
show(os.path.basename(path), os.path.isfile(path))
