"""The doctor's findings, running boards and the end of the log, as the first view asks for them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xmlrpc.client import ServerProxy

import pytest

from minirospy.board.board import Board
from minirospy.introspect.doctor.graph import check_topics, node_trouble
from minirospy.introspect.doctor.reach import Fault, MasterLocation, Trouble
from minirospy.runtime.rpc.master_proxy import SystemState
from minirospy.web.dashboard.files import FOLDER
from minirospy.web.dashboard.health import Examiner, last_log_lines, running_boards
from tests.web.dashboard.test_tools_endpoint import Tools

if TYPE_CHECKING:
    from tests.web.dashboard.conftest import Served


def test_findings_are_those_of_the_doctor(serve: Callable[..., Served]) -> None:
    with ServerProxy(os.environ["ROS_MASTER_URI"]) as master:
        answer = master.registerSubscriber("/dead", "/orders", "std_msgs/String", "http://127.0.0.1:1/")
        assert answer[0] == 1, answer  # type: ignore[index]
    with Tools(serve()) as tools:
        tools.socket.send('{"id": 7, "do": "examine"}')
        while (found := tools.receive()).get("id") != 7:
            pass
    findings = found["result"]["findings"]
    assert {"check", "status", "text", "advice"} == set(findings[0])
    by_check = {each["check"]: each for each in findings}
    assert by_check["nodes"]["status"] == "problem"
    assert "/dead: nothing listens at their port" in by_check["nodes"]["text"]
    assert "nobody publishes /orders (/dead)" in by_check["topics"]["text"]


def test_pages_that_ask_at_once_get_one_examination(master: str, monkeypatch: pytest.MonkeyPatch) -> None:
    examiner = Examiner(master)
    started: list[object] = []

    class CountedPopen(subprocess.Popen[bytes]):
        def __init__(self, *words: Any, **options: Any) -> None:
            started.append(words)
            super().__init__(*words, **options)

    monkeypatch.setattr(subprocess, "Popen", CountedPopen)
    found: list[object] = []
    threads = [threading.Thread(target=lambda: found.append(examiner.findings())) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(120)
    assert len(started) == 1
    assert found[0] == found[1] == found[2] != []


def test_examination_ends_when_the_dashboard_is_closed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    script = tmp_path / "python"
    # Python may end with status 1, as the doctor does, if the signal arrives while it starts.
    script.write_text("#!/bin/sh\nexec sleep 300\n")
    script.chmod(0o755)
    if sys.platform == "win32":
        pytest.skip("no scripts with an interpreter line")
    monkeypatch.setattr(sys, "executable", str(script))
    examiner = Examiner("http://127.0.0.1:1")
    errors: list[BaseException] = []

    def examine() -> None:
        try:
            examiner.findings()
        except Exception as error:  # noqa: BLE001 - the test looks at it
            errors.append(error)

    thread = threading.Thread(target=examine)
    thread.start()
    while thread.is_alive():
        examiner.close()
        thread.join(0.1)
    assert [str(error) for error in errors] != []
    examiner.close()


def test_end_of_the_log_starts_with_a_whole_line(tmp_path: Path) -> None:
    folder = tmp_path / "run-1"
    folder.mkdir()
    lines = [f"{number}.5 INFO /node [a.py:1(f)] line {number}" for number in range(5000)]
    (folder / "rosout.log").write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = last_log_lines(tmp_path, "run-1").splitlines()
    assert found == lines[-len(found) :]
    assert 100 < len(found) < 5000


@pytest.mark.parametrize("run_id", ["run-2", "../run-1", None, 5])
def test_run_without_a_log_here_has_no_lines(tmp_path: Path, run_id: object) -> None:
    (tmp_path / "run-1").mkdir()
    (tmp_path / "run-1" / "rosout.log").write_text("secret\n", encoding="utf-8")
    assert last_log_lines(tmp_path / "logs", run_id) == ""


def test_log_of_a_master_that_has_no_run_is_empty(serve: Callable[..., Served]) -> None:
    with Tools(serve()) as tools:
        answer = tools.request(do="log")
        assert answer.get("result", {"text": ""})["text"] == ""


def test_boards_are_those_that_a_program_uses(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, serve: Callable[..., Served]
) -> None:
    monkeypatch.setenv("MINIROSPY_RUNTIME_DIR", str(tmp_path / "b"))
    assert running_boards() == []
    board = Board("mine")
    try:
        with Tools(serve()) as tools:
            assert tools.request(do="boards")["result"] == {"names": ["mine"]}
    finally:
        board.close()
    end = time.monotonic() + 60
    while running_boards() and time.monotonic() < end:
        time.sleep(0.05)
    assert running_boards() == []


def test_texts_that_the_page_translates_are_those_of_the_doctor() -> None:
    source = (FOLDER / "js" / "findings.js").read_text(encoding="utf-8")
    texts = [
        re.compile(re.sub(r"\\\{\w+\\\}", ".+", re.escape(each)))
        for each in re.findall(r'^  "(.*)",$', source, re.MULTILINE)
    ]
    place = MasterLocation("localhost", 11311, ["127.0.0.1"])
    state = SystemState({}, {"/cmd_vel": ["/robot"]}, {})
    findings = list(check_topics(state, {}))
    said = [each.text for each in findings] + [each.advice for each in findings]
    faults = (Fault.REFUSED, Fault.SILENT)
    said += [node_trouble("robot", Trouble(fault, "x"), place)[0] for fault in faults]
    said.append(node_trouble("robot", Trouble(Fault.REFUSED, "x"), place)[1])
    assert [text for text in said if not any(each.fullmatch(text) for each in texts)] == []
