"""rosgraph, rostopic, rosnode, rosservice, rosparam and rosmsg as user code imports them."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import rosgraph
import rosgraph.names
import roslib.scriptutil
import rosmsg
import rosnode
import rosparam
import rospy
import rosservice
import rostopic
from std_msgs.msg import Bool
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse

from minirospy.base.environment import Environment
from minirospy.introspect.streams import ToolNode


@pytest.fixture
def node(master: str) -> Iterator[ToolNode]:
    """Run a node that publishes /flag and serves /set_flag."""
    from io import BytesIO

    from minirospy.core.wire.tcpros import InterfaceType

    def handle(body: memoryview, _: object) -> bytes:
        request = SetBoolRequest()
        request.deserialize(bytes(body))
        buffer = BytesIO()
        SetBoolResponse(request.data, "done").serialize(buffer)
        return buffer.getvalue()

    with ToolNode(Environment.read(), "tool") as tool:
        tool.publisher("/flag", Bool, latch=True).publish(Bool(True))
        server = tool._node.make_service(
            "/set_flag",
            InterfaceType(SetBool._type, SetBool._md5sum),
            handle,
            request_type="std_srvs/SetBoolRequest",
            response_type="std_srvs/SetBoolResponse",
        )
        tool._loop.run(tool._node.serve(server))
        yield tool
    gc.collect()  # objects that user code does not close are closed when they are deleted


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_rosgraph(node: ToolNode, master: str) -> None:
    assert rosgraph.is_master_online()
    assert not rosgraph.is_master_online("http://localhost:1")
    assert rosgraph.get_master_uri() == master
    asking = rosgraph.Master("/me")
    publishers, _, services = asking.getSystemState()
    assert ["/flag", [node.name]] in publishers
    assert ["/set_flag", [node.name]] in services
    asking.setParam("/p", 5)
    assert asking.getParam("/p") == 5
    assert ["/flag", "std_msgs/Bool"] in asking.getPublishedTopics("/")
    with pytest.raises(rosgraph.MasterException):
        asking.getParam("/nope")
    with pytest.raises(OSError, match="no ROS master"):
        rosgraph.Master("/me", "http://localhost:1").getPid()
    assert rosgraph.names.script_resolve_name("me", "a/b") == "/a/b"
    assert rosgraph.names.ns_join("/a", "b") == "/a/b"


def test_rostopic(node: ToolNode) -> None:
    type_, topic, function = rostopic.get_topic_type("/flag")
    assert (type_, topic, function) == ("std_msgs/Bool", "/flag", None)
    cls, topic, function = rostopic.get_topic_class("/flag/data")
    assert (cls, topic) == (Bool, "/flag")
    assert function is not None
    assert function(Bool(True)) is True
    assert rostopic.get_topic_type("/nope") == (None, None, None)
    assert rostopic.find_by_type("std_msgs/Bool") == ["/flag"]
    assert ("/flag", "std_msgs/Bool", [node.name]) in rostopic.get_topic_list()[0]


@pytest.mark.parametrize("window", [-1, 10.0])
def test_rates(capsys: pytest.CaptureFixture[str], window: float) -> None:
    rates = rostopic.ROSTopicHz(window, use_wtime=True)
    assert rates.get_hz("/t") is None
    for _ in range(3):
        rates.callback_hz(Bool(True), "/t")
    found = rates.get_hz("/t")
    assert found is not None
    assert found[-1] == 3
    rates.print_hz(("/t",))
    assert capsys.readouterr().out == "no new messages\n"


def test_rosnode(node: ToolNode) -> None:
    assert rosnode.get_node_names() == [node.name]
    assert rosnode.rosnode_ping(node.name, max_count=1)
    assert not rosnode.rosnode_ping("/nope", max_count=1)
    assert rosnode.rosnode_ping_all() == ([node.name], [])
    assert rosnode.get_machines_by_nodes() == ["localhost"]
    assert rosnode.kill_nodes([node.name, "/nope"]) == ([node.name], ["/nope"])
    assert node.ended.wait(30)


def test_rosservice(node: ToolNode) -> None:
    assert rosservice.get_service_list() == ["/set_flag"]
    assert rosservice.get_service_list(include_nodes=True) == [["/set_flag", [node.name]]]
    assert rosservice.get_service_type("/set_flag") == "std_srvs/SetBool"
    assert rosservice.get_service_type("/nope") is None
    assert rosservice.get_service_class_by_name("/set_flag") is SetBool
    assert rosservice.get_service_node("/set_flag") == node.name
    assert rosservice.get_service_args("/set_flag") == "data"
    request, response = rosservice.call_service("/set_flag", [True])
    assert (request.data, response.success, response.message) == (True, True, "done")
    with pytest.raises(rosservice.ROSServiceException, match="is not available"):
        rosservice.call_service("/nope", [True])


def test_rosparam(master: str, tmp_path: Path) -> None:
    rosparam.set_param("/a", "deg(180)")
    assert rosparam.get_param("/a") == pytest.approx(3.14159265)
    file = tmp_path / "p.yaml"
    file.write_text("x: 1\ny: {z: two}\n")
    for values, namespace in rosparam.load_file(str(file), default_namespace="/ns"):
        rosparam.upload_params(namespace, values)
    assert rosparam.list_params("/ns") == ["/ns/x", "/ns/y/z"]
    rosparam.dump_params(str(file), "/ns")
    assert file.read_text() == "x: 1\ny:\n  z: two\n"
    rosparam.delete_param("/ns")
    with pytest.raises(rosgraph.MasterError, match="is not set"):
        rosparam.get_param("/ns")
    with pytest.raises(rosparam.RosParamException, match="does not exist"):
        rosparam.load_file("/nope.yaml")

    for content, why in ((b"\xff", "not UTF-8"), (b"a: [1\n", "expected")):
        file.write_bytes(content)
        with pytest.raises(rosparam.RosParamException, match=why):
            rosparam.load_file(str(file))

    with pytest.raises(rosparam.RosParamException, match="cannot be read"):
        rosparam.load_file(str(tmp_path))


def test_without_a_master() -> None:
    """Each module raises its own error."""
    asked: list[tuple[Any, Any]] = [
        (rostopic.get_topic_list, rostopic.ROSTopicIOException),
        (rosnode.get_node_names, rosnode.ROSNodeIOException),
        (rosservice.get_service_list, rosservice.ROSServiceIOException),
        (lambda: rosparam.get_param("/a"), rosparam.RosParamIOException),
    ]
    for ask, error in asked:
        with pytest.raises(error, match=r"^Unable to communicate with master!$") as raised:
            ask()
        assert "no ROS master answers at http://localhost:1" in str(raised.value.__cause__)


def test_rosmsg() -> None:
    assert rosmsg.get_msg_text("std_msgs/Bool") == "bool data\n"
    assert rosmsg.get_srv_text("std_srvs/SetBool") == "bool data\n---\nbool success\nstring message\n"
    assert "std_msgs/Bool" in rosmsg.list_msgs("std_msgs")
    assert rosmsg.list_srvs("std_srvs") == ["std_srvs/Empty", "std_srvs/SetBool", "std_srvs/Trigger"]
    with pytest.raises(rosmsg.ROSMsgException, match="Cannot locate"):
        rosmsg.get_msg_text("std_msgs/Nope")


def test_the_commands_as_functions(master: str, capsys: pytest.CaptureFixture[str]) -> None:
    rosgraph.Master("/tester").registerPublisher("/t", "std_msgs/Bool", "http://localhost:1")
    rosgraph.Master("/tester").setParam("/p", 5)
    for call, said in (
        (lambda: rosnode.rosnode_listnodes(list_uri=True), "http://localhost:1\n"),
        (lambda: rostopic.rostopicmain(["rostopic", "type", "/t"]), "std_msgs/Bool\n"),
        (lambda: rosservice.rosservicemain(["rosservice", "list"]), "\n"),
        (lambda: rosparam.yamlmain(["rosparam", "get", "/p"]), "5\n"),
    ):
        call()
        assert capsys.readouterr().out.rstrip("\n") == said.rstrip("\n")
    with pytest.raises(SystemExit) as ended:
        rosnode.rosnodemain(["rosnode", "list"])
    assert (ended.value.code, capsys.readouterr().out) == (0, "/tester\n")


def test_names_that_ros_leaks_exist_here(master: str) -> None:
    """ROS raises the exceptions of its YAML and XML-RPC libraries."""
    for name, value in (("/a", "{a: "), ("/a", "")):
        with pytest.raises(rosparam.RosParamException):
            rosparam.set_param(name, value)
    with pytest.raises(rosparam.RosParamException, match="32 bits"):
        rosparam.set_param_raw("/a", 2**40)


def test_windows_of_rates(capsys: pytest.CaptureFixture[str]) -> None:
    class AnyMsg:
        _buff = b"x" * 1500

    bandwidth = rostopic.ROSTopicBandwidth(10)
    bandwidth.callback(AnyMsg)
    bandwidth.print_bw()
    assert capsys.readouterr().out == ""
    bandwidth.callback(AnyMsg)
    bandwidth.print_bw()
    assert capsys.readouterr().out.endswith("window: 2\n")
    with pytest.raises(rospy.ROSInitException):
        rostopic.ROSTopicHz(10).callback_hz(Bool())


def test_unknown_node(master: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert not rosnode.rosnode_ping("/nobody", max_count=1, verbose=True)
    assert capsys.readouterr() == ("", "cannot ping [/nobody]: unknown node\n")
    with pytest.raises(rosnode.ROSNodeException, match="cannot resolve machine name"):
        rosnode.get_nodes_by_machine("no.such.machine.invalid")


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_scripts_of_old_pass_a_server_proxy(master: str, capsys: pytest.CaptureFixture[str]) -> None:
    rosgraph.Master("/dead").registerPublisher("/t", "std_msgs/Bool", "http://localhost:1")
    with roslib.scriptutil.get_master() as proxy:
        assert proxy.lookupNode("/me", "/dead")[::2] == [1, "http://localhost:1"]
        assert rosnode.get_api_uri(proxy, "/dead") == "http://localhost:1"
        rosnode.cleanup_master_blacklist(proxy, ["/dead"])
    assert capsys.readouterr().out == "Unregistering /dead\n"
    assert rosnode.get_node_names() == []
