"""rosgraph's servers, graph and sockets, as third-party tools use them; the referee's cases test the rest."""

from __future__ import annotations

import os
import socket
import threading
from io import BytesIO
from pathlib import Path
from xmlrpc.client import ServerProxy

import pytest
import rosclean
import rosgraph
import rosgraph.impl.graph
import rosgraph.network
import rosgraph.xmlrpc
import rostopic


def test_myargv_drops_every_argument_with_an_assignment() -> None:
    words = ["prog", "a:=b", "--flag:=x", "http://h:=1", "_p:=1", "__name:=n", "-v"]
    assert rosgraph.myargv(words) == ["prog", "-v"]


def test_local_processes_ignore_an_address_on_the_command_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", ["prog", "__ip:=192.0.2.1"])
    monkeypatch.delenv("MINIROSPY_LOCAL", raising=False)
    assert rosgraph.network.get_host_name() == "192.0.2.1"
    monkeypatch.setenv("MINIROSPY_LOCAL", "1")
    assert rosgraph.network.get_address_override() == "localhost"
    assert rosgraph.network.get_bind_address() == "127.0.0.1"


def test_the_graph_as_edges(master: str) -> None:
    client = rosgraph.Master("/talker")
    client.registerPublisher("/chat", "std_msgs/Bool", "http://localhost:1")
    client.registerPublisher("/alone", "std_msgs/Bool", "http://localhost:1")
    rosgraph.Master("/listener").registerSubscriber("/chat", "std_msgs/Bool", "http://localhost:2")
    client.registerService("/serve", "rosrpc://localhost:3", "http://localhost:1")
    graph = rosgraph.impl.graph.Graph()

    assert graph.update()
    assert not graph.update()
    assert [str(edge) for edge in graph.nn_edges] == ["/talker->/listener"]
    assert {str(edge) for edge in graph.nt_edges} == {"/talker-> /chat", " /chat->/listener"}
    assert {str(edge) for edge in graph.nt_all_edges} == {
        *map(str, graph.nt_edges), "/talker-> /alone"
    }  # fmt: skip
    assert (graph.nn_nodes, graph.srvs) == ({"/talker", "/listener"}, {"/serve"})
    assert {rosgraph.impl.graph.node_topic(each) for each in graph.nt_nodes} == {"/chat", "/alone"}

    graph.set_master_stale(0)
    assert not graph.update()
    rosgraph.Master("/listener").unregisterSubscriber("/chat", "http://localhost:2")

    assert graph.update()
    assert list(graph.nn_edges) == []
    below = rosgraph.impl.graph.Graph(topic_ns="/alone")

    assert below.update()
    assert below.nt_nodes == {" /alone"}


def test_edges() -> None:
    edges = rosgraph.impl.graph.EdgeList()
    assert edges.add_edges("/a", "/b", "b", "/t")
    assert not edges.add_edges("/a", "/b", "i", "/t")
    assert [(edge.start, edge.end, edge.key) for edge in edges] == [
        ("/a", "/b", "/a|/t"),
        ("/b", "/a", "/b|/t"),
    ]
    edges.delete(rosgraph.impl.graph.Edge("/a", "/b", "/t"))
    assert len(edges) == 1
    edges.delete_all("/a")
    assert list(edges) == []


def test_a_server_of_ones_own(monkeypatch: pytest.MonkeyPatch) -> None:
    ready = threading.Event()
    ended: list[str] = []

    class Handler(rosgraph.xmlrpc.XmlRpcHandler):
        def _ready(self, uri: str) -> None:
            self.uri = uri
            ready.set()

        def _shutdown(self, reason: str) -> None:
            ended.append(reason)

        def double(self, value: int) -> int:
            return 2 * value

    handler = Handler()
    node = rosgraph.xmlrpc.XmlRpcNode(0, handler)
    node.start()
    assert ready.wait(30)
    assert handler.uri == node.uri == f"http://localhost:{node.port}/"
    with ServerProxy(str(node.uri)) as proxy:
        assert proxy.double(21) == 42
    node.shutdown("enough")
    node.shutdown("again")
    assert ended == ["enough"]


