"""The programs in the docs run, and print the output on the pages."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"
PAGES = {
    name: (DOCS / name).read_text(encoding="utf-8")
    for name in ("asyncio.md", "actions.md", "python_packages.md", "diagnostics.md", "smach.md", "tf.md")
}
PROGRAMS = [
    pytest.param(code, printed, id=f"{name}-{number}")
    for name, page in PAGES.items()
    for number, (code, printed) in enumerate(
        re.findall(r"```python\n(.*?)```\n\n```text\n(.*?)```", page, re.DOTALL), 1
    )
]


def test_every_program_on_a_page_has_its_output() -> None:
    assert sum(page.count("```python") for page in PAGES.values()) == len(PROGRAMS) > 0


@pytest.mark.parametrize(("code", "printed"), PROGRAMS)
def test_program(code: str, printed: str, master: str) -> None:
    done = subprocess.run(
        [sys.executable, "-X", "dev", "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    expected = re.escape(printed).replace(r"\.\.\.", ".*")
    assert re.fullmatch(expected, done.stdout), done.stdout
    # stderr may contain logged exceptions of handlers, but no warnings.
    assert "Warning" not in done.stderr


def test_files_of_the_tour_are_ignored_by_git() -> None:
    """A reader types the tour in the folder of the sources."""
    tour = (DOCS / "tour.md").read_text(encoding="utf-8")
    bag = re.search(r"rosbag record -O (\w+)", tour)
    assert bag
    assert "rosrun tf2_tools view_frames.py" in tour
    made = {f"/{bag[1]}.bag", f"/{bag[1]}.bag.active", "/frames.gv", "/frames.pdf"}
    ignored = (DOCS.parent / ".gitignore").read_text(encoding="utf-8").splitlines()
    assert made - set(ignored) == set()
