"""diagnostic_aggregator: Debian's programs publish the recordings in tests/ros/packages/aggregator; bonds connect both stacks."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.interop.conftest import PATIENCE, REAL_PYTHON, environment

HERE = Path(__file__).parents[1] / "ros" / "packages" / "aggregator"
OURS = HERE.parents[3] / "minirospy" / "ros" / "diagnostic_aggregator" / "nodes"
REAL = Path("/usr/lib/diagnostic_aggregator")


@pytest.mark.parametrize(
    ("python", "programs"),
    [
        pytest.param(REAL_PYTHON, [str(REAL)], id="real programs, real rospy"),
        pytest.param(REAL_PYTHON, [str(OURS), sys.executable], id="our programs, real rospy"),
        pytest.param(sys.executable, [str(REAL)], id="real programs, our rospy"),
    ],
)
def test_programs_publish_the_recorded_messages(python: str, programs: list[str], master: str) -> None:
    done = subprocess.run(
        [python, str(HERE / "drive.py"), *programs],
        env=environment(master, "rospy"),
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.stdout == (HERE / "drive.txt").read_text(encoding="utf-8"), done.stderr
