"""`minirospy check --share`: the board and the nodes of a student's computer at the class's master."""

from __future__ import annotations

import contextlib
import itertools
import json
import queue
import re
import socket
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from minirospy.base.environment import Environment
from minirospy.base.errors import MasterUnreachableError, RpcRefused
from minirospy.board.board import Board
from minirospy.core.idl.load import message_class
from minirospy.course.results import MAX_KEY, Record, Result, parameter_key, send
from minirospy.course.share import share
from minirospy.introspect.messages import Received
from minirospy.introspect.streams import ToolNode, TopicPublisher
from minirospy.runtime.master.master import Master
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.runtime.transport.loop import LoopThread
from minirospy.web.dashboard.files import FOLDER
from tests.conftest import free_port


def wait_for(holds: Callable[[], bool]) -> None:
    end = time.monotonic() + 60
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_state_of_the_board_is_at_the_master(master: str) -> None:
    environment = Environment.read()
    record = Record.read(environment)
    record.student = "Anna"
    proxy = MasterProxy(master, "/teacher")
    ended = threading.Event()
    sharing = threading.Thread(target=share, args=(record, environment, ended.is_set))
    sharing.start()

    def now() -> dict[str, Any]:
        try:
            found: dict[str, Any] = proxy.get_param("/minirospy_class/Anna/now")
        except RpcRefused:
            return {}
        return found

    try:
        wait_for(lambda: now().get("leds") == "000000")
        first = now()["beat"]
        with Board() as board:
            board.set(7, 1)
            board.press(11)
            wait_for(lambda: (now()["leds"], now()["buttons"]) == ("000001", "10"))
            board.reset()
        assert now()["beat"] > first
        # A result that is sent later leaves the state, and a beat leaves the results.
        send(record, master)
        assert proxy.get_param("/minirospy_class/Anna/student") == "Anna"
        beat = now()["beat"]
        wait_for(lambda: now()["beat"] > beat)
        assert proxy.get_param("/minirospy_class/Anna/student") == "Anna"
    finally:
        ended.set()
        sharing.join()
        proxy.close()


@contextlib.contextmanager
def running_master(port: int) -> Iterator[None]:
    """Run a master at a port."""
    loop = LoopThread("late-master")
    try:
        serving = Master(port=port)
        loop.run(serving.start())
        try:
            yield
        finally:
            loop.run(serving.close(), 30.0)
    finally:
        loop.close()


