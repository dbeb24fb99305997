"""The course tells the truth: each command of its pages, typed into real terminals, answers what the page shows."""

from __future__ import annotations

import importlib.util
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

FOLDER = Path(__file__).parents[1] / "docs" / "workshop"

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or not Path("/bin/bash").exists(),
    reason="the pages show Linux and bash; several loopback addresses play several computers",
)


def _load() -> ModuleType:
    spec = importlib.util.spec_from_file_location("course_record", FOLDER / "record.py")
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules["course_record"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


record = _load() if sys.platform == "linux" else None
PAGES: tuple[str, ...] = record.PAGES if record else ()


class Course:
    """One student for all tests: a page builds on what the pages before it have left in the home folder."""

    def __init__(self, home: Path, boards: Path) -> None:
        assert record is not None
        self._player = record.Player(
            home, {"MINIROSPY_BOARD": home.name, "MINIROSPY_RUNTIME_DIR": str(boards)}
        )
        self._left = list(PAGES)

    def play_up_to(self, page: str) -> None:
        while page in self._left:
            self._player.play(FOLDER / self._left.pop(0))


@pytest.fixture(scope="module")
def course(tmp_path_factory: pytest.TempPathFactory, _board_folder: Path) -> Course:
    return Course(tmp_path_factory.mktemp("student"), _board_folder)


@pytest.mark.parametrize("page", PAGES)
def test_the_page_shows_what_happens(course: Course, page: str) -> None:
    course.play_up_to(page)


def commands(text: str) -> Iterator[str]:
    return (line for line in text.splitlines() if re.match(r"(terminal \d)?\$ ", line))


def test_the_recorded_session_is_that_of_the_pages() -> None:
    """`python docs/workshop/record.py` makes it anew."""
    assert record is not None
    typed = [
        step.shown for page in PAGES for step in record.steps(FOLDER / page) if step.typed.endswith("\n")
    ]
    assert list(commands((FOLDER / "session.txt").read_text(encoding="utf-8"))) == typed
    assert len(typed) > 100


def test_the_index_names_each_page() -> None:
    index = (FOLDER / "index.md").read_text(encoding="utf-8")
    assert tuple(re.findall(r"^\| \[.*\]\((\w+\.md)\)", index, re.MULTILINE)) == PAGES


def test_links_lead_somewhere() -> None:
    for page in FOLDER.glob("*.md"):
        for link in re.findall(r"\]\(([^)#:]+)\)", page.read_text(encoding="utf-8")):
            assert (FOLDER / link).exists(), f"{page.name}: {link}"


@pytest.mark.parametrize(
    ("page", "printed"),
    [
        ("$ echo one two\none ...\n", None),
        ("$ echo one\ntwo\n", "prints\none"),
        ("$ sh -c 'echo one; exec cat'\none\n...\nterminal 1:\n<Ctrl-C>\n", None),
        ("$ cat\n...\n", "still runs in the terminals [1]"),
        ("$ cat\n...\n$ echo one\none\n", "a program still runs in terminal 1"),
        ("$ printf 'one\\ntwo\\nthree\\n'\none\n...\nthree\n", None),
        ("$ printf 'one\\ntwo\\nthree\\n'\none\nthree\n", "prints"),
        ("$ echo 1234567890.5\n1111111111.1\n", None),
    ],
)
def test_the_player(page: str, printed: str | None, tmp_path: Path) -> None:
    assert record is not None
    file = tmp_path / "page.md"
    file.write_text(f"```console\n{page}```\n")
    player = record.Player(tmp_path, {})
    if printed is None:
        player.play(file)
        return
    with pytest.raises(record.CourseError) as error:
        player.play(file)
    assert printed in str(error.value)
