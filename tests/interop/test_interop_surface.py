"""docs/compatibility/rospy.md and similar pages match real ROS and minirospy, and are complete."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from tests.interop.conftest import PATIENCE

SCRIPT = Path(__file__).parents[1] / "referee" / "compare_surface.py"
DOCS = Path(__file__).parents[2] / "docs"
PAGES = [DOCS / "compatibility" / f"{name}.md" for name in ("rospy", "modules", "tf")]


def test_the_pages_are_up_to_date() -> None:
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--check"],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_nothing_is_missing() -> None:
    lines = [line for page in PAGES for line in page.read_text().splitlines()]
    assert [line for line in lines if "| missing |" in line] == []


def test_a_star_of_actionlib_brings_the_same_names() -> None:
    script = "names = {}\nexec('from actionlib import *', names)\nprint(*sorted(n for n in names if n[:2] != '__'))"
    names = [
        set(
            subprocess.run(
                [python, "-c", script], capture_output=True, text=True, timeout=PATIENCE, check=True
            ).stdout.split()
        )
        for python in (sys.executable, "/usr/bin/python3")
    ]
    ours, real = names
    assert real - ours == set()
