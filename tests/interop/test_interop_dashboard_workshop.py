"""The workshop's chapter on visualization: run the commands of docs/dashboard.md, and check the pages that open."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.conftest import free_port
from tests.interop.browser import PATIENCE, Page
from tests.interop.test_interop_dashboard import browse, needs_chromium
from tests.ros.robot_state_publisher.conftest import end
from tests.waiting import wait_until

__all__ = ["browse"]

DOCS = Path(__file__).parents[2] / "docs" / "dashboard.md"
BUTTON = ".push[data-pin='11']"

BROWSER = """#!{python}
import sys
with open({links!r}, "a") as file:
    file.write(sys.argv[1] + "\\n")
"""


def commands() -> list[str]:
    """Return the commands in the chapter."""
    chapter = DOCS.read_text(encoding="utf-8").partition("## The workshop's chapter on visualization\n")[2]
    return re.findall(r"^    \$ (.+)$", chapter.partition("\n## ")[0], re.MULTILINE)


@pytest.fixture
def type_command() -> Iterator[Callable[[str], subprocess.Popen[str]]]:
    """Return a function that runs a command in a separate terminal."""
    running: list[subprocess.Popen[str]] = []

    def run(line: str) -> subprocess.Popen[str]:
        name, *words = shlex.split(line)
        program = shutil.which(name, path=str(Path(sys.executable).parent))
        assert program, f"{name} is not installed"
        running.append(
            subprocess.Popen(
                [program, *words],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
        )
        return running[-1]

    yield run
    for process in reversed(running):
        end(process)


class Student:
    """Runs commands, and opens their pages in the browser."""

    def __init__(
        self, type_command: Callable[[str], subprocess.Popen[str]], browse: Callable[..., Page], links: Path
    ) -> None:
        self.type = type_command
        self._browse = browse
        self._links = links
        self._opened = 0

    def browser_of(self, line: str) -> Page:
        """Run a command; return the page that it opens."""
        self.type(line)
        wait_until(lambda: len(self._read()) != self._opened, PATIENCE, f"{line} opens no browser")
        found = self._read()
        self._opened = len(found)
        page = self._browse(found[-1], width=1200, height=760)
        page.wait_text("#state", "connected")
        return page

    def _read(self) -> list[str]:
        return self._links.read_text().splitlines() if self._links.exists() else []


@pytest.fixture
def student(
    type_command: Callable[[str], subprocess.Popen[str]],
    browse: Callable[..., Page],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> Student:
    links, program = tmp_path / "links", tmp_path / "browser"
    program.write_text(BROWSER.format(python=sys.executable, links=str(links)))
    program.chmod(0o755)
    monkeypatch.setenv("BROWSER", str(program))
    monkeypatch.setenv("ROS_MASTER_URI", f"http://localhost:{free_port()}")
    return Student(type_command, browse, links)


@needs_chromium
def test_chapter_on_visualization_shows_the_pressed_button(student: Student) -> None:
    typed = commands()
    assert [line.split()[0] for line in typed] == [
        "roscore", "rosrun", "rosrun", "rqt_console", "rqt_plot", "rqt_graph",
    ]  # fmt: skip
    core, button, actuator, console, plot, graph = typed
    port = os.environ["ROS_MASTER_URI"].rpartition(":")[2]
    student.type(f"{core} -p {port}")
    student.type(button)
    student.type(actuator)

    lines = student.browser_of(console)
    curve = student.browser_of(plot)
    nodes = student.browser_of(graph)
    board = student.browser_of("minirospy dashboard board")
    # The link contains a code, which the page has exchanged for a token.
    board.wait("return sessionStorage.getItem('token')?.length === 22 && !location.hash.includes('code')")

    nodes.wait_text(".graph .topic text", "/button_state")
    nodes.wait_text(".graph .node text", "/led_actuator")
    nodes.wait("return document.querySelectorAll('.edge').length === 2")
    curve.wait_text(".series[data-label='/button_state/data'] .num", "0")

    board.press(BUTTON)
    curve.wait_text(".series[data-label='/button_state/data'] .num", "1")
    board.wait("return document.querySelector('.lit')")
    board.release(BUTTON)
    curve.wait_text(".series[data-label='/button_state/data'] .num", "0")
    # The curve has both edges: there are points between 0 and 1.
    curve.wait("return document.querySelector('.chart canvas').width > 300")

    is_shown = "document.querySelector('main').textContent.includes('The chapter ends')"
    while not lines.evaluate(is_shown):
        # Repeat, because the command publishes for only three seconds, within which roscore may not connect.
        student.type(
            "rostopic pub -1 /rosout rosgraph_msgs/Log '{level: 4, name: /student, msg: The chapter ends}'"
        ).wait()
    lines.wait_text(".line .text", "The chapter ends")
