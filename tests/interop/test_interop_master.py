"""The same calls to real rosmaster and to ours get the same answers."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from typing import Any

RUNTIME = Path(__file__).parents[1] / "runtime"


def load_test_master() -> Any:
    spec = importlib.util.spec_from_file_location("master_referee", RUNTIME / "test_master.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_golden_answers_are_those_of_real_rosmaster(real_master: str) -> None:
    referee = load_test_master()
    golden = json.loads((RUNTIME / "master_answers.json").read_text())
    assert referee.answers(real_master) == golden
