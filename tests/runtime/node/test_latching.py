"""runtime/node/publication: a latched message and a subscriber that joins at the same moment."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from minirospy.core.wire.framing import serialize_frame
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.transport.loop import LoopThread

STRING = InterfaceType("std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1", "string data\n")
# Seconds for which the other thread may run in between. It uses all of them if it waits for a lock.
MEANWHILE = 0.3


class Interrupted(Publication):
    """A latched publication that lets another thread run in the middle of publish() and of accept()."""

    when_latched: Callable[[], None] | None = None
    when_linked: Callable[[], None] | None = None

    def __setattr__(self, name: str, value: Any) -> None:
        super().__setattr__(name, value)
        if name == "_latched" and self.when_latched:
            self.when_latched()
        if name == "links" and value and self.when_linked:
            self.when_linked()


@pytest.fixture
def loop() -> Iterator[LoopThread]:
    thread = LoopThread("test-loop")
    yield thread
    thread.close()


@contextlib.contextmanager
def subscriber(
    loop: LoopThread, publication: Publication
) -> Iterator[tuple[Callable[[], None], socket.socket]]:
    """Return a function that connects a subscriber, and the socket from which the subscriber reads."""
    ours, theirs = socket.socketpair()
    ours.setblocking(False)
    fields = {"callerid": "/s", "topic": "/t", "type": STRING.name, "md5sum": STRING.md5sum}

    async def accept() -> None:
        assert publication.accept(ours, fields, "/p", "peer") is None

    with theirs:
        theirs.settimeout(30)
        yield lambda: loop.run(accept()), theirs
        loop.run(_closed(publication))


async def _closed(publication: Publication) -> None:
    publication.close()


def start(function: Callable[[], None]) -> threading.Thread:
    """Start a thread, and let it run for a moment."""
    thread = threading.Thread(target=function)
    thread.start()
    thread.join(MEANWHILE)
    return thread


def frames(sock: socket.socket, last: bytes) -> list[bytes]:
    """Return the bodies of the messages after the header, up to ``last``."""
    file = sock.makefile("rb")
    file.read(int.from_bytes(file.read(4), "little"))
    found: list[bytes] = []
    while not found or found[-1] != last:
        found.append(file.read(int.from_bytes(file.read(4), "little")))
    return found


def publish(publication: Publication, body: bytes) -> None:
    publication.publish(serialize_frame(body))


def test_subscriber_that_joins_during_a_publish_gets_the_message_once(loop: LoopThread) -> None:
    publication = Interrupted("/t", STRING, latch=True)
    threads: list[threading.Thread] = []
    with subscriber(loop, publication) as (join, sock):
        publication.when_latched = lambda: threads.append(start(join))
        publish(publication, b"one")
        publication.when_latched = None
        threads[0].join(30)
        publish(publication, b"end")
        assert frames(sock, b"end") == [b"one", b"end"]


def test_publish_while_a_subscriber_joins_sends_the_message_once_and_last(loop: LoopThread) -> None:
    publication = Interrupted("/t", STRING, latch=True)
    publish(publication, b"old")
    threads: list[threading.Thread] = []
    with subscriber(loop, publication) as (join, sock):
        publication.when_linked = lambda: threads.append(start(lambda: publish(publication, b"new")))
        join()
        publication.when_linked = None
        threads[0].join(30)
        publish(publication, b"end")
        assert frames(sock, b"end") == [b"old", b"new", b"end"]
