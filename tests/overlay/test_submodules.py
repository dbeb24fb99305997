"""The submodules of ROS's packages that programs import: each can be imported, or the table gives its replacement."""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import catkin.terminal_color
import pytest
import roslib.gentools
import roslib.srvs
import rosmaster.util
import rosmaster.validators
import roswtf.environment
import roswtf.rules
import std_srvs.srv
from roslaunch.launch import _unify_clear_params
from roslib.msgs import list_msg_types
from rosmaster.master_api import ROSMasterHandler
from rosmaster.paramserver import ParamDictionary
from rospkg.os_detect import FdoDetect, OsDetect, OsNotDetected
from roswtf.model import WtfError, WtfWarning
from sensor_msgs.msg import JointState

from tests.conftest import modules_loaded_by

RECORD: dict[str, list[str]] = json.loads((Path(__file__).parent / "submodules.json").read_text())
assert RECORD["offered"]
assert RECORD["not offered"]


@pytest.mark.filterwarnings("ignore:roslib.rospack is deprecated")
def test_submodules_of_real_ros_are_offered() -> None:
    failed: dict[str, str] = {}
    for module in RECORD["offered"]:
        try:
            importlib.import_module(module)
        except Exception as error:  # noqa: BLE001 - any error is reported with its module
            failed[module] = repr(error)
    assert failed == {}


def test_modules_that_are_listed_as_missing_are_missing() -> None:
    """The list in docs/compatibility/modules.md is correct."""
    imported = []
    for module in RECORD["not offered"]:
        with contextlib.suppress(ImportError):
            importlib.import_module(module)
            imported.append(module)
    assert imported == []


LOADED = {
    "catkin": ["find_in_workspaces", "workspace"],
    "cv_bridge": ["boost", "core"],
    "diagnostic_updater": ["_diagnostic_status_wrapper", "_publisher"],
    "rospkg": ["distro"],
    "sensor_msgs": ["msg", "srv", "point_cloud2"],
    "std_msgs": ["msg"],
    "tf2_msgs": ["msg", "srv"],
    "tf2_py": ["_tf2"],
    "rosbag": ["bag", "migration", "rosbag_main"],
    "rosgraph": ["roslogging", "xmlrpc"],
    "roslib": ["manifest", "message", "names", "stacks"],
    "rosmaster": [
        "exceptions",
        "main",
        "master_api",
        "paramserver",
        "registrations",
        "threadpool",
        "util",
        "validators",
    ],
    "rosunit": ["pmon"],
}
"""Submodules that real ROS imports with the package, and minirospy at first use."""


@pytest.mark.parametrize("package", LOADED)
def test_submodules_come_with_their_package(package: str) -> None:
    program = (
        f"import {package} as m; print(*[getattr(m, name).__name__ for name in {LOADED[package]!r}]); m.nope"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.stdout.split() == [f"{package}.{name}" for name in LOADED[package]]
    assert done.stderr.endswith(f"AttributeError: module {package!r} has no attribute 'nope'\n")


@pytest.mark.parametrize(
    ("program", "output"),
    [
        ("import rospy, xml\nprint(xml.etree.ElementTree.fromstring('<a/>').tag)", "a"),
        ("import rosgraph, xml.dom\nprint(xml.dom.minidom.parseString('<a/>').documentElement.tagName)", "a"),
        ("import rospy, logging\nprint(logging.handlers.DEFAULT_TCP_LOGGING_PORT)", "9020"),
        ("import rospy, xmlrpc\nprint(xmlrpc.client.Fault(1, 'x').faultCode)", "1"),
        ("import rospy, xml\nprint(hasattr(xml, 'nope'))", "False"),
        ("import std_msgs.msg\nprint(std_msgs.msg._String.String._type)", "std_msgs/String"),
        (
            "import gazebo_msgs.msg\nprint(gazebo_msgs.msg._ModelState.ModelState._type)",
            "gazebo_msgs/ModelState",
        ),
        (
            "import sensor_msgs.msg, geometry_msgs\nprint(geometry_msgs.msg.Point._type)",
            "geometry_msgs/Point",
        ),
    ],
)
def test_modules_come_with_an_import_of_ros(program: str, output: str) -> None:
    """Programs use submodules that only ROS's own modules have imported."""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.stdout.strip(), done.stderr) == (output, "")


def test_messages_alone_import_no_xml() -> None:
    """Real genpy does not import it either; programs that use only messages need not wait for it."""
    code = "from std_msgs.msg import Bool; from sensor_msgs.msg import Image; import cv_bridge"
    assert not {"xml", "xmlrpc"} & modules_loaded_by(code)


