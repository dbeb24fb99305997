""".rviz files: their YAML, and reading and saving them over WebSocket."""

from __future__ import annotations

import asyncio
import json
import re
import stat
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

import pytest
import yaml
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from minirospy.base.errors import RvizFileError
from minirospy.cli import dashboard as command
from minirospy.web.access import Access
from minirospy.web.dashboard import rviz_endpoint
from minirospy.web.dashboard.rviz_endpoint import SUBPROTOCOL, RvizEndpoint
from minirospy.web.dashboard.rviz_file import format_rviz, parse_rviz
from tests import manual_loop
from tests.waiting import until
from tests.web.dashboard.conftest import TOKEN

if TYPE_CHECKING:
    from minirospy.web.server.client import WebClient
    from tests.web.dashboard.conftest import Served

FILE = """Panels:
  - Class: rviz/Displays
    Property Tree Widget:
      Expanded: ~
      Splitter Ratio: 0.5
Visualization Manager:
  Displays:
    - Alpha: 0.029999999329447746
      Class: rviz/Grid
      Color: 160; 160; 164
      Enabled: true
      Offset:
        X: 0
        Y: 0
        Z: 0
  Global Options:
    Fixed Frame: map
Window Geometry:
  QMainWindow State: 000000ff00000000fd00000004
  Odd State: 00000012
  Width: 1200
"""


def test_file_of_rviz_is_written_as_it_was_read() -> None:
    found = parse_rviz(FILE)
    assert found["Window Geometry"] == {
        "QMainWindow State": "000000ff00000000fd00000004",
        "Odd State": "00000012",
        "Width": 1200,
    }
    assert json.loads(json.dumps(found)) == found
    again = format_rviz(found)
    assert parse_rviz(again) == found
    lines = set(FILE.splitlines())
    # A string of digits is quoted, so that every reader treats it as a string.
    assert [line for line in again.splitlines() if line not in lines] == ["  Odd State: '00000012'"]


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("a: 1", 'x.rviz: not a file of RViz: it has no "Visualization Manager"'),
        ("- 1", 'x.rviz: not a file of RViz: it has no "Visualization Manager"'),
        ("", 'x.rviz: not a file of RViz: it has no "Visualization Manager"'),
        ("a:\n  - b\n c: [", "x.rviz:3: not YAML: "),
        ("a: &x 1\nb: *x", "x.rviz:2: a file of RViz has no aliases (*x)"),
        ("[" * 60, "x.rviz:1: nested too deeply"),
        ("a: \0", "x.rviz: not YAML: "),
        ("x" * 200_001, "x.rviz: more than 200000 characters"),
        (
            "a: !!python/object:os.system x",
            "x.rviz:1: a file of RViz has no tags (tag:yaml.org,2002:python/object",
        ),
        ("a: 1\nb: !!bool x", "x.rviz:2: a file of RViz has no tags (tag:yaml.org,2002:bool)"),
        ("? [a]\n: 1", "x.rviz:1: a name that is a list or a map"),
        ("a: 1\n---\nb: 1", "x.rviz:2: more than one document"),
    ],
    ids=range(12),
)
def test_text_that_is_not_a_file_of_rviz_is_refused(text: str, error: str) -> None:
    with pytest.raises(RvizFileError, match="^" + re.escape(error)):
        parse_rviz(text, "x.rviz")


@pytest.fixture
def opened(serve: Callable[..., Served]) -> Iterator[Callable[..., Callable[[object], Any]]]:
    """Return a function that opens a dashboard's endpoint with this file; it returns a function that sends an operation."""
    sockets = ExitStack()

    def opening(file: Path | None, token: str = TOKEN, **options: Any) -> Callable[[object], Any]:
        served = serve(**options)
        assert served.dashboard
        served.dashboard.rviz.file = file
        names = [Subprotocol(SUBPROTOCOL)] + ([Subprotocol(f"minirospy.token.{token}")] if token else [])
        connecting = connect(
            f"ws://127.0.0.1:{served.port}/", subprotocols=names, compression=None, open_timeout=100
        )
        socket = sockets.enter_context(connecting)

        def send(operation: object) -> Any:
            socket.send(json.dumps(operation))
            return json.loads(socket.recv(timeout=60))

        return send

    with sockets:
        yield opening


