"""ros/roslaunch/launcher/registrations: unregisters dead nodes from the master, and keeps live ones."""

from __future__ import annotations

import signal
import socket
import sys
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from minirospy.base.environment import Environment
from minirospy.introspect.graph import Graph, NodeAddress
from minirospy.introspect.nodes import forget_node
from minirospy.ros.roslaunch.launcher import registrations
from minirospy.ros.roslaunch.launcher.registrations import DeadNodes, unregister_dead
from minirospy.runtime.node.node import Node
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.runtime.transport.loop import LoopThread
from tests.conftest import free_port
from tests.ros.roslaunch.conftest import Running, Start
from tests.waiting import wait_until

NODE = """import signal, sys, rospy
from std_msgs.msg import String
from std_srvs.srv import Trigger
rospy.init_node("node")
publisher = rospy.Publisher("~out", String, queue_size=1)
rospy.Subscriber("/common", String, print)
rospy.Service("~trigger", Trigger, print)
if "ignore" in sys.argv:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
sys.stdout.write("ready\\n")
sys.stdout.flush()
signal.pause()
"""


def register(master: str, name: str, uri: str) -> None:
    proxy = MasterProxy(master, name)
    proxy.register_publisher("/common", "std_msgs/String", uri)
    proxy.register_subscriber("/common", "std_msgs/String", uri)
    proxy.register_service(f"{name}/s", uri.replace("http", "rosrpc"), uri)
    proxy.close()


def registered(master: str) -> set[str]:
    """Return the nodes that have a topic or a service."""
    proxy = MasterProxy(master, "/test")
    try:
        return {name for table in proxy.get_system_state() for names in table.values() for name in names}
    finally:
        proxy.close()


def refusing() -> str:
    return f"http://127.0.0.1:{free_port()}/"


@pytest.fixture
def alive(master: str) -> Iterator[Node]:
    loop = LoopThread("node")
    node = Node("/alive", Environment.read({"ROS_MASTER_URI": master, "ROS_IP": "127.0.0.1"}))
    loop.run(node.start())
    yield node
    loop.run(node.close())
    loop.close()


def test_a_node_that_refuses_connections_is_unregistered(master: str, alive: Node) -> None:
    register(master, "/dead", refusing())
    register(master, "/dead2", refusing())
    register(master, "/other", refusing())
    register(master, "/alive", alive.uri)
    assert unregister_dead(master, ["/dead", "/dead2", "/alive", "/absent"]) == ["/dead", "/dead2"]
    assert registered(master) == {"/alive", "/other"}


def test_a_node_whose_port_another_one_has_is_unregistered(master: str, alive: Node) -> None:
    register(master, "/dead", alive.uri)
    register(master, "/dead2", f"http://127.0.0.1:{alive.tcpros_port}/")
    assert unregister_dead(master, ["/dead", "/dead2"]) == ["/dead", "/dead2"]
    assert registered(master) == set()


def test_a_node_that_hangs_stays_registered(master: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registrations, "_ANSWER_SECONDS", 0.1)
    with socket.create_server(("127.0.0.1", 0)) as server:
        register(master, "/hangs", f"http://127.0.0.1:{server.getsockname()[1]}/")
        assert unregister_dead(master, ["/hangs"]) == []
    assert registered(master) == {"/hangs"}


def test_a_new_node_of_the_same_name_stays_registered(master: str) -> None:
    register(master, "/node", old := refusing())
    with Graph(MasterProxy(master, "/test"), "test") as graph:
        state = graph.state()
        # A new node starts between the check of the old one and the calls that unregister it.
        register(master, "/node", refusing())
        forget_node(graph, NodeAddress("/node", old), state)
        after = graph.state()
        assert (after.publishers, after.subscribers, after.services) == (
            {"/common": ["/node"]},
            {"/common": ["/node"]},
            {"/node/s": ["/node"]},
        )


def test_no_master_is_no_error() -> None:
    assert unregister_dead("http://127.0.0.1:1", ["/node"]) == []


def test_close_waits_for_the_nodes_added_before(master: str) -> None:
    names = [f"/node{number}" for number in range(10)]
    for name in names:
        register(master, name, refusing())
    dead = DeadNodes(master)
    for name in names:
        dead.add(name)
    dead.close()
    assert registered(master) == set()
    dead.close()


def process_of(launch: Running, name: str) -> psutil.Process:
    # Check the name, too: another test's roslaunch may have a node with the same name.
    return next(child for child in launch.children() if f"__name:={name}" in child.cmdline())


@pytest.mark.skipif(sys.platform == "win32", reason="signals between processes")
def test_roslaunch_unregisters_a_node_that_was_killed(start: Start, master: str, package: Path) -> None:
    (package / "node.py").write_text(NODE)
    launch = start(
        '<node pkg="pkg" type="node.py" name="killed" output="screen"/><node pkg="pkg" type="wait.py" name="b"/>'
    )
    launch.read_until("ready")
    assert "/killed" in registered(master)
    process_of(launch, "killed").kill()
    wait_until(lambda: "/killed" not in registered(master))
    assert launch.process.poll() is None


@pytest.mark.skipif(sys.platform == "win32", reason="signals between processes")
@pytest.mark.parametrize("number", ["SIGINT", "SIGKILL"])
def test_roslaunch_or_its_guardian_unregisters_the_nodes_it_kills(
    start: Start, master: str, package: Path, number: str
) -> None:
    (package / "node.py").write_text(NODE)
    launch = start(
        '<node pkg="pkg" type="node.py" name="ignores" args="ignore" output="screen"/>',
        "--sigint-timeout=0.1",
        "--sigterm-timeout=0.1",
    )
    launch.read_until("ready")
    node = process_of(launch, "ignores")
    launch.process.send_signal(getattr(signal, number))
    launch.process.wait(30)
    node.wait(30)
    if number == "SIGINT":
        assert "/ignores" not in registered(master)
    wait_until(lambda: "/ignores" not in registered(master))
