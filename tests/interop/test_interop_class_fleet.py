"""The view Class with students whose computers have their own masters, and reach the teacher's only by a fleet."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from minirospy.board.board import Board
from tests.conftest import free_port
from tests.interop.browser import PATIENCE, Page
from tests.interop.conftest import OUR_BIN, running_master, start, stop
from tests.interop.page_modules import needs_node, run_script
from tests.interop.test_interop_dashboard import address, browse, needs_chromium
from tests.web.dashboard.conftest import Served, serve

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")

__all__ = ["browse", "serve"]

CLASSROOM = "js/classroom.js"


def table(parameters: dict[str, object], shared: dict[str, object]) -> Any:
    """Return [name, robot, nodes, names of passed exercises] of each row."""
    return run_script(
        "classTable",
        CLASSROOM,
        f"const all = classTable(new Map({json.dumps([*parameters.items()])}), new Map({json.dumps([*shared.items()])}));"
        "return all.students.map(({ name, robot, nodes, results }) =>"
        " [name, robot, nodes.length, [...results].filter(([, { ever }]) => ever).map(([each]) => each)]);",
    )


PASSED = {"passed": True, "ever": True, "number": 1, "failures": []}


@needs_node
def test_computers_of_one_name_have_a_row_each() -> None:
    pi = {"key": "pi", "student": "pi", "exercises": {"count": PASSED}, "now": {"nodes": ["/a"], "beat": 1}}
    rows = table({}, {"/robot1/minirospy_class": pi, "/robot2/minirospy_class": {**pi, "exercises": {}}})
    assert rows == [["pi", "robot1", 1, ["count"]], ["pi", "robot2", 1, []]]


@needs_node
def test_student_with_a_parameter_and_a_topic_has_one_row() -> None:
    parameters = {
        "/minirospy_class/anna/student": "Anna",
        "/minirospy_class/anna/exercises/led/ever": True,
        "/minirospy_class/ben/student": "Ben",
    }
    anna = {"key": "anna", "student": "Anna", "exercises": {"count": PASSED}, "now": {"beat": 7}}
    assert table(parameters, {"/minirospy_class": anna}) == [
        ["Anna", "", 0, ["led", "count"]],
        ["Ben", "", 0, []],
    ]


@needs_node
@pytest.mark.parametrize(
    "value", [None, 5, "text", [1], {"student": 5}, {"exercises": {"__proto__": 5, "a b": {}}}]
)
def test_values_of_other_kinds_are_left_out(value: object) -> None:
    hostile = {"key": "eve", "student": value, "exercises": value, "now": value}
    assert table({}, {"/eve/minirospy_class": hostile})[0][1:] == ["eve", 0, []]


@needs_node
@pytest.mark.parametrize(
    "text",
    ["", "{", "null", "5", "[]", "{}", '{"key": 5}', '{"key": "a b"}', '{"key": "a/b"}', '{"key": ["a"]}'],
)
def test_message_that_is_no_students_is_ignored(text: str) -> None:
    assert run_script("readShared", CLASSROOM, f"return readShared({json.dumps(text)})") is None


@needs_node
def test_topics_of_the_class_have_its_name_and_type() -> None:
    channels = [
        {"topic": topic, "type": type_}
        for topic, type_ in (
            ("/minirospy_class", "std_msgs/String"),
            ("/robot1/minirospy_class", "std_msgs/String"),
            ("/robot2/minirospy_class", "std_msgs/Int32"),
            ("/my_minirospy_class", "std_msgs/String"),
            ("/minirospy_class/now", "std_msgs/String"),
        )
    ]
    found = run_script("classTopics", CLASSROOM, f"return classTopics({json.dumps(channels)})")
    assert found == ["/minirospy_class", "/robot1/minirospy_class"]


class Student:
    """A computer with its own master, results and board, which a gateway joins to the fleet."""

    def __init__(self, robot: str, uri: str, home: Path, running: ExitStack) -> None:
        self.board = f"{robot}-{os.getpid()}"
        self._uri = uri
        self._words = ["env", f"ROS_HOME={home}", f"MINIROSPY_BOARD={self.board}", str(OUR_BIN / "minirospy")]
        self._running = running

    def run(self, *words: str) -> subprocess.Popen[str]:
        """Start a command of minirospy, which is stopped after the test."""
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        program = start([*self._words, *words], self._uri, "ours", **quiet)
        self._running.callback(stop, program)
        return program

    def output(self, *words: str) -> str:
        """Return what a command of minirospy prints."""
        program = start([*self._words, *words], self._uri, "ours", stdout=subprocess.PIPE)
        self._running.callback(stop, program)
        return program.communicate(timeout=PATIENCE)[0]

    def check(self, answer: str) -> None:
        """Check an answer to the exercise missing_frame; odom is the right one."""
        assert self.run("check", "missing_frame", answer).wait(PATIENCE) == (answer != "odom")


@pytest.fixture
def running() -> Iterator[ExitStack]:
    """Return a stack that stops everything that was started."""
    with ExitStack() as stack:
        yield stack


@needs_chromium
def test_students_of_a_fleet_are_shown_with_their_boards_and_results(
    serve: Callable[..., Served], browse: Callable[..., Page], running: ExitStack, tmp_path: Path
) -> None:
    served = serve()
    endpoint = f"127.0.0.1:{free_port()}"
    teacher = Student("teacher", os.environ["ROS_MASTER_URI"], tmp_path / "teacher", running)
    teacher.run("fleet", "control", "--listen", endpoint)
    # Both computers have the same name, as fresh Raspberry Pis do.
    students = []
    for robot in ("robot1", "robot2"):
        uri = running.enter_context(running_master("ours"))
        student = Student(robot, uri, tmp_path / robot, running)
        students.append(student)
        assert student.run("check", "--name", "pi").wait(PATIENCE) == 0
        student.run("fleet", "gateway", "--name", robot, "--connect", endpoint)
        student.run("check", "--share")
    students[0].check("odom")
    students[1].check("laser")

    page = browse(address(served, "class"))
    row = "[...document.querySelectorAll('.class-table tbody tr')].find(e => e.textContent.includes('{}'))"
    first, second = (row.format(robot) for robot in ("robot1", "robot2"))
    page.wait(f"return {first}?.querySelector('.class-yes') && {second}?.querySelector('.class-no')")
    names = "[...document.querySelectorAll('.class-table tbody th')].map(e => e.textContent).join()"
    assert page.evaluate(names) == "pi (robot1),pi (robot2)"
    failed = "document.querySelector('.class-failures li b').textContent"
    assert page.evaluate(failed) == "pi (robot2), missing_frame: "
    with Board(students[1].board) as board:
        board.set(7, 1)
        page.wait(f"return {second}.querySelectorAll('.class-led.red').length === 1")
    page.wait(f"return {first}.querySelector('.class-button') && !{first}.querySelector('.class-led.red')")
    # The gateway is the only other node on the student's master.
    page.wait(f"return {second}.querySelector('td .muted').textContent === '1 nodes'")
    assert page.evaluate("document.querySelectorAll('main button').length") == 0

    # A later result is shown.
    students[1].check("odom")
    page.wait(f"return {second}.querySelector('.class-yes')")
    lines = teacher.output("check", "--class", "--patience", "20").splitlines()
    assert lines[:3] == ["             missing_frame", "pi (robot1)  yes", "pi (robot2)  yes"]


@needs_chromium
def test_class_without_results_says_what_students_type(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    page = browse(address(serve(), "class"))
    page.wait("return document.querySelectorAll('main .empty code').length === 2")
    assert page.evaluate("document.querySelector('main .empty').textContent") == (
        "No results yet. Each student types once: minirospy check --join ADDRESS --name NAME. ADDRESS is the IP address of the "
        "computer with the master. In a fleet, this suffices: minirospy check --share"
    )
