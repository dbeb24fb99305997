"""Launch files over WebSocket: found, described, started, stopped; no process outlives the dashboard."""

from __future__ import annotations

import asyncio
import contextlib
import json
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

import psutil
import pytest
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from minirospy.web.access import Access
from minirospy.web.dashboard import launch_endpoint
from minirospy.web.dashboard.launch_endpoint import SUBPROTOCOL, LaunchEndpoint, LaunchSession, _Tail
from minirospy.web.dashboard.launch_files import LaunchFile
from minirospy.web.dashboard.launch_run import LaunchRun, _Lines
from tests.waiting import wait_until
from tests.web.dashboard.conftest import TOKEN
from tests.web.dashboard.lamp import make_lamp

if TYPE_CHECKING:
    from tests.web.dashboard.conftest import Served

FILE = {"package": "lamp", "file": "launch/lamp.launch"}


class Client:
    """A page's connection."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket

    def send(self, op: str, **fields: object) -> None:
        self.socket.send(json.dumps({"op": op, **fields}))

    def next(self, accepts: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        """Return the next message that ``accepts`` accepts."""
        while True:
            found: dict[str, Any] = json.loads(self.socket.recv(timeout=60))
            if accepts(found):
                return found

    def run(self, accepts: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        """Return the state of the only launch as soon as ``accepts`` accepts it."""
        message = self.next(lambda found: found.get("launches") and accepts(found["launches"][-1]))
        launch: dict[str, Any] = message["launches"][-1]
        return launch

    def log(self, text: str) -> str:
        """Return the log being followed once it contains this text."""
        found = ""
        while text not in found:
            message = self.next(lambda each: "log" in each)
            found = message["text"] if message["isFirst"] else found + message["text"]
        return found

    def error(self) -> str:
        return str(self.next(lambda found: "error" in found)["error"])


def node(launch: dict[str, Any], name: str) -> dict[str, Any]:
    found: dict[str, Any] = next(each for each in launch["nodes"] if each["name"] == name)
    return found


@pytest.fixture
def client(
    serve: Callable[..., Served], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[..., Client]]:
    make_lamp(tmp_path)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    with contextlib.ExitStack() as opened:

        def start(served: Served | None = None, token: str = TOKEN) -> Client:
            names = [Subprotocol(SUBPROTOCOL)] + ([Subprotocol(f"minirospy.token.{token}")] if token else [])
            address = f"ws://127.0.0.1:{(served or serve()).port}/"
            return Client(
                opened.enter_context(connect(address, subprotocols=names, compression=None, open_timeout=100))
            )

        yield start


def test_launch_files_are_found_with_their_arguments(client: Callable[..., Client]) -> None:
    page = client()
    page.send("list")
    files = page.next(lambda found: "files" in found)["files"]
    assert ["lamp", "launch/lamp.launch"] in files
    assert ["two_link_arm", "launch/arm.launch"] in files
    page.send("describe", **FILE)
    described = page.next(lambda found: "describe" in found)["describe"]
    assert described["args"] == [
        ["word", "hello", "what is printed"],
        ["loud", "false", None],
        ["needed", None, "must be given"],
    ]


def test_nodes_run_exit_respawn_and_are_stopped(client: Callable[..., Client]) -> None:
    page = client()
    page.send("start", **FILE, args={"needed": "yes", "word": "good day"})
    launch = page.run(
        lambda run: (
            run["state"] == "running"
            and node(run, "/talker")["state"] == "running"
            and node(run, "/failing")["state"] == "exited"
            and node(run, "/again")["starts"] > 1
        )
    )
    assert launch["args"] == {"needed": "yes", "word": "good day"}
    assert node(launch, "/failing")["status"] == 3
    assert node(launch, "/missing")["state"] == "failed"
    assert node(launch, "/again")["respawns"]
    pid = node(launch, "/talker")["pid"]
    assert psutil.pid_exists(pid)

    page.send("follow", id=launch["id"], node="/talker")
    assert "good day" in page.log("good day")
    page.send("follow", id=launch["id"], node="/failing")
    page.log("to standard error")
    page.send("follow", id=launch["id"], node="")
    page.log("cannot launch node of type [lamp/missing.py]")

    page.send("stop", id=launch["id"])
    ended = page.run(lambda run: run["state"] == "ended")
    assert ended["error"] == ""
    assert node(ended, "/talker")["state"] == "stopped"
    assert not psutil.pid_exists(pid)
    page.send("remove", id=launch["id"])
    page.next(lambda found: found.get("launches") == [])


def test_one_node_and_a_whole_launch_are_restarted(client: Callable[..., Client]) -> None:
    page = client()
    page.send("start", **FILE, args={"needed": "yes"})
    launch = page.run(lambda run: run["state"] == "running" and node(run, "/talker")["pid"])
    first = node(launch, "/talker")["pid"]
    page.send("end", id=launch["id"], node="/talker", restarts=True)
    again = page.run(lambda run: node(run, "/talker")["pid"] not in (None, first))
    assert node(again, "/talker")["starts"] == 2
    page.send("restart", id=launch["id"])
    restarted = page.run(lambda run: run["id"] != launch["id"] and run["state"] == "running")
    assert restarted["args"] == {"needed": "yes"}
    page.send("end", id=restarted["id"], node="/talker", restarts=False)
    page.run(lambda run: node(run, "/talker")["state"] == "stopped")


def test_processes_end_with_the_dashboard(
    serve: Callable[..., Served], client: Callable[..., Client]
) -> None:
    served = serve()
    page = client(served)
    page.send("start", **FILE, args={"needed": "yes"})
    launch = page.run(lambda run: node(run, "/talker")["pid"] if run["nodes"] else False)
    pid = node(launch, "/talker")["pid"]
    assert served.dashboard
    served.run(served.dashboard.close())
    assert not psutil.pid_exists(pid)


@pytest.mark.parametrize(
    ("op", "fields", "why"),
    [
        ("start", {"package": "lamp", "file": "../lamp/launch/lamp.launch"}, "launch file"),
        ("start", {"package": "lamp", "file": "/etc/passwd"}, "launch file"),
        ("start", {"package": "../lamp", "file": "launch/lamp.launch"}, "launch file"),
        ("describe", {"package": "lamp", "file": "scripts/talk.py"}, "launch file"),
        ("describe", {"package": "lamp", "file": "launch/broken.launch"}, "broken.launch"),
        ("start", {}, "not an operation on launch files"),
        ("start", {**FILE, "args": [1]}, "not an operation on launch files"),
        ("stop", {"id": 77777}, "not there any more"),
        ("fly", {}, "not an operation on launch files"),
    ],
)
def test_what_cannot_be_started_is_one_line(
    client: Callable[..., Client], op: str, fields: dict[str, object], why: str
) -> None:
    page = client()
    page.send(op, **fields)
    error = page.error()
    assert why in error
    assert "\n" not in error


@pytest.mark.parametrize("args", [{}, {"needed": "1", "unknown": "2"}])
def test_launch_that_cannot_be_loaded_has_its_error(
    client: Callable[..., Client], args: dict[str, str]
) -> None:
    page = client()
    page.send("start", **FILE, args=args)
    launch = page.run(lambda run: run["state"] == "ended")
    assert ("unknown" if args else "needed") in launch["error"]


def test_read_only_client_starts_nothing(serve: Callable[..., Served], client: Callable[..., Client]) -> None:
    for options, token in (
        (
            {"read_token": "read-token-00", "write_token": "write-token-0", "requires_token": True},
            "read-token-00",
        ),
        ({"default_is_read": True}, ""),
    ):
        page = client(serve(access=Access(**options)), token)
        assert page.next(lambda found: "writes" in found)["writes"] is False
        for op in ("list", "start", "describe"):
            page.send(op, **FILE, args={"needed": "yes"})
            assert "read-only" in page.error()


def test_client_without_token_cannot_start_launches(client: Callable[..., Client]) -> None:
    page = client(token="")
    assert page.next(lambda found: "writes" in found)["writes"] is False
    page.send("start", **FILE, args={"needed": "yes"})
    assert "only a client that has the token may start programs" in page.error()


class Run:
    """A launch that has stopped, or that was requested to stop."""

    def __init__(self, number: int) -> None:
        self.id = number
        self.package, self.file, self.args, self.path = (
            "lamp",
            "lamp.launch",
            dict[str, str](),
            Path("lamp.launch"),
        )
        self.is_ended = True
        self.stopped = threading.Event()
        self.joined = threading.Event()

    def stop(self) -> None:
        self.stopped.set()

    def join(self) -> None:
        assert self.joined.wait(60)


def test_launches_that_have_ended_are_limited() -> None:
    async def work() -> list[int]:
        endpoint = LaunchEndpoint("http://127.0.0.1:1")
        for number in range(30):
            endpoint.runs[number] = cast("LaunchRun", Run(number))
        endpoint.runs[3].is_ended = False  # type: ignore[misc]
        endpoint.changed()
        return list(endpoint.runs)

    assert asyncio.run(work()) == [3, *range(10, 30)]


def test_restart_is_completed_if_its_page_closes(
    client: Callable[..., Client], serve: Callable[..., Served]
) -> None:
    served = serve()
    page, other = client(served), client(served)
    run = Run(77)
    assert served.dashboard
    endpoint = served.dashboard.launches
    started: list[LaunchFile] = []

    async def add() -> None:
        endpoint.runs[77] = cast("LaunchRun", run)
        endpoint.start = lambda file, *_: started.append(file)  # type: ignore[method-assign, assignment]

    served.run(add())
    page.send("restart", id=77)
    assert run.stopped.wait(60)
    page.socket.close()
    other.send("restart", id=77)
    run.joined.set()
    wait_until(lambda: 77 not in endpoint.runs)
    assert started == [("lamp", "lamp.launch")]


def test_launch_that_has_been_restarted_is_not_started_twice() -> None:
    """A second client's request may start when the first client's request finishes."""
    started: list[LaunchFile] = []

    async def work() -> None:
        endpoint = LaunchEndpoint("http://127.0.0.1:1")
        endpoint.start = lambda file, *_: started.append(file)  # type: ignore[method-assign, assignment]
        run = Run(77)
        run.joined.set()
        endpoint.runs[77] = cast("LaunchRun", run)
        for _ in range(2):
            await endpoint.restart(cast("LaunchRun", run))

    asyncio.run(work())
    assert started == [("lamp", "lamp.launch")]


def test_nothing_is_started_once_the_dashboard_closes(
    client: Callable[..., Client], serve: Callable[..., Served], monkeypatch: pytest.MonkeyPatch
) -> None:
    served = serve()
    page = client(served)
    page.send("list")
    page.next(lambda found: "files" in found)
    assert served.dashboard
    endpoint = served.dashboard.launches
    reached, go_on = threading.Event(), threading.Event()
    path_of = endpoint.files.path_of

    def slow(file: LaunchFile) -> Path:
        reached.set()
        assert go_on.wait(60)
        return path_of(file)

    monkeypatch.setattr(endpoint.files, "path_of", slow)
    page.send("start", **FILE, args={"needed": "yes"})
    assert reached.wait(60)
    served.run(endpoint.close())
    go_on.set()
    served.run(served.dashboard.close())
    for thread in threading.enumerate():
        if "LaunchSession" in thread.name or "launch-session" in thread.name:
            thread.join(60)
    assert not endpoint.runs


def test_lines_since_a_number_are_neither_lost_nor_repeated() -> None:
    lines = _Lines(lambda: None)
    total, seen, count = 1500, list[str](), 0
    writing = threading.Thread(target=lambda: [lines.print(str(number)) for number in range(total)])
    writing.start()
    while len(seen) < total and (writing.is_alive() or count < total):
        new, count = lines.since(count)
        seen += new
    writing.join()
    assert seen == [str(number) for number in range(total)]


def test_last_line_without_an_end_is_shown_when_its_node_has_exited(tmp_path: Path) -> None:
    log = tmp_path / "log"
    log.write_bytes(b"first\nPassword: ")
    has_exited = [False]
    run = SimpleNamespace(log_file=lambda _: log, has_exited=lambda _: has_exited[0])
    tail = _Tail(cast("LaunchRun", run), "/node")
    assert tail.read() == "first\n"
    has_exited[0] = True
    assert tail.read() == "Password: "
    assert tail.read() == ""


def test_page_that_shows_launches_looks_at_them_only_when_they_change(
    client: Callable[..., Client], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = client()
    (tmp_path / "lamp" / "launch" / "quiet.launch").write_text(
        '<launch><node pkg="lamp" type="talk.py" name="talker" args="a b"/></launch>'
    )
    page.send("start", package="lamp", file="launch/quiet.launch")
    page.run(lambda run: run["state"] == "running" and node(run, "/talker")["pid"])
    looks: list[object] = []
    monkeypatch.setattr(LaunchSession, "follow", counted(LaunchSession.follow, looks))
    # Check that nothing happens during this time.
    time.sleep(1.0)
    assert len(looks) <= 2


def counted(method: Any, calls: list[object]) -> Any:
    async def follow(session: object) -> Any:
        calls.append(session)
        return await method(session)

    return follow


def test_session_goes_on_after_a_fault(
    client: Callable[..., Client], monkeypatch: pytest.MonkeyPatch
) -> None:
    faults = iter([ZeroDivisionError])
    tail = LaunchSession._send_log

    async def failing(session: LaunchSession) -> bool:
        for fault in faults:
            raise fault
        return await tail(session)

    def describe(*_: object) -> list[object]:
        raise ZeroDivisionError

    monkeypatch.setattr(LaunchSession, "_send_log", failing)
    monkeypatch.setattr(launch_endpoint, "resolved_arg_docs", describe)
    page = client()
    page.send("describe", **FILE, args={})
    while page.error() != "the dashboard failed on this operation: ZeroDivisionError":
        pass
    page.send("list")
    assert page.next(lambda found: "files" in found)["files"]
