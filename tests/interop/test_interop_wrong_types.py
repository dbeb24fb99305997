"""Call functions on names, types and message values with None, wrong types, no argument and normal values; compare with real ROS.

Differences are recorded in wrong_types.json, which maps a call to [real, ours]. RECORD=1 rewrites it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
RECORD = HERE / "wrong_types.json"


def outcomes(python: str) -> dict[str, str]:
    environment = {key: value for key, value in os.environ.items() if key not in ("ROS_IP", "ROS_HOSTNAME")}
    done = subprocess.run(
        [python, str(HERE / "wrong_types.py")],
        # No master runs at this address.
        env={**environment, "ROS_MASTER_URI": "http://localhost:1"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout, done.stderr
    rows = (line.partition("\t") for line in done.stdout.splitlines() if "\t" in line)
    return {call: outcome for call, _, outcome in rows}


def test_wrong_types_have_the_recorded_outcomes() -> None:
    real, ours = outcomes("/usr/bin/python3"), outcomes(sys.executable)
    both = [call for call in real if call in ours]
    assert len(both) > 500
    differing = {call: [real[call], ours[call]] for call in both if real[call] != ours[call]}
    if os.environ.get("RECORD"):
        RECORD.write_text(json.dumps(differing, indent=1, sort_keys=True) + "\n")
    assert differing == json.loads(RECORD.read_text())
