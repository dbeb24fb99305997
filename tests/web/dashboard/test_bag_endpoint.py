"""Bags over WebSocket: opening, seeking, publishing, recording."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import pytest
from std_msgs.msg import String
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from minirospy.base.errors import BagFormatError
from minirospy.core.bag.timeline import Timeline
from minirospy.ros.rosbag.recording.sources import Bags
from minirospy.ros.roslaunch.launcher.process import Process, Timeouts, start_process
from minirospy.web.access import Access
from minirospy.web.dashboard import bag_endpoint, recording
from minirospy.web.dashboard.bag_endpoint import SUBPROTOCOL, BagSession
from minirospy.web.dashboard.bag_folder import BagFolder
from minirospy.web.dashboard.bag_player import OpenBag
from minirospy.web.dashboard.recording import Recording
from tests.waiting import wait_until
from tests.web.dashboard.bags import make_bag, text_body
from tests.web.dashboard.conftest import TOKEN

if TYPE_CHECKING:
    from tests.web.dashboard.conftest import Served


class Client:
    """A page's connection."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket

    def send(self, op: str, **fields: object) -> None:
        self.socket.send(json.dumps({"op": op, **fields}))

    def next(self, name: str, accepts: Callable[[Any], bool] = lambda _: True) -> Any:
        """Return the next value with this name that ``accepts`` accepts."""
        while True:
            data = self.socket.recv(timeout=60)
            if isinstance(data, bytes):
                continue
            found = json.loads(data)
            if name in found and accepts(found[name]):
                return found[name]
            assert "error" not in found, found

    def error(self) -> str:
        """Return the next error."""
        while True:
            data = self.socket.recv(timeout=60)
            if isinstance(data, str) and "error" in (found := json.loads(data)):
                return str(found["error"])

    def binary(self, kind: int, body: bytes) -> float:
        """Wait for a binary message of this kind with these bytes; return its time."""
        while True:
            data = self.socket.recv(timeout=60)
            if isinstance(data, bytes) and data[0] == kind and data[11:] == body:
                (found,) = struct.unpack_from("<d", data, 3)
                return float(found)
            assert isinstance(data, bytes) or "error" not in json.loads(data), data


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def client(serve: Callable[..., Served], folder: Path) -> Iterator[Callable[..., Client]]:
    with contextlib.ExitStack() as opened:

        def start(served: Served | None = None, token: str = TOKEN) -> Client:
            names = [Subprotocol(SUBPROTOCOL)] + ([Subprotocol(f"minirospy.token.{token}")] if token else [])
            address = f"ws://127.0.0.1:{(served or serve()).port}/"
            socket = connect(address, subprotocols=names, compression=None, open_timeout=100, max_size=None)
            return Client(opened.enter_context(socket))

        yield start


def test_bag_is_listed_and_opened(client: Callable[..., Client], folder: Path) -> None:
    make_bag(folder / "a.bag")
    page = client()
    page.send("list")
    ((name, size, _),) = page.next("files")
    assert (name, size) == ("a.bag", (folder / "a.bag").stat().st_size)
    page.send("open", name="a.bag")
    bag = page.next("bag")
    assert bag["length"] == pytest.approx(19.9)
    assert [(each[0], each[2], each[4]) for each in bag["topics"]] == [
        ("/camera", 40, False),
        ("/chatter", 200, False),
        ("/map", 1, True),
    ]
    page.send("density", start=0, end=9.9999, bins=10)
    rows = page.next("density")["rows"]
    assert rows["/chatter"] == [10] * 10
    assert rows["/camera"] == [2] * 10
    assert rows["/map"] == [1, *[0] * 9]


def test_topics_of_an_open_bag_are_exported_into_the_folder(
    client: Callable[..., Client], folder: Path
) -> None:
    (folder / "sub").mkdir()
    make_bag(folder / "sub" / "a.bag")
    page = client()
    page.send("export", topics=["/chatter"], format="csv")
    assert "no bag is open" in page.error()
    page.send("open", name="sub/a.bag")
    page.send("export", topics=["/chatter", "/camera"], format="csv")
    assert page.next("exported") == [["a_chatter.csv", 200, 2, []], ["a_camera.csv", 40, 9, ["data"]]]
    assert (folder / "a_chatter.csv").read_text(encoding="utf-8").splitlines()[1].endswith(",message 0")
    for fields, why in (
        ({"topics": ["/chatter"], "format": "csv"}, "a_chatter.csv exists already"),
        ({"topics": ["/map"], "format": "xls"}, "the format is csv or parquet"),
        ({"topics": [], "format": "csv"}, "no topic is chosen"),
    ):
        page.send("export", **fields)
        assert why in page.error()


