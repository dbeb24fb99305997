"""Private names of ROS's modules that programs use nevertheless."""

from __future__ import annotations

import io
import logging
from pathlib import Path
from types import ModuleType
from xmlrpc.client import Binary

import genpy.message
import pytest
import roslaunch.rlutil
import rosmsg
import rosnode
import rosparam
import rospkg
import rospy.core
import rospy.topics
import rosservice
import rostest.rostestutil
import rostopic
from rosgraph import Master
from rospy.impl.tcpros import DEFAULT_BUFF_SIZE
from std_msgs.msg import Bool
from std_srvs.srv import Empty


@pytest.mark.parametrize("module", [rostopic, rosnode, rosservice, rosparam])
def test_fullusage_prints_the_commands_and_exits(
    module: ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as raised:
        module._fullusage()
    out, err = capsys.readouterr()
    # Only rosparam exits with 0, as the real one does.
    assert (raised.value.code == 0) == (module is rosparam)
    assert "Commands:" in out + err


def test_a_command_function_runs_its_command(master: str, capsys: pytest.CaptureFixture[str]) -> None:
    rosparam._rosparam_cmd_set_load("set", ["rosparam", "set", "/a", "5"])
    rosparam._rosparam_cmd_get_dump("get", ["rosparam", "get", "/a"])
    assert capsys.readouterr().out == "5\n"
    rosparam._rosparam_cmd_list(["rosparam", "list"])
    assert "/a\n" in capsys.readouterr().out
    Master("/node").registerPublisher("/topic", "std_msgs/Bool", "http://localhost:1/")
    rostopic._rostopic_cmd_list(["rostopic", "list"])
    assert capsys.readouterr().out == "/topic\n"
    rosnode._rosnode_cmd_list(["rosnode", "list"])
    assert capsys.readouterr().out == "/node\n"
    rosservice._rosservice_cmd_list(["rosservice", "list"])
    assert capsys.readouterr().out == ""
    with pytest.raises(SystemExit):
        rostopic._rostopic_cmd_type(["rostopic", "type", "/nope"])


def test_rosmsg_commands_run(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", ["rosmsg", "show", "std_msgs/Bool"])
    assert rosmsg.rosmsg_cmd_show(rosmsg.MODE_MSG, None) is None
    rosmsg.rosmsg_cmd_list(rosmsg.MODE_SRV, None, ["list"])
    out = capsys.readouterr().out
    assert out.startswith("bool data\n")
    assert "std_srvs/Empty\n" in out


def test_topics_are_grouped_by_host(master: str) -> None:
    api = Master("/me")
    for name, host in (("/a", "one"), ("/b", "one"), ("/c", "two")):
        Master(name).registerPublisher("/t", "std_msgs/Bool", f"http://{host}:1/")
    pubs, subs = rostopic._rostopic_list_group_by_host(api, [("/t", "std_msgs/Bool", ["/a", "/b", "/c"])], [])
    assert pubs == {
        "one": [("/t", "std_msgs/Bool", ["/a", "/b"])],
        "two": [("/t", "std_msgs/Bool", ["/c"])],
    }
    assert subs == {}


def test_master_handle_can_be_replaced() -> None:
    api = Master("/me", "http://localhost:1/")
    assert api.handle is api.handle
    replacement: object = "mine"
    vars(api)["handle"] = replacement
    assert api.handle is replacement


def test_names_without_a_command(tmp_path: Path) -> None:
    (tmp_path / "A.msg").touch()
    (tmp_path / "folder").mkdir()
    assert rosmsg._list_resources(str(tmp_path)) == ["A.msg"]
    assert rosmsg._list_resources(str(tmp_path / "nope")) == []
    assert genpy.message._get_message_or_service_class("message", "std_msgs/Bool") is Bool
    assert genpy.message._get_message_or_service_class("service", "std_srvs/Empty") is Empty
    assert rospkg.RosPack()._load_manifest("std_msgs").name == "std_msgs"
    assert DEFAULT_BUFF_SIZE == 65536


def test_sleep_and_wait_for_master_return(master: str, capsys: pytest.CaptureFixture[str]) -> None:
    rostopic._sleep(0.0)
    roslaunch.rlutil._wait_for_master()
    assert capsys.readouterr().out == ""


def test_master_of_rosservice_is_called_by_its_name(master: str) -> None:
    assert rosservice._get_master().caller_id == "/rosservice"
    assert rosservice._get_master().getPid() > 0


def test_types_of_a_folder_are_listed(tmp_path: Path) -> None:
    for name in ("B.srv", "A.srv", "C.msg"):
        (tmp_path / name).touch()
    assert rosmsg._list_types(str(tmp_path), "srv", ".srv") == ["A", "B"]
    assert rosmsg._list_types(str(tmp_path / "none"), "srv", ".srv") == []


def test_log_lines_of_rostest_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    rostest.rostestutil.printlog("a %s", "b")
    rostest.rostestutil.printlog("%s")
    rostest.rostestutil.printlogerr("x %s", 3)
    out, err = capsys.readouterr()
    assert (out, err) == ("[ROSTEST]a b\n[ROSTEST]%s\n", "[ROSTEST]x 3\n")


def test_base_logger_logs_for_its_callers_caller(caplog: pytest.LogCaptureFixture) -> None:
    def log(level: str, text: str, **options: object) -> None:
        rospy.core._base_logger(text, ("arms",), {"logger_name": "robot"}, level=level, **options)

    with caplog.at_level(logging.INFO, "rosout"):
        for _ in range(2):
            log("warning", "two %s", once=True)
            log("info", "no %s")
    found = [(each.name, each.levelname, each.getMessage()) for each in caplog.records]
    assert found == [
        ("rosout.robot", "WARNING", "two arms"),
        ("rosout.robot", "INFO", "no arms"),
        ("rosout.robot", "INFO", "no arms"),
    ]


def test_topics_have_the_classes_of_their_impl() -> None:
    assert issubclass(rospy.topics._PublisherImpl, rospy.topics._TopicImpl)
    assert issubclass(rospy.topics._SubscriberImpl, rospy.topics._TopicImpl)
    publisher = rospy.Publisher("topic_of_impl", Bool, queue_size=1)
    assert type(publisher.impl) is rospy.topics._PublisherImpl
    publisher.unregister()


def test_bytes_of_parameters_are_binary(master: str) -> None:
    rosparam.upload_params("/camera", {"key": Binary(b"one"), "list": [Binary(b"two"), 3]})
    assert rosparam.get_param("/camera") == {"key": Binary(b"one"), "list": [Binary(b"two"), 3]}
    rosparam.set_param("/more", "!!binary aGVsbG8=")
    found = rosparam.get_param("/more")
    assert (type(found), found.data) == (Binary, b"hello")


@pytest.mark.parametrize("name", ["-", "", None])
def test_parameters_are_read_from_standard_input(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("a: 1\n---\nb: 2\n"))
    assert rosparam.load_file(name, "/robot") == [({"a": 1}, "/robot"), ({"b": 2}, "/robot")]


def test_name_that_is_a_number_is_resolved() -> None:
    assert rospy.resolve_name(5, "/robot/node") == "/robot/5"  # type: ignore[arg-type]