class Sharing:
    """A thread that runs share(), and its messages on the student's own master."""

    def __init__(self, record: Record) -> None:
        self._ended = threading.Event()
        self._inbox = queue.Queue[Received]()
        self.environment = Environment.read()
        self._node = ToolNode(self.environment, "teacher")
        self._node.measure("/minirospy_class", self._inbox.put)
        self.thread = threading.Thread(target=share, args=(record, self.environment, self._ended.is_set))
        self.thread.start()

    def message(self, holds: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Return the first message for which ``holds`` is true."""
        end = time.monotonic() + 60
        while time.monotonic() < end:
            message: Any = self._node.classes.read(self._inbox.get(timeout=60))
            found: dict[str, Any] = json.loads(message.data)
            if holds(found):
                return found
        raise AssertionError("no message arrived for which it holds")

    def close(self) -> None:
        self._ended.set()
        self.thread.join()
        self._node.close()


@pytest.fixture
def share_as() -> Iterator[Callable[[Record], Sharing]]:
    with contextlib.ExitStack() as stack:
        yield lambda record: stack.enter_context(contextlib.closing(Sharing(record)))


def test_topic_has_the_results_the_board_and_the_nodes(
    master: str, share_as: Callable[[Record], Sharing]
) -> None:
    record = Record.read(Environment.read())
    record.student = "Jörg"
    sharing = share_as(record)
    first = sharing.message(lambda found: True)
    assert (first["key"], first["student"], first["exercises"]) == (parameter_key("Jörg"), "Jörg", {})
    assert first["now"]["leds"] == "000000"
    with Board() as board:
        board.set(2, 1)
        found = sharing.message(lambda found: found["now"]["leds"] == "100000")
        board.reset()
    # The node that publishes the topic is not a student's.
    assert not any("check_share" in name for name in found["now"]["nodes"])

    # A check that ends in another terminal stores its result in the file.
    stored = Record.read(sharing.environment)
    stored.results = {"count": Result(passed=True, time=1.0, ever=True)}
    stored.write()
    found = sharing.message(lambda found: "count" in found["exercises"])
    assert found["exercises"]["count"]["ever"]
    assert found["student"] == "Jörg"


def test_rosnode_kill_ends_the_sharing(master: str, share_as: Callable[[Record], Sharing]) -> None:
    sharing = share_as(Record.read(Environment.read()))
    sharing.message(lambda found: True)
    with contextlib.closing(MasterProxy(master, "/killer")) as proxy:
        publishers = dict(proxy.get_system_state()[0])["/minirospy_class"]
        [uri] = [proxy.lookup_node(name) for name in publishers]
    with contextlib.closing(MasterProxy(uri, "/killer")) as node:
        node.call("shutdown", "test")
    sharing.thread.join(60)
    assert not sharing.thread.is_alive()


class Anna:
    """A thread that runs share() as Anna, and her heartbeats at the class's master."""

    def __init__(self, class_master: str) -> None:
        self._ended = threading.Event()
        self._class = MasterProxy(class_master, "/teacher")
        environment = Environment.read()
        record = Record.read(environment)
        record.student, record.master = "Anna", class_master
        self._thread = threading.Thread(target=share, args=(record, environment, self._ended.is_set))
        self._thread.start()

    def wait_for_beat(self, number: int) -> None:
        """Wait until a heartbeat with this number, or a later one, has arrived."""
        beat = "/minirospy_class/Anna/now/beat"
        wait_for(lambda: beat in self._class.get_param_names() and self._class.get_param(beat) >= number)

    def stop(self) -> None:
        self._ended.set()
        self._thread.join()

    def close(self) -> None:
        self.stop()
        self._class.close()


@pytest.fixture
def anna_with(master: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str], Anna]]:
    """Return a function that starts Anna's thread on a computer with its own master at the given URI."""
    with contextlib.ExitStack() as stack:

        def start(uri: str) -> Anna:
            monkeypatch.setenv("ROS_MASTER_URI", uri)
            return stack.enter_context(contextlib.closing(Anna(master)))

        yield start


def test_class_master_suffices_without_an_own_one(anna_with: Callable[[str], Anna]) -> None:
    anna_with("http://localhost:1").wait_for_beat(1)


def test_topic_appears_when_the_own_master_starts_later(anna_with: Callable[[str], Anna]) -> None:
    port = free_port()
    anna = anna_with(f"http://localhost:{port}")
    anna.wait_for_beat(3)
    with running_master(port), ToolNode(Environment.read(), "teacher") as node:
        inbox: queue.Queue[Received] = queue.Queue()
        node.measure("/minirospy_class", inbox.put)
        message: Any = node.classes.read(inbox.get(timeout=60))
        assert json.loads(message.data)["student"] == "Anna"
        # Her node unregisters from this master, which must still run.
        anna.stop()


def test_silent_own_master_does_not_block_the_class(
    anna_with: Callable[[str], Anna], monkeypatch: pytest.MonkeyPatch
) -> None:
    created: list[str] = []
    monkeypatch.setattr("minirospy.course.share.ToolNode", lambda _, tool: created.append(tool))
    # The system accepts connections for a socket that listens, but nothing answers.
    with socket.create_server(("localhost", 0)) as silent:
        anna = anna_with(f"http://localhost:{silent.getsockname()[1]}")
        anna.wait_for_beat(2)
        anna.stop()
    # A node would wait for the master for much longer.
    assert not created


