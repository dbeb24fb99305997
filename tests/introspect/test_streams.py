"""introspect/streams: the node of a command-line tool."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import genpy
import pytest
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from minirospy.environment import Environment
from minirospy.introspect.streams import ToolNode
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.wire.framing import Frame
from minirospy.wire.header import Header


@pytest.fixture
def simulated_time(master: str) -> Iterator[ToolNode]:
    """Run a node that latches /clock at 100 s, where /use_sim_time is set."""
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
