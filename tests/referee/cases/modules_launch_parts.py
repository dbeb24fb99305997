"""roslaunch's functions for dependencies, arguments and commands; rosmaster's and rosunit's that programs call."""

import logging
import os
import sys

import roslaunch
import roslaunch.arg_dump
import roslaunch.core as c
import roslaunch.depends as d
import rosmaster.paramserver as ps
import rosunit.core
import rosunit.junitxml
from referee import outcome, printed, show

os.makedirs("pk/launch", exist_ok=True)
FILES = {
    "pk/package.xml": """<package format="2"><name>pk</name><version>1.0.0</version><description>d</description>
<maintainer email="ab@example.com">m</maintainer>
<license>BSD</license>
<exec_depend>rospy</exec_depend><test_depend>rostest</test_depend></package>
""",
    "pk/launch/a.launch": """<launch><arg name="x" default="1" doc="number"/><arg name="y" default="q"/>
<arg name="z" default="2"/>
<node pkg="rospy" type="talker.py" name="t"/><node pkg="std_msgs" type="q" name="q"/><test pkg="rostest" type="tt" test-name="w"/>
<include file="$(find pk)/launch/b.launch"/></launch>
""",
    "pk/launch/b.launch": """<launch><node pkg="roscpp" type="n" name="n"/></launch>
""",
}
for name, text in FILES.items():
    with open(name, "w") as stream:
        stream.write(text)
os.environ["ROS_PACKAGE_PATH"] = os.pathsep.join([os.getcwd(), "/usr/share"])
sys.argv = ["program"]
f, other = (os.path.abspath(f"pk/launch/{name}.launch") for name in "ab")
deps = {}
printed("parse", lambda: d.rl_file_deps(deps, f, True))
for k in sorted(deps):
    show(k, sorted(deps[k].nodes), deps[k].includes, sorted(deps[k].pkgs))
printed("print", lambda: d.print_deps("pk", {f: d.RoslaunchDeps([("a", "b")], [], ["a"])}, True))
outcome("missing", lambda: {k: sorted(v) for k, v in d.calculate_missing("pk", {}, deps).items()})
outcome("missing", lambda: {k: sorted(v) for k, v in d.calculate_missing("pk", {}, deps, True).items()})
printed("usage", d.fullusage)
printed("bad", lambda: d.parse_launch("/nope.launch", {}, False), texts=False)
printed("args", lambda: roslaunch.arg_dump.dump_args([f]))
printed("args", lambda: roslaunch.arg_dump.dump_args([other]))
show(c.is_child_mode())
c.set_child_mode(True)
show(c.is_child_mode())
outcome("rle", lambda: c.rle_wrapper(int)("x"))
outcome("rle", lambda: c.rle_wrapper(int)("5"))
show(
    c.Executable("a", ["b", "c"]),
    repr(c.RosbinExecutable("a", ["b"], "setup")),
    c.RosbinExecutable("a", []).phase,
)
outcome("esc", lambda: (c._xml_escape('<"&'), c._xml_escape(5)))
outcome("remap", lambda: c.remap_localhost_uri("http://other:5/"))
os.environ["ROS_IP"] = "127.0.0.1"
outcome("remap", lambda: c.remap_localhost_uri("http://localhost:11/"))
outcome("remap", lambda: c.remap_localhost_uri("http://other:11/", True))
outcome("exe", lambda: roslaunch.ROSLaunchConfig().add_executable(None))


class Core:
    def printerrlog(self, m):
        show("ERR", m)


printed("handle", lambda: roslaunch.handle_exception(Core(), logging.getLogger("x"), "msg ", ValueError("v")))


class D(dict):
    def iterkeys(self):
        return iter(self)


subs = D(
    {
        "/a/b/": [("n", "u"), ("m", "v")],
        "/": [("r", "w")],
        "/a/b/c/": [("n", "u")],
        "/a/b/gone/": [("n", "u")],
        "/z/": [("n", "u")],
    }
)
for key, val in (
    ("/a/b", {"c": 1, "d": {"e": 2}}),
    ("/a/b/c", 5),
    ("/a/b/", {}),
    ("/", {"a": {"b": 1}}),
    ("/q", 1),
):
    outcome(key, lambda: sorted(map(str, ps.compute_param_updates(subs, key, val))))
    outcome(key, lambda: sorted(map(str, ps.compute_param_updates(subs, key, val, "n"))))
outcome("none", lambda: ps.compute_param_updates({}, "/a", 1))
printed("log", lambda: rosunit.core.printlog("a %s", "b"))
printed("log", lambda: rosunit.core.printlog_bold("a"))
printed("log", lambda: rosunit.core.printerrlog("a"))
outcome("cdata", lambda: rosunit.junitxml.cdata("x"))
outcome(
    "chars",
    lambda: rosunit.junitxml.invalid_chars.sub(rosunit.junitxml.invalid_char_replacer, "a\x00\x1f\ufffeb"),
)