def test_file_of_the_command_is_read_and_saved(
    opened: Callable[..., Callable[[object], Any]], tmp_path: Path
) -> None:
    file = tmp_path / "my.rviz"
    send = opened(file)
    assert send({"read": True}) == {"config": None, "name": "my.rviz", "writes": True}
    config = parse_rviz(FILE)
    assert send({"save": config}) == {"name": "my.rviz"}
    assert parse_rviz(file.read_text(encoding="utf-8")) == config
    assert send({"read": True})["config"] == config
    assert [path.name for path in tmp_path.iterdir()] == ["my.rviz"]
    assert send({"save": {"a": 1}}) == {
        "error": 'the file: not a file of RViz: it has no "Visualization Manager"'
    }
    assert parse_rviz(file.read_text(encoding="utf-8")) == config


def test_text_of_the_browser_is_read_and_written(opened: Callable[..., Callable[[object], Any]]) -> None:
    send = opened(None)
    config = send({"parse": FILE})["config"]
    assert parse_rviz(send({"format": config})["text"]) == config
    assert "not YAML" in send({"parse": "a: ["})["error"]
    assert "was not started with a .rviz file" in send({"read": True})["error"]
    assert "was not started with a .rviz file" in send({"save": config})["error"]


def test_depth_of_a_file_is_limited_in_both_directions() -> None:
    def nested(depth: int) -> dict[str, object]:
        value: object = ["x"]
        for _ in range(depth - 3):
            value = [value]
        return {"Visualization Manager": {"Displays": value}}

    config = nested(49)
    assert parse_rviz(format_rviz(config)) == config
    with pytest.raises(RvizFileError, match="nested too deeply"):
        format_rviz(nested(50))
    with pytest.raises(RvizFileError, match="nested too deeply"):
        parse_rviz(json.dumps(nested(50)))


@pytest.mark.parametrize("number", ["1.0e999", "-1.0e999"])
def test_number_that_json_has_not_is_text(number: str) -> None:
    found = parse_rviz(f"Visualization Manager: {{Size: {number}}}")
    json.dumps(found, allow_nan=False)


def test_operations_that_wait_are_limited() -> None:
    sent: list[str] = []
    client = cast("WebClient", SimpleNamespace(send_text=sent.append, holds=lambda _: None))

    async def work() -> None:
        endpoint = RvizEndpoint()
        session = endpoint.open(client)
        for _ in range(100):
            session.received_text('{"parse": "a: 1"}')
        await until(lambda: len(sent) >= 100)
        session.received_text('{"parse": "a: 1"}')
        await until(lambda: len(sent) >= 101)
        await endpoint.close()

    asyncio.run(work())
    assert sum("too many operations" in each for each in sent) == 80


