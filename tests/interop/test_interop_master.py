"""The same calls to real rosmaster and to ours get the same answers."""

from __future__ import annotations

import importlib.util
import json
import os
from pathlib import Path
from typing import Any

RUNTIME = Path(__file__).parents[1] / "runtime" / "master"


def load_test_master() -> Any:
    spec = importlib.util.spec_from_file_location("master_referee", RUNTIME / "test_master.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_golden_answers_are_those_of_rosmaster(real_master: str) -> None:
    """With RECORD=1 in the environment they are recorded again."""
    referee, file = load_test_master(), RUNTIME / "master_answers.json"
    recording = "RECORD" in os.environ
    golden = {} if recording else json.loads(file.read_text())
    found = {
        "answers": referee.answers(real_master),
        "notices": referee.notices(real_master, golden.get("notices")),
    }
    if recording:
        rows = {key: ",\n".join(json.dumps(row) for row in rows) for key, rows in found.items()}
        file.write_text("{\n" + ",\n".join(f'"{key}": [\n{text}\n]' for key, text in rows.items()) + "\n}\n")
    else:
        assert found == golden