def test_nodes_of_other_students_at_the_same_master_are_left_out(
    master: str, share_as: Callable[[Record], Sharing]
) -> None:
    environment = Environment.read()
    with ToolNode(environment, "check_share") as other:
        other.publisher("/minirospy_class", message_class("std_msgs/String"), latch=True)
        record = Record.read(environment)
        record.student = "Anna"
        found = share_as(record).message(lambda found: found["student"] == "Anna")
    names = found["now"]["nodes"]
    assert len(names) == 1
    assert names[0].startswith("/teacher_")


class Blinking:
    """A board whose first LED changes at each turn, and the clock of share(), which advances only while it sleeps."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self.turns = 0

    def __enter__(self) -> Blinking:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def get(self, pin: int) -> int:
        return self.turns % 2 if pin == 2 and self.turns < 12 else 0

    def monotonic(self) -> float:
        return self.seconds

    def sleep(self, seconds: float) -> None:
        self.seconds += seconds
        self.turns += 1


@pytest.fixture
def blinking(monkeypatch: pytest.MonkeyPatch) -> Blinking:
    found = Blinking()
    monkeypatch.setattr("minirospy.course.share.Board", lambda: found)
    monkeypatch.setattr("minirospy.course.share.time", found)
    return found


def test_topic_has_at_most_one_message_per_second(
    master: str, blinking: Blinking, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent: list[tuple[float, str]] = []

    def publish(_: TopicPublisher, message: Any) -> None:
        sent.append((blinking.seconds, json.loads(message.data)["now"]["leds"]))

    monkeypatch.setattr(TopicPublisher, "publish", publish)
    share(Record.read(Environment.read()), Environment.read(), lambda: blinking.seconds > 4)
    times = [seconds for seconds, _ in sent]
    assert times[0] == 0
    assert all(later - earlier > 0.99 for earlier, later in itertools.pairwise(times))
    # The state after the last change is sent without waiting for the next heartbeat.
    assert [leds for seconds, leds in sent if seconds > 2.3] == ["000000"]


def test_unreachable_class_master_is_asked_once_for_each_state(
    master: str, blinking: Blinking, monkeypatch: pytest.MonkeyPatch
) -> None:
    blinking.turns = 12  # nothing changes
    tried: list[float] = []

    def set_param(*_: object) -> None:
        tried.append(blinking.seconds)
        raise MasterUnreachableError(master, "test")

    monkeypatch.setattr(MasterProxy, "set_param", set_param)
    share(Record.read(Environment.read()), Environment.read(), lambda: blinking.seconds > 4)
    assert len(tried) == 2
    assert tried[1] >= 3


def test_missing_master_is_an_error() -> None:
    record = Record.read(Environment.read())
    record.master = "http://localhost:1"
    with pytest.raises(MasterUnreachableError):
        share(record, Environment.read(), lambda: True)


def test_names_become_different_parameters() -> None:
    names = ["Anna", "Jörg", "Jürg", "Anna B.", "Anna_B_", "7", "日本"]
    keys = [parameter_key(name) for name in names]
    assert len(set(keys)) == len(names)
    assert keys[0] == "Anna"
    assert all(key.isascii() and key[0].isalpha() and key.replace("_", "a").isalnum() for key in keys)


def test_key_of_a_long_name_fits_the_page() -> None:
    script = (FOLDER / "js" / "classroom.js").read_text(encoding="utf-8")
    found = re.search(r"const NAME = /(\^.*\$)/;", script)
    assert found
    pattern = re.compile(found[1])
    long = ["x" * count for count in range(MAX_KEY - 4, MAX_KEY + 20)]
    names = [*long, "ö" * 100, "7" * 100, "ö" * 99, f"{'x' * 200}a", f"{'x' * 200}b"]
    keys = [parameter_key(name) for name in names]
    assert len(set(keys)) == len(names)
    assert keys[:5] == long[:5]
    assert max(map(len, keys)) == MAX_KEY
    assert all(pattern.match(key) for key in keys)
