"""A process at its limit of threads or open files logs one clear line, does not spin, and continues once the limit permits."""

from __future__ import annotations

import asyncio
import errno
import logging
import subprocess
import sys
import threading
from collections.abc import Callable, Coroutine, Iterator
from typing import Any

import pytest

from minirospy.base.environment import Environment
from minirospy.base.errors import CallFailed, MasterUnreachableError, ROSException, ThreadLimitError
from minirospy.core.wire.framing import Frame
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.runtime.node.node import Node
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.node.service_client import ServiceClient
from minirospy.runtime.transport import tcp
from minirospy.runtime.transport.limits import explain, naming_thread_limit
from minirospy.runtime.transport.loop import LoopThread, new_event_loop
from minirospy.runtime.transport.workers import InOrder, Workers
from tests.waiting import until

STRING = InterfaceType("std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1", "string data\n")


class Limit:
    """Prevents threads from starting while ``is_reached`` is set."""

    def __init__(self, start: Callable[[threading.Thread], None]) -> None:
        self.is_reached = False
        self.refused = threading.Event()
        self._start = start

    def start(self, thread: threading.Thread) -> None:
        if self.is_reached:
            self.refused.set()
            raise RuntimeError("can't start new thread")
        self._start(thread)


@pytest.fixture
def limit(monkeypatch: pytest.MonkeyPatch) -> Iterator[Limit]:
    found = Limit(threading.Thread.start)
    monkeypatch.setattr(threading.Thread, "start", lambda thread: found.start(thread))  # noqa: PLW0108 - bound to the thread
    yield found
    found.is_reached = False


@pytest.fixture
def loop() -> Iterator[LoopThread]:
    thread = LoopThread()
    yield thread
    thread.close()


def started(loop: LoopThread, master: str, name: str) -> Node:
    node = Node(name, Environment.read({"ROS_MASTER_URI": master, "ROS_IP": "127.0.0.1"}))
    loop.run(node.start())
    return node


def test_a_python_that_starts_no_threads_at_its_end_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def start(_: threading.Thread) -> None:
        raise RuntimeError("can't create new thread at interpreter shutdown")

    monkeypatch.setattr(threading.Thread, "start", start)
    with pytest.raises(ThreadLimitError, match=r"^Python 3\.12\.0 to 3\.12\.2 .*: use 3\.12\.3 or later$"):
        Workers().start(print)


def test_a_thread_over_the_limit_is_a_ros_exception_that_names_it(limit: Limit) -> None:
    limit.is_reached = True
    with pytest.raises(
        ROSException, match=r"no more threads for this process, which has \d+.*: raise the limit"
    ):
        Workers().start(print)
    with pytest.raises(ThreadLimitError):
        LoopThread()


def test_a_subscription_at_the_thread_limit_connects_when_there_is_room(
    limit: Limit, loop: LoopThread, master: str, caplog: pytest.LogCaptureFixture
) -> None:
    publisher, subscriber = started(loop, master, "/publisher"), started(loop, master, "/subscriber")
    publication = Publication("/t", STRING, latch=True)
    publication.publish(b"\x06\0\0\0\x02\0\0\0hi")
    arrived = threading.Event()
    received: list[bytes] = []

    def deliver(frame: Frame, _: object) -> None:
        received.append(bytes(frame))
        arrived.set()

    limit.is_reached = True
    subscription = subscriber.make_subscription("/t", STRING, deliver)
    loop.run(publisher.advertise(publication))
    loop.run(subscriber.subscribe(subscription))
    assert limit.refused.wait(30)
    limit.is_reached = False
    assert arrived.wait(30)
    assert received == [b"\x02\0\0\0hi"]
    (line,) = {record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING}
    assert line.startswith("messages of /t are not received: the system starts no more threads")
    for node in (subscriber, publisher):
        loop.run(node.close())


def test_a_service_call_at_the_thread_limit_is_answered_with_the_reason(
    limit: Limit, loop: LoopThread, master: str
) -> None:
    node = started(loop, master, "/node")
    loop.run(
        node.serve(node.make_service("/s", STRING, lambda *_: b"", request_type="a/B", response_type="a/C"))
    )
    limit.is_reached = True
    client = ServiceClient(node.service_uri, "/s", STRING.md5sum, "/client")
    with pytest.raises(CallFailed, match="no more threads"):
        client.call(b"")
    client.close()
    limit.is_reached = False
    client = ServiceClient(node.service_uri, "/s", STRING.md5sum, "/client")
    assert client.call(b"") == b""
    client.close()
    loop.run(node.close())


