"""topic_tools: the real programs and minirospy's forward the same messages (tests/ros/topic_tools/drive.txt)."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from tests.interop.conftest import PATIENCE, REAL_PYTHON, environment

DRIVE = Path(__file__).parents[1] / "ros" / "topic_tools" / "drive.py"


def test_real_programs_forward_the_recorded_messages(real_master: str) -> None:
    done = subprocess.run(
        [REAL_PYTHON, str(DRIVE), "/usr/lib/topic_tools"],
        env=environment(real_master, "rospy"),
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    recorded = DRIVE.with_suffix(".txt")
    if os.environ.get("RECORD"):
        recorded.write_text(done.stdout, encoding="utf-8")
    assert done.stdout == recorded.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("words", "printed"),
    [
        ((), ["subscribed", "word", "unsubscribed"] * 2),
        (("_lazy:=false",), ["subscribed", "word", "word"]),
    ],
)
def test_lazy_program_prints_the_same_under_ros(
    real_master: str, words: tuple[str, ...], printed: list[str]
) -> None:
    done = subprocess.run(
        [REAL_PYTHON, str(DRIVE.with_name("lazy.py")), *words],
        env=environment(real_master, "rospy"),
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.stdout.split() == printed, done.stderr
