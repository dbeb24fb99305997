"""Users' programs print the same under minirospy as under real rospy, whose output `make interop` records in recorded/."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from run_case import CASES, differences, recorded, run_case

sys.path.pop(0)


@pytest.mark.timeout(120)
@pytest.mark.parametrize("name", CASES)
def test_case(name: str, master: str, tmp_path: Path) -> None:
    said = run_case(name, sys.executable, master, tmp_path)
    assert not (found := differences(said, recorded(name).read_text())), found