def test_file_that_cannot_be_saved_leaves_nothing_behind(
    opened: Callable[..., Callable[[object], Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(path: Path, _: Path) -> Path:
        raise OSError(28, "No space left on device")

    send = opened(tmp_path / "my.rviz")
    monkeypatch.setattr(Path, "replace", fail)
    assert "No space left" in send({"save": parse_rviz(FILE)})["error"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights there, and files have no mode")
def test_saved_file_stays_a_link_with_its_mode(
    opened: Callable[..., Callable[[object], Any]], tmp_path: Path
) -> None:
    target, link = tmp_path / "target.rviz", tmp_path / "my.rviz"
    target.write_text(FILE, encoding="utf-8")
    target.chmod(0o600)
    link.symlink_to(target)
    assert opened(link)({"save": parse_rviz(FILE)}) == {"name": "my.rviz"}
    assert link.is_symlink()
    assert parse_rviz(target.read_text(encoding="utf-8")) == parse_rviz(FILE)
    assert stat.S_IMODE(target.stat().st_mode) == 0o600


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights there")
def test_link_that_waits_where_a_file_is_written_is_not_followed(
    opened: Callable[..., Callable[[object], Any]], tmp_path: Path
) -> None:
    victim = tmp_path / "victim"
    victim.write_text("precious", encoding="utf-8")
    (tmp_path / ".my.rviz.part").symlink_to(victim)
    assert opened(tmp_path / "my.rviz")({"save": parse_rviz(FILE)}) == {"name": "my.rviz"}
    assert victim.read_text(encoding="utf-8") == "precious"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["my.rviz", "victim"]


def test_file_that_two_pages_save_at_the_same_time_is_whole(tmp_path: Path) -> None:
    configs = [{"Visualization Manager": {"Displays": [str(number)] * 10_000}} for number in range(4)]
    file = tmp_path / "my.rviz"
    sent: list[str] = []
    client = cast("WebClient", SimpleNamespace(send_text=sent.append, holds=lambda _: None, is_owner=True))

    async def work() -> None:
        endpoint = RvizEndpoint(file)
        for config in configs:
            endpoint.open(client).received_text(json.dumps({"save": config}))
        await until(lambda: len(sent) >= len(configs))
        await endpoint.close()

    asyncio.run(work())
    assert all(json.loads(each) == {"name": "my.rviz"} for each in sent), sent
    assert parse_rviz(file.read_text(encoding="utf-8")) in configs


def test_saving_is_completed_if_the_dashboard_closes(tmp_path: Path) -> None:
    file = tmp_path / "my.rviz"
    client = cast("WebClient", SimpleNamespace(send_text=lambda _: None, holds=lambda _: None, is_owner=True))

    async def work() -> None:
        endpoint = RvizEndpoint(file)
        endpoint.open(client).received_text(json.dumps({"save": parse_rviz(FILE)}))
        # Poll on each loop iteration: after a pause, the file may already be saved.
        await manual_loop.until(lambda: endpoint._tasks)
        await endpoint.close()

    asyncio.run(work())
    assert parse_rviz(file.read_text(encoding="utf-8")) == parse_rviz(FILE)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "~",
        "true",
        "yes",
        "12",
        "012",
        "1.5",
        "1e5",
        "0x1F",
        "12:30:45",
        "2026-01-01",
        ".inf",
        "a: b",
        "a:",
        "a #b",
        "#b",
        "- a",
        "---",
        "'",
        '"',
        "\\",
        " a ",
        "a\nb",
        "\x07\x85\u2028",
        "Größe 🤖",
        "160; 160; 164",
        "/tf",
        "*a",
        "&a",
        "!a",
        "[a",
        "{a",
        "a, b",
        "%a",
        "@a",
        "=",
        "<<",
        "null",
    ],
)
def test_texts_and_names_are_read_as_they_were_written(text: str) -> None:
    config: dict[str, object] = {"Visualization Manager": {text: text, "in a list": [text, {text: [text]}]}}
    written = format_rviz(config)
    assert parse_rviz(written) == config
    # Another YAML 1.1 reader, such as Python's, reads the same string.
    assert yaml.safe_load(written) == config


def test_values_are_written_as_another_reader_reads_them() -> None:
    values = [
        1,
        -5,
        0.5,
        1e-05,
        1e300,
        0.029999999329447746,
        True,
        False,
        None,
        [],
        {},
        [[]],
        [[1], {"a": []}],
    ]
    config: dict[str, object] = {"Visualization Manager": {"values": values}}
    assert parse_rviz(format_rviz(config)) == config
    assert yaml.safe_load(format_rviz(config)) == config


@pytest.mark.parametrize(
    "operation", [1, {}, {"remove": 1}, {"parse": 1}, {"save": "x", "read": 1}, None, []]
)
def test_invalid_operation_is_refused(
    opened: Callable[..., Callable[[object], Any]], operation: object
) -> None:
    assert opened(None)(operation)["error"].startswith("not an operation on .rviz files")


def test_read_only_token_saves_nothing(
    opened: Callable[..., Callable[[object], Any]], tmp_path: Path
) -> None:
    file = tmp_path / "my.rviz"
    file.write_text(FILE, encoding="utf-8")
    access = Access(read_token="read-token-00", write_token="write-token-0", requires_token=True)
    send = opened(file, "read-token-00", access=access)
    found = send({"read": True})
    assert found["writes"] is False
    assert "read-only" in send({"save": found["config"]})["error"]
    assert file.read_text(encoding="utf-8") == FILE


def test_rviz_names_a_file_that_it_cannot_read(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "bad.rviz"
    file.write_text("a: [", encoding="utf-8")
    assert command.rviz(["-d", str(file), "--no-browser"]) == 1
    assert f"{file}:1: not YAML" in capsys.readouterr().err


def test_operation_that_fails_is_answered(
    opened: Callable[..., Callable[[object], Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> str:
        raise ZeroDivisionError

    monkeypatch.setattr(rviz_endpoint, "format_rviz", fail)
    send = opened(None)
    failed = {"error": "the dashboard failed on this operation: ZeroDivisionError"}
    assert send({"format": {}}) == failed
    assert send({"format": {}}) == failed
