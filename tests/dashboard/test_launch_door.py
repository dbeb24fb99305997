"""Launch files over WebSocket: found, described, started, stopped; none of their processes outlives the dashboard."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

import psutil
import pytest
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from minirospy.bridge.access import Access
from minirospy.dashboard import launch_door
from minirospy.dashboard.launch_door import SUBPROTOCOL, LaunchDoor, LaunchSession
from minirospy.dashboard.launch_run import RunState
from tests.dashboard.conftest import TOKEN
from tests.dashboard.lamp import make_lamp
from tests.waiting import until

if TYPE_CHECKING:
    from minirospy.bridge.web.client import WebClient
    from tests.dashboard.conftest import Served

FILE = {"package": "lamp", "file": "launch/lamp.launch"}


class Client:
    """A page's connection."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket

    def send(self, op: str, **fields: object) -> None:
        self.socket.send(json.dumps({"op": op, **fields}))

    def next(self, accepts: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        """Return the next message that is accepted."""
        while True:
            found: dict[str, Any] = json.loads(self.socket.recv(timeout=60))
            if accepts(found):
                return found

    def run(self, accepts: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        """Return the state of the only launch, once it is accepted."""
        message = self.next(lambda found: found.get("launches") and accepts(found["launches"][-1]))
        launch: dict[str, Any] = message["launches"][-1]
        return launch

    def log(self, text: str) -> str:
        """Return what is followed, once it has this text."""
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
            return Client(opened.enter_context(connect(address, subprotocols=names, compression=None)))

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


def test_who_has_no_token_starts_nothing(client: Callable[..., Client]) -> None:
    page = client(token="")
    assert page.next(lambda found: "writes" in found)["writes"] is False
    page.send("start", **FILE, args={"needed": "yes"})
    assert "only who has the token may start programs" in page.error()


def test_launch_that_is_added_while_launches_are_reported() -> None:
    runs: dict[int, object] = {}

    class Run:
        def state(self) -> RunState:
            # As the thread of another session does.
            runs[len(runs)] = self
            return RunState(1, "lamp", "lamp.launch", {}, "running", "", [])

    runs[0] = Run()
    sent: list[bytes] = []
    client = SimpleNamespace(
        is_owner=True,
        send_text=lambda _: None,
        send_text_message=lambda _, data, newest_only: sent.append(data),
    )

    async def work() -> None:
        session = LaunchSession(cast(LaunchDoor, SimpleNamespace(runs=runs)), cast("WebClient", client))
        await until(lambda: not (not sent and not session.task.done()))
        session.ended()
        with contextlib.suppress(asyncio.CancelledError):
            await session.task

    asyncio.run(work())
    assert len(json.loads(sent[0])["launches"]) == 1


def test_session_goes_on_after_a_fault(
    client: Callable[..., Client], monkeypatch: pytest.MonkeyPatch
) -> None:
    faults = iter([ZeroDivisionError])
    tail = LaunchSession._send_log

    async def failing(session: LaunchSession) -> None:
        for fault in faults:
            raise fault
        await tail(session)

    def describe(*_: object) -> list[object]:
        raise ZeroDivisionError

    monkeypatch.setattr(LaunchSession, "_send_log", failing)
    monkeypatch.setattr(launch_door, "resolved_arg_docs", describe)
    page = client()
    page.send("describe", **FILE, args={})
    assert page.error() == "the dashboard failed on this operation: ZeroDivisionError"
    page.send("list")
    assert page.next(lambda found: "files" in found)["files"]
