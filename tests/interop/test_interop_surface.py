"""docs/rospy_compatibility.md is what comparing real rospy with ours gives today, and nothing is missing."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[1] / "referee" / "compare_surface.py"
PAGE = Path(__file__).parents[2] / "docs" / "rospy_compatibility.md"


def test_the_page_is_up_to_date() -> None:
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--check"], capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_nothing_is_missing() -> None:
    assert [line for line in PAGE.read_text().splitlines() if "| missing |" in line] == []