def test_callbacks_in_order_go_on_after_the_thread_limit(
    limit: Limit, caplog: pytest.LogCaptureFixture
) -> None:
    called: list[int] = []
    done = threading.Event()
    in_order = InOrder(Workers())
    limit.is_reached = True
    in_order.start(called.append, 1)
    limit.is_reached = False
    in_order.start(called.append, 2)
    in_order.start(done.set)
    assert done.wait(30)
    assert called == [1, 2]
    assert "a callback is late: the system starts no more threads" in caplog.text


def test_other_runtime_errors_keep_their_type() -> None:
    class PythonFinalizationError(RuntimeError):
        """Represents the exception that Python 3.13 has."""

    def finalize() -> None:
        with naming_thread_limit():
            raise PythonFinalizationError

    with pytest.raises(PythonFinalizationError):
        finalize()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="a limit of memory that stacks count for")
def test_a_subscriber_beyond_a_real_limit(master: str) -> None:
    script = """
import resource, threading, rospy
from std_msgs.msg import String
rospy.init_node("node")
rospy.Publisher("/before", String, queue_size=1)
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
threading.stack_size(2**30)
resource.setrlimit(resource.RLIMIT_AS, (used + 2**29, used + 2**29))
try:
    rospy.Subscriber("/t", String, print)
except rospy.ROSException as error:
    print(error)
threading.stack_size(0)
rospy.Subscriber("/t", String, print)
print("subscribed")
rospy.signal_shutdown("done")
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.stderr == ""

    first, second = done.stdout.splitlines()
    assert first.startswith("the system starts no more threads for this process, which has ")
    assert "ulimit -v: " in first
    assert second == "subscribed"


def run(scene: Callable[[], Coroutine[Any, Any, None]]) -> None:
    loop = new_event_loop()
    try:
        loop.run_until_complete(asyncio.wait_for(scene(), 30))
    finally:
        loop.close()


class Full:
    """A listening socket whose accept() fails while ``is_full`` is set."""

    def __init__(self, sock: Any) -> None:
        self._sock = sock
        self.is_full = True
        self.tries = 0

    def accept(self) -> Any:
        self.tries += 1
        if self.is_full:
            raise OSError(errno.EMFILE, "Too many open files")
        return self._sock.accept()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._sock, name)


def test_a_listener_without_file_descriptors_pauses_and_goes_on(caplog: pytest.LogCaptureFixture) -> None:
    accepted: list[str] = []

    async def accept(sock: Any, address: str) -> None:
        accepted.append(address)
        sock.close()

    async def scene() -> None:
        sock = Full(tcp.bind("127.0.0.1"))
        listener = tcp.Listener(accept)
        listener.listen(sock)  # type: ignore[arg-type]
        loop = asyncio.get_running_loop()
        paused = asyncio.Event()
        call_later = loop.call_later

        def count(delay: float, *args: Any, **kwargs: Any) -> Any:
            if delay == 0.05:
                paused.set()
            return call_later(delay, *args, **kwargs)

        loop.call_later = count  # type: ignore[method-assign]
        peer = await tcp.connect("127.0.0.1", sock.getsockname()[1])
        await paused.wait()
        assert sock.tries == 1
        sock.is_full = False
        await until(lambda: accepted)
        peer.close()
        await listener.close()

    run(scene)
    assert "a connection could not be accepted: this process has no file descriptor left" in caplog.text


def test_lack_of_sockets_is_not_reported_as_an_absent_master(
    master: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def fail(*_: Any) -> None:
        return None

    async def scene() -> None:
        node = Node("/node", Environment.read({"ROS_MASTER_URI": master, "ROS_IP": "127.0.0.1"}))
        await node.start()

        def no_socket(*_: Any) -> Any:
            raise OSError(errno.EMFILE, "Too many open files")

        with monkeypatch.context() as patch:
            patch.setattr("minirospy.runtime.rpc.async_client.local.reach", lambda *_: None)
            patch.setattr("minirospy.runtime.rpc.async_client.socket.socket", no_socket)
            with pytest.raises(
                MasterUnreachableError, match="cannot be called: this process has no file desc"
            ):
                await node.advertise(Publication("/t", STRING))
        await node.close()

    run(scene)


def test_a_file_limit_is_explained() -> None:
    assert "ulimit -n" in explain(OSError(errno.EMFILE, "Too many open files"))
    assert "fs.file-max" in explain(OSError(errno.ENFILE, "Too many open files in system"))
    assert explain(OSError("other")) == "other"
