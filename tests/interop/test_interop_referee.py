"""Run the cases of tests/referee under real rospy, and compare the output with the recorded one.

`RECORD=1 pytest tests/interop/test_interop_referee.py` records them again.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "referee"))
from run_case import CASES, differences, recorded, run_case

sys.path.pop(0)


@pytest.mark.parametrize("name", CASES)
def test_record_is_the_output_of_real_rospy(name: str, real_master: str, tmp_path: Path) -> None:
    def said() -> str:
        try:
            return run_case(name, "/usr/bin/python3", real_master, tmp_path)
        except subprocess.TimeoutExpired as error:
            return f"{(error.stdout or b'').decode()}it hangs\n"

    if os.environ.get("RECORD"):
        recorded(name).write_text(said())
    found = ""
    for _ in range(4):
        # On a busy machine, threads in real rospy and actionlib race, and rarely deadlock, so try again.
        found = differences(said(), recorded(name).read_text())
        if not found:
            break
    assert not found, found
