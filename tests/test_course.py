"""The pages of the course are correct: each command, typed into real terminals, prints the output on the page."""

from __future__ import annotations

import importlib.util
import os
import re
import sys
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


# Each page continues with the files that earlier pages left in the home folder, so that two processes that share the
# pages would both play the first ones.
@pytest.mark.timeout(900)
def test_pages_show_the_output_of_their_commands(tmp_path: Path) -> None:
    assert record is not None
    board = {name: os.environ[name] for name in ("MINIROSPY_BOARD", "MINIROSPY_RUNTIME_DIR")}
    player = record.Player(tmp_path, board)
    for page in PAGES:
        player.play(FOLDER / page)


def test_recorded_session_is_that_of_the_pages() -> None:
    """`python docs/workshop/record.py` records the session again."""
    assert record is not None
    session = (FOLDER / "session.txt").read_text(encoding="utf-8")
    heads = [f"\n===== {page} =====\n" for page in PAGES]
    for page, head, following in zip(PAGES, heads, [*heads[1:], ""], strict=True):
        left = session.partition(head)[2]
        left = left.partition(following)[0] if following else left
        steps = record.steps(FOLDER / page)
        starts = [f"({step.path} is saved)\n" if step.path else f"{step.shown}\n" for step in steps]
        for step, start, after in zip(steps, starts, [*starts[1:], ""], strict=True):
            assert left.startswith(start), f"{step.place}: the session has {left[:80]!r} instead of {start!r}"
            left = left.removeprefix(start)
            end = f"\n{left}".find(f"\n{after}") if after else len(left)
            printed, left = left[:end], left[end:]
            shown = record.pattern(step.answer, skip=True) + "(?:.*\n)*" * step.goes_on
            assert re.fullmatch(shown + "\n*", record.TIME.sub("<time>", printed)), f"{step.place}: {printed}"


def test_the_index_names_each_page() -> None:
    index = (FOLDER / "index.md").read_text(encoding="utf-8")
    assert tuple(re.findall(r"^\| \[.*\]\((\w+\.md)\)", index, re.MULTILINE)) == PAGES


def test_links_resolve() -> None:
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
        (
            "$ echo old > ~/pose\n$ rostopic() { cat ~/pose; echo new > ~/pose; }\n$ rostopic echo -n 1 /pose\nnew\n",
            None,
        ),
    ],
)
def test_player_types_commands_and_compares_output(page: str, printed: str | None, tmp_path: Path) -> None:
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