def test_a_port_in_use_is_reported_to_the_caller() -> None:
    notified = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        rosgraph.xmlrpc.XmlRpcNode(port, None, on_run_error=lambda error: notified.set()).start()
        assert notified.wait(30)


def test_connection_headers_over_a_socket() -> None:
    one, other = socket.socketpair()
    with one, other:
        other.settimeout(30)
        sent = rosgraph.network.write_ros_handshake_header(one, {"topic": "/t", "tcp_nodelay": b"1"})
        one.sendall(b"rest")
        buffer = BytesIO()
        assert rosgraph.network.read_ros_handshake_header(other, buffer, 7) == {
            "topic": "/t",
            "tcp_nodelay": "1",
        }
        assert sent == 33
        rest = buffer.getvalue()
        while rest != b"rest":
            rest += other.recv(10)
        other.sendall(b"\x09\x00\x00\x00abc")
        other.close()
        with pytest.raises(rosgraph.network.ROSHandshakeException, match="terminated"):
            rosgraph.network.read_ros_handshake_header(one, BytesIO(), 100)


def test_no_master_is_also_an_error_of_sockets() -> None:
    with pytest.raises(ConnectionRefusedError):
        rostopic.get_topic_list()


def test_rosclean(tmp_path: Path) -> None:
    (tmp_path / "log").write_bytes(b"x" * 5000)
    assert rosclean.get_disk_usage(str(tmp_path)) >= 5000
    assert rosclean.get_human_readable_disk_usage(str(tmp_path)).endswith("K")
    with pytest.raises(rosclean.CleanupException):
        rosclean.get_disk_usage(str(tmp_path / "none"))
    assert rosclean.rosclean_main(["rosclean", "check"]) == 0


def test_edges_of_a_row_of_connections() -> None:
    from rosgraph.impl.graph import EdgeList, edge_args

    there, back = ("/a", "/b", "/t"), ("/b", "/a", "/t")
    found = {direction: edge_args("/a", "/b", direction, "/t") for direction in "oib?"}
    assert found == {"o": [there], "i": [back], "b": [there, back], "?": []}
    edges = EdgeList()
    assert [edges.add_edges("/a", "/b", direction, "/t") for direction in "obi?"] == [
        True,
        True,
        False,
        False,
    ]


def test_master_of_a_command_line_is_the_first_and_is_complete() -> None:
    environment = {"ROS_MASTER_URI": "http://one:1/"}
    get_master_uri = rosgraph.rosenv.get_master_uri
    assert get_master_uri(environment, ["__master:=http://x:2/", "__master:=http://y:3/"]) == "http://x:2/"
    assert get_master_uri(environment, ["a:=b"]) == "http://one:1/"
    for argument in ("__master:=", "__master:=a:=b"):
        with pytest.raises(ValueError, match="improperly specified"):
            get_master_uri(environment, [argument])


def test_a_program_replaces_the_master_that_is_called(master: str) -> None:
    client = rosgraph.Master("/tester")
    assert client.is_online()
    client.handle.getPid = lambda caller_id: (1, "", [caller_id])
    assert client.getPid() == ["/tester"]
    del client.handle
    assert client.getPid() > 0
    client.handle = ServerProxy("http://localhost:1")
    assert not client.is_online()


def test_a_master_changes_its_uri_and_its_caller(master: str) -> None:
    client = rosgraph.Master("/tester", "http://localhost:1")
    assert not client.is_online()
    client._reinit(master)
    client.caller_id = "/other"
    client.registerService("/serve", "rosrpc://localhost:3", "http://localhost:1")
    assert client.getSystemState()[2] == [["/serve", ["/other"]]]


def test_folder_that_another_process_creates_at_the_same_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = os.mkdir

    def mkdir(path: str) -> None:
        real(path)  # by the other process
        real(path)

    monkeypatch.setattr(os, "mkdir", mkdir)
    rosgraph.roslogging.makedirs_with_parent_perms(str(tmp_path / "a" / "b"))
    assert (tmp_path / "a" / "b").is_dir()


def test_folder_whose_owner_cannot_be_changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError

    tmp_path.chmod(0o1777)
    monkeypatch.setattr(os, "chmod", refuse)
    rosgraph.roslogging.makedirs_with_parent_perms(str(tmp_path / "a"))
    assert (tmp_path / "a").is_dir()
