"""Nodes and tests of roslaunch.core: the default values, and the errors of their constructors."""

import rosgraph.xmlrpc
from referee import outcome, show
from roslaunch.config import ROSLaunchConfig
from roslaunch.core import Machine, Master, Node, Test
from roslaunch.xmlloader import XmlLoader

FIELDS = (
    "package", "type", "name", "namespace", "machine_name", "machine", "args", "respawn", "respawn_delay", "remap_args",
    "env_args", "output", "cwd", "launch_prefix", "required", "process_name", "filename",
)  # fmt: skip


def values(thing, fields=FIELDS):
    """Return the values of some attributes."""
    return [getattr(thing, field) for field in fields]


show("node", values(Node("p", "t")))
CHOICES = {
    "name": ("", "a/b"),
    "namespace": (None, "", "a", "/a//b/"),
    "machine_name": (None, ""),
    "args": (None, ""),
    "respawn": (None, "x"),
    "respawn_delay": (None,),
    "remap_args": (None,),
    "env_args": (None,),
    "output": (None, "", "x", "screen", "log", 3),
    "cwd": (None, "", "x", "node", "ROS_HOME", "ros_home", "Node", 3),
    "launch_prefix": (None, ""),
    "required": (None,),
    "filename": (None,),
}
for field, choices in CHOICES.items():
    for choice in choices:
        outcome(f"{field}={choice!r}", lambda: getattr(Node("p", "t", **{field: choice}), field))
outcome("respawn, required", lambda: Node("p", "t", respawn=True, required=True))
for names in ((None, "t"), ("p", None), ("", "t"), ("p", " "), (3, "t")):
    outcome(repr(names), lambda: Node(*names).package)

show("test", values(Test("n", "p", "t"), (*FIELDS, "test_name", "time_limit", "retry")))
for limit in (None, 0, 0.5, -1, "x", "3"):
    outcome(f"time_limit={limit!r}", lambda: Test("n", "p", "t", time_limit=limit).time_limit)
show(
    "machine",
    values(
        Machine("n", "a"), ("name", "env_loader", "user", "password", "assignable", "ssh_port", "timeout")
    ),
)
show("master", values(Master(), ("type", "uri", "auto")))

NODE = '<node name="n" pkg="p" type="t"{}/>'
for attributes in ("", ' clear_params="true"', ' clear_params="false"', ' cwd="node" output="screen"'):
    config = ROSLaunchConfig()
    XmlLoader().load_string(f"<launch>{NODE.format(attributes)}</launch>", config, verbose=False)
    show(
        attributes, config.clear_params, [(node.cwd, node.output, node.machine_name) for node in config.nodes]
    )

# A test without a name gets one when it runs.
TEST = '<test test-name="" pkg="p" type="t.py" {}><param name="~v" value="1"/></test>'
for attributes in ("", 'ns="g"', 'name="x"', 'name=""'):
    config = ROSLaunchConfig()
    XmlLoader().load_string(f"<launch>{TEST.format(attributes)}</launch>", config, verbose=False)
    show(
        attributes,
        [(test.test_name, test.name, test.namespace) for test in config.tests],
        list(config.params),
    )

# The port at which a node's server is queried.
for port in (0, None, "", 3, "3", "x", ()):
    outcome(f"port {port!r}", lambda: rosgraph.xmlrpc.XmlRpcNode(port).port)
show(rosgraph.xmlrpc.isstring("a"), rosgraph.xmlrpc.isstring(b"a"), rosgraph.xmlrpc.isstring(None))
