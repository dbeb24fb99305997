"""introspect/streams: the node of a command-line tool."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Coroutine, Iterator
from typing import Any
from urllib.parse import urlsplit

import genpy
import pytest
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from minirospy.base.clock import WallClock
from minirospy.base.environment import Environment
from minirospy.core.wire.framing import Frame
from minirospy.core.wire.header import Header
from minirospy.introspect.doctor.own_node import DoctorNode
from minirospy.introspect.streams import Inbox, ToolNode
from minirospy.runtime.node.node import Node
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.runtime.transport.loop import LoopThread
from tests.interruption import ends_elsewhere, interrupt_in_lock


@pytest.fixture
def simulated_time(master: str) -> Iterator[ToolNode]:
    """Run a node that latches 100 s on /clock, with /use_sim_time set."""
    proxy = MasterProxy(master, "/test")
    proxy.set_param("/use_sim_time", True)
    proxy.close()
    with ToolNode(Environment.read(), "clock") as node:
        node.publisher("/clock", Clock, latch=True).publish(Clock(genpy.Time(100)))
        yield node


@pytest.mark.usefixtures("simulated_time")
def test_late_listener_gets_the_latched_message_once() -> None:
    bodies: list[bytes] = []
    arrived = threading.Event()

    def deliver(body: Frame, _: Header) -> None:
        bodies.append(bytes(body))
        arrived.set()

    with ToolNode(Environment.read(), "tool", ros_time=True) as node:
        while not node.clock.now():
            node.wait(0.005)
        node.listen("/clock", deliver)
        assert arrived.wait(30)
    assert bodies == [(100).to_bytes(4, "little") + bytes(4)]


def test_clock_of_another_type_is_ignored(master: str) -> None:
    proxy = MasterProxy(master, "/test")
    proxy.set_param("/use_sim_time", True)
    proxy.close()
    arrived = threading.Event()

    with ToolNode(Environment.read(), "clock") as other:
        other.publisher("/clock", String, latch=True).publish(String("not a time"))
        with ToolNode(Environment.read(), "tool", ros_time=True) as node:
            node.listen("/clock", lambda *_: arrived.set())
            assert arrived.wait(30)
            assert node.clock.now() == 0


@pytest.mark.usefixtures("master")
@pytest.mark.parametrize(
    "starts",
    [
        pytest.param(lambda: ToolNode(Environment.read(), "tool"), id="a command's"),
        pytest.param(lambda: DoctorNode(Environment.read()).__enter__(), id="the doctor's"),
    ],
)
def test_a_node_that_is_interrupted_as_it_starts_is_closed(
    starts: Callable[[], object], monkeypatch: pytest.MonkeyPatch
) -> None:
    nodes: list[Node] = []
    start, run = Node.start, LoopThread.run

    async def started(node: Node) -> None:
        await start(node)
        nodes.append(node)

    def interrupted(thread: LoopThread, coroutine: Coroutine[object, object, Any]) -> Any:
        is_first = not nodes
        outcome = run(thread, coroutine)
        if is_first:
            raise KeyboardInterrupt
        return outcome

    with monkeypatch.context() as patched:
        patched.setattr(Node, "start", started)
        patched.setattr(LoopThread, "run", interrupted)
        with pytest.raises(KeyboardInterrupt):
            starts()
    address = urlsplit(nodes[0].uri)
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((address.hostname or "", address.port or 0), timeout=30)


INTERRUPTED = """
import sys, threading
from minirospy.base.environment import Environment
from minirospy.introspect.streams import ToolNode

node = ToolNode(Environment.read(), "interrupted")

def interrupt(frame, event, _):
    # Ctrl-C between the acquisition of a lock and the start of its `with` block leaves the lock acquired.
    if event == "return" and frame.f_code.co_name == "__enter__" and frame.f_code.co_filename == threading.__file__:
        sys.setprofile(None)
        raise KeyboardInterrupt

sys.setprofile(interrupt)
try:
    node.wait(0.01)
except KeyboardInterrupt:
    pass
sys.setprofile(None)
node.close()
"""


def test_ctrl_c_at_any_point_of_a_wait_does_not_hang_the_close(master: str) -> None:
    subprocess.run([sys.executable, "-c", INTERRUPTED], check=True, timeout=100)


def test_ctrl_c_at_any_point_of_reading_an_inbox_does_not_hang_its_writer() -> None:
    inbox = Inbox(WallClock())
    inbox.put(b"first", {})
    interrupt_in_lock(lambda: next(iter(inbox)))
    assert ends_elsewhere(lambda: inbox.put(b"second", {}))
    assert ends_elsewhere(inbox.close)