def test_importing_submodules_prints_nothing() -> None:
    program = "\n".join(f"import {module}" for module in RECORD["offered"])
    warned_of = "ignore:roslib.rospack is deprecated"
    done = subprocess.run([sys.executable, "-W", warned_of, "-c", program], capture_output=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")


def test_services_of_a_package() -> None:
    assert roslib.srvs.list_srv_types("std_srvs", False) == ["Empty", "SetBool", "Trigger"]
    assert Path(roslib.srvs.srv_file("std_srvs", "Empty")).is_file()
    (found, failed) = roslib.srvs.get_pkg_srv_specs("std_srvs")
    assert [name for name, _ in found] == ["std_srvs/Empty", "std_srvs/SetBool", "std_srvs/Trigger"]
    assert failed == []
    assert str(found[1][1]) == (
        "SrvSpec[MsgSpec[['bool'], ['data']], MsgSpec[['bool', 'string'], ['success', 'message']]]"
    )
    assert list_msg_types("std_srvs", False) == []


def test_gentools_give_md5_and_text_of_a_file() -> None:
    file = Path(roslib.srvs.srv_file("sensor_msgs", "x")).parents[1] / "msg" / "JointState.msg"
    needed = roslib.gentools.get_file_dependencies(str(file))
    assert needed["deps"] == needed["uniquedeps"] == ["std_msgs/Header"]
    assert Path(needed["files"]["std_msgs/Header"]).name == "Header.msg"
    assert roslib.gentools.compute_md5(needed) == JointState._md5sum
    assert roslib.gentools.compute_full_text(needed) == JointState._full_text

    service = roslib.gentools.get_file_dependencies(roslib.srvs.srv_file("std_srvs", "SetBool"))
    assert roslib.gentools.compute_md5(service) == std_srvs.srv.SetBool._md5sum
    with pytest.raises(Exception, match="does not appear to be a message or service"):
        roslib.gentools.get_file_dependencies("/x/y.txt")


def test_operating_system_may_be_overridden(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_OS_OVERRIDE", "ubuntu:22.04:jammy")
    assert OsDetect().detect_os() == ("ubuntu", "22.04", "jammy")
    assert OsDetect().get_codename() == "jammy"
    monkeypatch.setenv("ROS_OS_OVERRIDE", "ubuntu")
    assert OsDetect().detect_os() == ("ubuntu", "", "")


def test_unknown_operating_system(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROS_OS_OVERRIDE", raising=False)
    with pytest.raises(OsNotDetected, match=r"Could not detect OS, tried \[\]"):
        OsDetect([]).detect_os()
    with pytest.raises(KeyError):
        OsDetect().get_detector("x")
    with pytest.raises(OsNotDetected, match="called in incorrect OS"):
        FdoDetect("no such distribution").get_version()


def test_colors_are_those_of_catkin() -> None:
    catkin.terminal_color.enable_ANSI_colors()
    assert catkin.terminal_color.fmt("@{boldon}x@{boldoff} @!y@| @@{z") == (
        "\x1b[1mx\x1b[22m \x1b[1my\x1b[0m @{z\x1b[0m"
    )
    assert catkin.terminal_color.sanitize("a@b{c} @!") == "a@@b{{c}} @{atexclimation}"
    catkin.terminal_color.disable_ANSI_colors()
    assert catkin.terminal_color.fmt("@{boldon}x") == "x"
    catkin.terminal_color.enable_ANSI_colors()


CHECKS = ["", None, 3, "x", "/x", "a b", "~x", "http://h:1", "rosrpc://h:1", "std_msgs/Bool", "*", b"x"]


def test_validators_answer_as_recorded() -> None:
    """Recorded under rosmaster, except for global_name, which raises NameError there."""
    recorded = json.loads((Path(__file__).parent / "validators.json").read_text())
    assert dict(_validated()) == recorded


def _validated() -> Iterator[tuple[str, str]]:
    for name in ("empty_or_valid_name", "is_api", "is_service", "is_topic", "non_empty", "non_empty_str", "not_none",
                 "valid_type_name", "valid_name"):  # fmt: skip
        for value in CHECKS:
            try:
                result = repr(getattr(rosmaster.validators, name)("p")(value, "/caller"))
            except rosmaster.validators.ParameterInvalid as error:
                result = f"ParameterInvalid: {error}"
            yield f"{name} {value!r}", result


def test_checks_of_addresses_and_paths() -> None:
    urls = ("http://h:1", "x", "http://h:x", "ftp://h:1", "", "http://h", None)
    answers = {url: roswtf.environment.invalid_url(url) for url in urls}
    assert answers == {
        "http://h:1": None,
        "x": "protocol is not 'http'",
        "http://h:x": "port number [x] is invalid",
        "ftp://h:1": "protocol is not 'http'",
        "": None,
        "http://h": "port number is missing",
        None: None,
    }
    assert roswtf.environment.paths(None) == []
    assert roswtf.environment.paths(os.pathsep.join("ab")) == ["a", "b"]
    assert bool(roswtf.environment.is_executable(sys.executable)) or os.name == "nt"


def test_rules_of_roswtf_fill_a_context() -> None:
    class Context:
        def __init__(self) -> None:
            self.errors: list[WtfError] = []
            self.warnings: list[WtfError] = []

        def as_dictionary(self) -> dict[str, object]:
            return {"k": 1}

    context = Context()
    for found in ("bad", ["a", "b"], None):
        roswtf.rules.error_rule((print, "msg"), found, context)
    for found in (None, True, False, "q"):
        roswtf.rules.warning_rule((print, "w %(k)s"), found, context)
    assert [vars(error) for error in context.errors] == [
        {"msg": "msgbad", "format_msg": "msg", "return_val": "bad"},
        {"msg": "msg\n * a\n * b\n", "format_msg": "msg", "return_val": ["a", "b"]},
    ]
    assert [(each.msg, each.return_val) for each in context.warnings] == [("w 1", True), ("w 1q", "q")]
    assert isinstance(context.warnings[0], WtfWarning)


def test_master_as_an_object_answers() -> None:
    handler = ROSMasterHandler(1)
    handler._ready("http://h:1/")
    assert handler.getUri("/x") == (1, "", "http://h:1/")
    assert handler.getParam("/x", "a")[0] == -1
    assert handler.setParam("/x", "a", 1)[0] == 1
    assert handler.getParam("/x", "a") == (1, "Parameter [/a]", 1)
    answer = handler.registerPublisher("/x", "t", "std_msgs/Bool", "http://localhost:1/")
    assert answer == (1, "Registered [/x] as publisher of [/t]", [])
    assert handler.getSystemState("/x")[2] == [[["/t", ["/x"]]], [], []]
    assert handler.getPid() == (-1, "missing required caller_id parameter", -1)
    assert handler._ok()
    handler._shutdown("done")
    assert not handler._ok()


def test_parameters_as_an_object_notify() -> None:
    tree = ParamDictionary(None)
    tree.set_param("/a", {"b": 1, "c": {"d": 2}})
    assert tree.get_param("/a/c") == {"d": 2}
    assert sorted(tree.get_param_names()) == ["/a/b", "/a/c/d"]
    assert [tree.search_param("/a/c", key) for key in ("b", "d", "z")] == ["/a/b", "/a/c/d", None]
    assert tree.subscribe_param("/a/b", ("/s", "http://h:2/")) == 1
    notified: list[object] = []
    tree.set_param("/a/b", 5, notified.extend, "/z")
    tree.delete_param("/a/b", notified.extend)
    assert notified == [([("/s", "http://h:2/")], "/a/b/", 5), ([("/s", "http://h:2/")], "/a/b/", {})]
    assert tree.unsubscribe_param("/a/b", ("/s", "http://h:2/"))[2] == 1
    assert tree.unsubscribe_param("/a/b", ("/s", "http://h:2/"))[2] == 0
    with pytest.raises(TypeError, match="cannot set root of parameter tree to non-dictionary"):
        tree.set_param("/", 3)


def test_namespaces_to_clear_are_unified() -> None:
    """As in real roslaunch."""
    assert _unify_clear_params(["/a/", "/a/b/", "/c/"]) == ["/a/", "/c/"]
    assert _unify_clear_params(["/a/b", "/a"]) == ["/a/"]
    assert _unify_clear_params(["/ab/", "/a/"]) == ["/ab/", "/a/"]
    assert _unify_clear_params([]) == []


def test_proxies_of_servers_are_kept() -> None:
    assert rosmaster.util.xmlrpcapi(None) is None
    assert rosmaster.util.xmlrpcapi("http://h:1/") is rosmaster.util.xmlrpcapi("http://h:1/")
    with pytest.raises(OSError, match="unsupported XML-RPC protocol"):
        rosmaster.util.xmlrpcapi("rosrpc://h:1")
