"""rosout: the node that collects all log messages neither blocks the master nor exhausts its memory."""

from __future__ import annotations

import asyncio
import socket
from functools import partial
from io import BytesIO
from types import SimpleNamespace
from typing import Any

import pytest
from rosgraph_msgs.msg import Log

from minirospy.base.environment import Environment
from minirospy.base.steps import Steps, finish
from minirospy.core.wire.framing import serialize_frame
from minirospy.ros.rosout import node as rosout
from minirospy.ros.rosout.node import RosoutNode
from minirospy.runtime.rpc.turns import Turns
from minirospy.runtime.transport.readers import watch_frames_in_turns


def body_of(text: str, name: str = "/talker") -> bytes:
    buffer = BytesIO()
    Log(level=Log.INFO, name=name, msg=text, file="f.py", line=7, function="g").serialize(buffer)
    return buffer.getvalue()


class Link:
    """A subscriber to /rosout_agg."""

    def __init__(self, waiting: int) -> None:
        self.waiting = waiting
        self.sent: list[int] = []

    def send(self, frame: bytes) -> None:
        self.sent.append(len(frame))


def make_node(links: list[Link] | None = None) -> Any:
    node: Any = RosoutNode(Environment.read({}), None, lambda: False)
    node._log_class = Log
    node._aggregated = SimpleNamespace(links=links or [])
    return node


def test_subscriber_that_does_not_read_gets_no_large_messages() -> None:
    links = [Link(0), Link(99), Link(100), Link(1000)]
    node = make_node(links)
    for size in (16 * 1024, 16 * 1024 + 1):
        finish(node.on_message(b"x" * (size - 4), {}))
    assert [len(link.sent) for link in links] == [2, 2, 1, 1]
    assert links[3].sent == [16 * 1024]


def test_many_subscribers_get_a_message_in_steps() -> None:
    links = [Link(0) for _ in range(50)]
    assert sum(1 for _ in make_node(links).on_message(b"x", {})) == 50
    assert all(link.sent for link in links)


def test_long_text_is_written_in_steps() -> None:
    lines: list[str] = []
    node = make_node()
    node._file = SimpleNamespace(text=lines.append)
    text = "\x1b[1m\n\t" * 10_000
    steps = node.on_message(body_of(text, "/a\nb"), {})
    # Escaping each control character in a string takes some 0.5 us.
    assert sum(1 for _ in steps) >= len(text) // rosout.STEP_LETTERS
    assert lines == [
        f"0.000000000 INFO /a\\nb [f.py:7(g)] [topics: ] {text.replace(chr(27), chr(92) + 'x1b')}"
    ]


def test_text_that_is_not_a_log_message_is_not_written() -> None:
    lines: list[str] = []
    node = make_node()
    node._file = SimpleNamespace(text=lines.append)
    finish(node.on_message(b"x", {}))
    assert lines == []


def test_message_that_is_left_out_is_one_warning_with_the_node(caplog: pytest.LogCaptureFixture) -> None:
    node = make_node()
    for _ in range(3):
        node._on_left_out({"callerid": "/talk\ner"})
    node._limited_log.close()
    first, *others = caplog.records
    assert first.levelname == "WARNING"
    assert first.message == "a log message of /talk\\ner was left out: it is longer than 256 KiB"
    # Each is counted, even if ten seconds have passed between two of them.
    assert others


def test_publishers_are_read_in_turns() -> None:
    left_out: list[int] = []

    async def scene() -> tuple[list[bytes], int]:
        turns, loop = Turns(seconds=0.0), asyncio.get_running_loop()
        found: list[bytes] = []
        ended = asyncio.Event()
        left = 2

        def deliver(frame: memoryview) -> Steps[None]:
            found.append(bytes(frame))
            yield None

        def end() -> None:
            nonlocal left
            left -= 1
            if not left:
                ended.set()

        ends = [socket.socketpair() for _ in range(2)]
        for number, (ours, theirs) in enumerate(ends):
            ours.setblocking(False)
            theirs.sendall(serialize_frame(b"%d" % number) * 20 + serialize_frame(b"x" * 5000))
            theirs.sendall(serialize_frame(b"last"))
            theirs.close()
            watch_frames_in_turns(
                loop, ours, deliver, end, turns.start, 4000, partial(left_out.append, number)
            )
        await asyncio.wait_for(ended.wait(), 30)
        assert all(ours.fileno() < 0 for ours, _ in ends)
        return found, len(turns)

    found, left = asyncio.run(scene())
    assert left == 0
    assert sorted(left_out) == [0, 1]
    assert found.count(b"last") == 2
    assert len(found) == 42
    # Neither waits until the other one is done.
    assert set(found[:4]) == {b"0", b"1"}