def test_any_fault_of_an_export_is_answered(
    client: Callable[..., Client], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise OverflowError("int too\nbig")

    monkeypatch.setattr("minirospy.web.dashboard.bag_endpoint.export", fail)
    make_bag(folder / "a.bag")
    page = client()
    page.send("open", name="a.bag")
    page.send("export", topics=["/chatter"], format="csv")
    assert page.error() == "a.bag: OverflowError: int too big"


def test_series_and_their_progress_are_sent(client: Callable[..., Client], folder: Path) -> None:
    make_bag(folder / "a.bag")
    page = client()
    page.send("fields", name="a.bag")
    assert [each[0] for each in page.next("fields")["topics"]] == ["/camera", "/chatter", "/map"]
    series = [{"key": "k", "bag": "a.bag", "path": "/camera/width"}]
    page.send("series", id=7, start=None, end=None, columns=100, series=series)
    answer = page.next("series")
    assert (answer["id"], answer["errors"], answer["found"][0]["count"]) == (7, {}, 40)
    page.send("series", id=8, columns=100, series="x")
    assert "series is a list" in page.error()


def test_moment_follows_seek_step_and_back(client: Callable[..., Client], folder: Path) -> None:
    make_bag(folder / "a.bag")
    page = client()
    page.send("open", name="a.bag")
    page.send("show", topics=["/chatter"])
    page.binary(1, text_body("message 0"))
    page.send("play", seek=5.05)
    assert page.binary(1, text_body("message 50")) == pytest.approx(5.0)
    page.send("step")
    assert page.binary(1, text_body("message 51")) == pytest.approx(5.1)
    page.send("step")
    page.binary(1, text_body("message 52"))
    page.send("back")
    page.binary(1, text_body("message 51"))


def test_playing_runs_to_the_end_and_loops(client: Callable[..., Client], folder: Path) -> None:
    make_bag(folder / "a.bag", 2)
    page = client()
    page.send("open", name="a.bag")
    page.send("play", paused=False, rate=10)
    page.next("state", lambda state: state["ended"] and state["rate"] == 10)
    page.send("play", paused=False, looping=True)
    page.next("state", lambda state: state["looping"] and not state["ended"] and state["time"] > 0.5)
    page.next("state", lambda state: state["time"] < 0.5)
    page.next("state", lambda state: state["time"] > 0.5)
    page.send("play", paused=True)
    page.next("state", lambda state: state["paused"])


def test_thumbnails_are_the_messages_at_their_times(client: Callable[..., Client], folder: Path) -> None:
    make_bag(folder / "a.bag")
    page = client()
    page.send("open", name="a.bag")
    page.send("thumbnails", topic="/chatter", times=[0, 3.33, 100])
    for text in ("message 0", "message 33", "message 199"):
        page.binary(2, text_body(text))


@pytest.mark.parametrize("kind", [".bag", ".mcap"])
def test_mcap_is_shown_like_a_bag(client: Callable[..., Client], folder: Path, kind: str) -> None:
    path = make_bag(folder / "a.bag", 3)
    if kind == ".mcap":
        pytest.importorskip("mcap")
        from minirospy.ros.rosbag.commands.rosbag import main

        assert main(["convert", str(path), str(folder / "b.mcap")]) == 0
    page = client()
    page.send("open", name="b.mcap" if kind == ".mcap" else "a.bag")
    page.send("show", topics=["/chatter"])
    page.send("play", seek=1.25)
    page.binary(1, text_body("message 12"))


subscriptions: list[object] = []  # a subscription ends if nothing refers to it


def listened(served: Served, topic: str) -> list[str]:
    found: list[str] = []
    node = served.node("listener" + topic.replace("/", "_"))

    async def listen() -> None:
        subscriptions.append(
            node.subscribe_raw(topic, lambda frame, _: found.append(bytes(frame)[4:].decode()))
        )

    served.run(listen())
    return found


def test_nothing_is_published_until_that_is_switched_on(
    serve: Callable[..., Served], client: Callable[..., Client], folder: Path
) -> None:
    make_bag(folder / "a.bag", 4)
    served = serve()
    chatter, map_ = listened(served, "/chatter"), listened(served, "/map")
    page = client(served)
    page.send("open", name="a.bag")
    page.send("play", paused=False, rate=4)
    page.next("state", lambda state: state["ended"])
    assert (chatter, map_) == ([], [])
    page.send("publish", topics=["/chatter", "/map"], clock=True)
    page.next("state", lambda state: state["published"] == ["/chatter", "/map"] and state["clock"])
    # The latched message was sent long before, but late subscribers need it.
    wait_until(lambda: map_ == ["the map"])
    # Play slowly until the other subscriber is connected.
    page.send("play", seek=0, paused=False, rate=0.1)
    wait_until(lambda: chatter)
    page.send("play", paused=False, rate=4)
    wait_until(lambda: chatter[-1:] == ["message 39"])
    page.send("publish", topics=[], clock=False)
    page.next("state", lambda state: not state["published"] and not state["clock"])


@pytest.mark.parametrize(
    ("op", "fields", "why"),
    [
        ("open", {"name": "../a.bag"}, "is not the name of a bag"),
        ("open", {"name": "broken.bag"}, "broken.bag"),
        ("open", {"name": 5}, "not an operation on bags"),
        ("open", {}, "not an operation on bags"),
        ("step", {}, "no bag is open"),
        ("play", {"seek": "x"}, "no bag is open"),
        ("fly", {}, "not an operation on bags"),
        (
            "record",
            {"topics": [], "name": "x", "suffix": ".bag", "compression": "none"},
            "at least one topic",
        ),
        (
            "record",
            {"topics": ["/a"], "name": "../x", "suffix": ".bag", "compression": "none"},
            "cannot be the name",
        ),
        (
            "record",
            {"topics": ["-a"], "name": "x", "suffix": ".bag", "compression": "none"},
            "not the name of a topic",
        ),
        ("record", {"topics": ["/a"], "name": "x", "suffix": ".sh", "compression": "none"}, ".bag or .mcap"),
        ("record", {"topics": ["/a"], "name": "x", "suffix": ".bag", "compression": "zip"}, "no compression"),
    ],
)
def test_what_cannot_be_done_is_one_line(
    client: Callable[..., Client], folder: Path, op: str, fields: dict[str, object], why: str
) -> None:
    (folder / "broken.bag").write_bytes(b"#ROSBAG V2.0\n" + b"x" * 100)
    page = client()
    page.send(op, **fields)
    while "error" not in (found := json.loads(page.socket.recv(timeout=60))):
        pass
    assert why in found["error"]
    assert "\n" not in found["error"]


def test_chosen_topics_are_recorded(
    serve: Callable[..., Served], client: Callable[..., Client], folder: Path
) -> None:
    served = serve()
    node = served.node("talker")

    async def talk() -> None:
        for topic in ("/a", "/b"):
            publisher = await node.advertise(topic, String, latch=True)
            await publisher.publish(f"on {topic}")

    served.run(talk())
    page = client(served)
    page.send("record", topics=["/a"], name="run", suffix=".bag", compression="none")
    page.next("recording", lambda found: found and found["name"] == "run.bag" and not found["is_ended"])
    wait_until((folder / "run.bag.active").exists)
    active = folder / "run.bag.active"
    wait_until(lambda: not active.exists() or "/a" in served.run(_subscribed(node)))
    other = client(served)
    other.next("recording", lambda found: found and found["name"] == "run.bag")
    other.send("record", topics=["/a"], name="run2", suffix=".bag", compression="none")
    assert "there is a recording already" in json_error(other)
    page.send("stop")
    done = page.next("recording", lambda found: found and found["is_ended"])
    assert done["error"] == ""
    assert done["size"] == (folder / "run.bag").stat().st_size
    with Bags([str(folder / "run.bag")]) as bags:
        assert {each.topic for each in bags.readers[0].connections.values()} <= {"/a"}


async def _subscribed(node: Any) -> list[str]:
    from minirospy.introspect.snapshot import fetch

    return [topic for topic, nodes in (await fetch(node.call_master)).subscribers.items() if nodes]


def json_error(page: Client) -> str:
    while "error" not in (found := json.loads(page.socket.recv(timeout=60))):
        pass
    return str(found["error"])


def test_recording_is_completed_when_the_dashboard_ends(
    serve: Callable[..., Served], client: Callable[..., Client], folder: Path
) -> None:
    served = serve()
    page = client(served)
    page.send("record", topics=["/a"], name="run", suffix=".bag", compression="lz4")
    wait_until((folder / "run.bag.active").exists)
    assert served.dashboard
    served.run(served.dashboard.close())
    assert (folder / "run.bag").is_file()
    assert os.listdir(folder) == ["run.bag"]


class Gate:
    """Blocks a thread of the dashboard at a certain step until it is opened."""

    def __init__(self) -> None:
        self.reached = threading.Event()
        self.opened = threading.Event()

    def pass_through(self) -> None:
        self.reached.set()
        assert self.opened.wait(60)


@pytest.fixture
def starting(monkeypatch: pytest.MonkeyPatch) -> Gate:
    """Return a gate that blocks recordings while they start."""
    gate = Gate()

    class Slow(Recording):
        def __init__(self, *words: Any) -> None:
            gate.pass_through()
            super().__init__(*words)

    monkeypatch.setattr(bag_endpoint, "Recording", Slow)
    return gate


def test_recording_is_kept_if_its_page_closes_during_its_start(
    serve: Callable[..., Served],
    client: Callable[..., Client],
    folder: Path,
    starting: Gate,
) -> None:
    served = serve()
    assert served.dashboard
    endpoint = served.dashboard.bags
    page = client(served)
    page.send("record", topics=["/a"], name="run", suffix=".bag", compression="none")
    assert starting.reached.wait(60)
    page.socket.close()
    wait_until(lambda: not endpoint.sessions)
    starting.opened.set()
    wait_until(lambda: endpoint.recording is not None)


def test_recorder_that_loses_the_signal_before_it_has_a_file_is_ended(
    tmp_path: Path, master: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = (
        "import signal, time; signal.signal(signal.SIGINT, signal.SIG_IGN); print('up'); time.sleep(600)"
    )

    def ignoring(name: str, command: list[str], **options: Any) -> Process:
        return start_process(name, [sys.executable, "-c", program], **options)

    monkeypatch.setattr(recording, "start_process", ignoring)
    monkeypatch.setattr(recording, "TIMEOUTS_BEFORE_FILE", Timeouts(interrupt=0.1))
    started = Recording(tmp_path / "run.bag", ["/a"], "none", master)
    wait_until(lambda: "up" in started.lines)
    asyncio.run(started.stop())
    assert started.state().error == "it was stopped before it had started: nothing was recorded"


def test_recorder_that_ends_without_a_file_has_saved_nothing(
    tmp_path: Path, master: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = (
        "import signal, sys, time; signal.signal(signal.SIGINT, lambda *_: sys.exit(0));"
        "print('up'); time.sleep(600)"
    )

    def early(name: str, command: list[str], **options: Any) -> Process:
        return start_process(name, [sys.executable, "-c", program], **options)

    monkeypatch.setattr(recording, "start_process", early)
    started = Recording(tmp_path / "run.bag", ["/a"], "none", master)
    wait_until(lambda: "up" in started.lines)
    asyncio.run(started.stop())
    assert started.state().error == "it was stopped before it had started: nothing was recorded"


def test_size_of_a_recording_that_ends_as_it_is_looked_at_is_its_last_one(tmp_path: Path) -> None:
    path = tmp_path / "run.bag"

    class Ending:
        is_ending = True

        @property
        def exit_code(self) -> int:
            path.write_bytes(b"whole")
            return 0

    ended = Recording.__new__(Recording)
    ended._path, ended._paths, ended._topics = path, (path,), ("/a",)
    ended._process, ended._seconds = cast("Process", Ending()), 1.0
    state = ended.state()
    assert (state.size, state.is_ended, state.error) == (5, True, "")


def test_bag_is_closed_if_its_page_closes_during_opening(
    serve: Callable[..., Served],
    client: Callable[..., Client],
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    gate = Gate()
    closed = threading.Event()

    class Slow(OpenBag):
        def __init__(self, *words: Any) -> None:
            gate.pass_through()
            super().__init__(*words)

        def close(self) -> None:
            super().close()
            closed.set()

    monkeypatch.setattr(bag_endpoint, "OpenBag", Slow)
    make_bag(folder / "a.bag", 1)
    served = serve()
    assert served.dashboard
    endpoint = served.dashboard.bags
    page = client(served)
    page.send("open", name="a.bag")
    assert gate.reached.wait(60)
    page.socket.close()
    wait_until(lambda: not endpoint.sessions)
    gate.opened.set()
    assert closed.wait(60)


def test_message_that_cannot_be_read_is_one_line(
    client: Callable[..., Client], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise BagFormatError("a chunk is damaged")

    monkeypatch.setattr(Timeline, "message_at", fail)
    make_bag(folder / "a.bag", 1)
    page = client()
    page.send("open", name="a.bag")
    page.send("show", topics=["/chatter"])
    assert "/chatter: a chunk is damaged" in json_error(page)
    page.send("list")
    page.next("files")


def test_read_only_client_neither_records_nor_opens(
    serve: Callable[..., Served], client: Callable[..., Client], folder: Path
) -> None:
    make_bag(folder / "a.bag", 1)
    access = Access(read_token="read-token-00", write_token="write-token-0", requires_token=True)
    page = client(serve(access=access), "read-token-00")
    assert page.next("writes") is False
    for op in ("list", "open", "record"):
        page.send(op, name="a.bag")
        assert "read-only" in json_error(page)


def test_client_without_token_cannot_record_or_open(client: Callable[..., Client], folder: Path) -> None:
    make_bag(folder / "a.bag", 1)
    page = client(token="")
    assert page.next("writes") is False
    page.send("open", name="a.bag")
    assert "only a client that has the token may record or open bags" in json_error(page)


def test_page_that_shows_a_paused_bag_looks_only_when_something_changes(
    client: Callable[..., Client], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_bag(folder / "a.bag", 2)
    page = client()
    page.send("open", name="a.bag")
    page.send("show", topics=["/chatter"])
    page.binary(1, text_body("message 0"))
    page.send("step")
    page.binary(1, text_body("message 1"))
    looks: list[object] = []
    follow = BagSession.follow

    async def counted(session: BagSession) -> float | None:
        looks.append(session)
        return await follow(session)

    monkeypatch.setattr(BagSession, "follow", counted)
    # Check that nothing happens during this time.
    time.sleep(1.0)
    assert len(looks) <= 2
    # The player reaches the end by itself.
    page.send("play", paused=False, rate=10)
    page.next("state", lambda state: state["ended"])


def test_stop_waits_for_a_recording_that_is_being_started(
    serve: Callable[..., Served],
    client: Callable[..., Client],
    folder: Path,
    starting: Gate,
) -> None:
    served = serve()
    page, other = client(served), client(served)
    page.send("record", topics=["/a"], name="run", suffix=".bag", compression="none")
    assert starting.reached.wait(60)
    other.send("stop")
    other.send("list")
    starting.opened.set()
    done = other.next("recording", lambda found: found and found["is_ended"])
    assert done["name"] == "run.bag"
    has_file = (folder / "run.bag").exists()
    error = "" if has_file else "it was stopped before it had started: nothing was recorded"
    assert done["error"] == error


def test_session_goes_on_after_a_fault(
    client: Callable[..., Client], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    faults = iter([ZeroDivisionError])
    follow = BagSession._follow_bag

    async def failing(session: BagSession, bag: OpenBag) -> None:
        for fault in faults:
            raise fault
        await follow(session, bag)

    def bags(_: BagFolder) -> list[object]:
        raise ZeroDivisionError

    monkeypatch.setattr(BagSession, "_follow_bag", failing)
    monkeypatch.setattr(BagFolder, "bags", bags)
    make_bag(folder / "one.bag")
    page = client()
    page.send("list")
    assert json_error(page) == "the dashboard failed on this operation: ZeroDivisionError"
    page.send("open", name="one.bag")
    page.next("bag")
    assert json_error(page) == "the dashboard failed to show bags: ZeroDivisionError"
    page.next("state")
