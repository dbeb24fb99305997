"""Runs a case's program under one stack, with a master, and returns its output."""

from __future__ import annotations

import difflib
import os
import re
import subprocess
from pathlib import Path

HERE = Path(__file__).parent
CASES = sorted(path.stem for path in (HERE / "cases").glob("*.py"))


def run_case(name: str, python: str, uri: str, home: Path) -> str:
    """Return a case's stdout, with its exit status as the last line. Print its stderr if it fails."""
    environment = {
        key: value for key, value in os.environ.items() if not key.startswith(("ROS_", "MINIROSPY_"))
    }
    done = subprocess.run(
        [python, str(HERE / "cases" / f"{name}.py")],
        env={
            **environment,
            "ROS_MASTER_URI": uri,
            "ROS_HOSTNAME": "localhost",
            "ROS_HOME": str(home),
            "PYTHONPATH": str(HERE),
            "PYTHONWARNINGS": "ignore",
        },
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=100,
        cwd=home,
        check=False,
    )
    if done.returncode:
        print(done.stderr)
    return f"{done.stdout}exit status {done.returncode}\n"


def differences(said: str, expected: str) -> str:
    """Return the lines in which two outputs differ, for any Python version; an empty string if they are equal."""
    lines, others = (_as_every_python(text).splitlines() for text in (said, expected))
    return "\n".join(difflib.unified_diff(others, lines, "expected", "said", lineterm="", n=1))


def _as_every_python(text: str) -> str:
    """Return the text without the additions to Python's messages from version 3.13 on."""
    text = text.replace(" and no __dict__ for setting new attributes", "")
    # Remove the source line of `python -c`, and the marks below it.
    return re.sub(r'^(\s*)(File "<string>", .*\n)(?:\1 .*\n)+', r"\1\2", text, flags=re.MULTILINE)


def recorded(name: str) -> Path:
    """Return the path of real rospy's recorded output."""
    return HERE / "recorded" / f"{name}.txt"
