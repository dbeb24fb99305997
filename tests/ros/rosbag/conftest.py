"""A node that publishes, and `rosbag record` and `play` as processes."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, NamedTuple

import pytest
from rosbags.rosbag1 import Reader

from minirospy.base.environment import Environment
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.runtime.node.node import Node
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.transport.loop import LoopThread
from tests.waiting import wait_until

STRING = InterfaceType("std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1", "string data\n")
GUARD = 45.0  # seconds after which a program is considered hung; a machine that runs tests may stall


class Recorded(NamedTuple):
    """A message in a bag."""

    topic: str
    callerid: str
    time: int
    body: bytes


def messages(path: Path) -> list[Recorded]:
    """Return a bag's messages in order of time, as read by the library rosbags."""
    with Reader(path) as reader:
        return [
            Recorded(connection.topic, connection.ext.callerid or "", time, body)  # type: ignore[union-attr]
            for connection, time, body in reader.messages()
        ]


class Talker:
    """A node that publishes strings."""

    def __init__(self, name: str) -> None:
        self.loop = LoopThread(name)
        self.node = Node(f"/{name}", Environment.read())
        self.loop.run(self.node.start())

    def advertise(self, topic: str, *, latch: bool = False, type_: InterfaceType = STRING) -> Publication:
        """Advertise a topic."""
        publication = Publication(topic, type_, latch=latch)
        self.loop.run(self.node.advertise(publication))
        return publication

    def close(self) -> None:
        """Shut down the node."""
        self.loop.run(self.node.close())
        self.loop.close()


def say(publication: Publication, text: str | bytes) -> None:
    """Publish a string."""
    data = text if isinstance(text, bytes) else text.encode()
    body = len(data).to_bytes(4, "little") + data
    publication.publish(len(body).to_bytes(4, "little") + body)


def said(body: bytes) -> str:
    """Return the string in a serialized message."""
    return body[4:].decode()


def connected(publication: Publication) -> None:
    """Wait for a subscriber."""
    wait_until(lambda: publication.links)


@pytest.fixture
def talker(master: str) -> Iterator[Talker]:
    """Yield the node /talker."""
    talker = Talker("talker")
    try:
        yield talker
    finally:
        talker.close()


Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Return a function that starts `rosbag record` or `play` in tmp_path; its output is line-buffered text."""
    started: list[subprocess.Popen[str]] = []

    def start(verb: str, *words: str, prelude: str = "", **kwargs: int) -> subprocess.Popen[str]:
        code = f"import sys\n{prelude}\nfrom minirospy.ros.rosbag.commands.rosbag_{verb} import main\nsys.exit(main())"
        streams = {
            "stdin": subprocess.DEVNULL,
            "stdout": subprocess.PIPE,
            "stderr": subprocess.PIPE,
            **kwargs,
        }
        process = subprocess.Popen(  # type: ignore[call-overload]
            [sys.executable, "-c", code, *words],
            cwd=tmp_path,
            text=True,
            env={**os.environ, "ROSCONSOLE_FORMAT": "${message}"},
            **streams,
        )
        started.append(process)
        return process  # type: ignore[no-any-return]

    yield start
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()


def read_until(process: subprocess.Popen[str], text: str, stream: IO[str] | None = None) -> None:
    """Read a program's output up to the line that contains this text."""
    stream = stream or process.stdout
    assert stream
    for line in stream:
        if text in line:
            return
    raise AssertionError(process.communicate()[1])
