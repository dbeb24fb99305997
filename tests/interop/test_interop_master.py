"""Real rosmaster and minirospy's master respond equally to the same calls."""

from __future__ import annotations

import json
import os
from pathlib import Path

from tests.runtime.master import test_master

GOLDEN = Path(test_master.__file__).with_name("master_answers.json")


def test_golden_answers_are_those_of_rosmaster(real_master: str) -> None:
    """Compare the golden responses with rosmaster's. RECORD=1 in the environment records them again."""
    recording = "RECORD" in os.environ
    golden = {} if recording else json.loads(GOLDEN.read_text())
    found = {
        "answers": test_master.answers(real_master),
        "notices": test_master.notices(real_master, golden.get("notices")),
    }
    if recording:
        rows = {key: ",\n".join(json.dumps(row) for row in rows) for key, rows in found.items()}
        GOLDEN.write_text(
            "{\n" + ",\n".join(f'"{key}": [\n{text}\n]' for key, text in rows.items()) + "\n}\n"
        )
    else:
        assert found == golden
