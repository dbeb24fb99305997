"""Fixtures that start programs in ROS packages as `rosrun` does, and read the messages that these publish."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from minirospy.workspace.packages import Packages

ARM = Path(__file__).parents[2] / "core" / "urdf" / "arm.urdf"
SECONDS = 100.0

Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def start(master: str) -> Iterator[Start]:
    """Return a function that starts a program: ``start(package, program, *words)``; stop the programs after the test."""
    with ExitStack() as running:

        def run(package: str, program: str, *words: str) -> subprocess.Popen[str]:
            command = [*Packages().find_executable(package, program), *words]
            process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
            )
            running.callback(end, process)
            return process

        yield run


def end(process: subprocess.Popen[str]) -> tuple[str, str]:
    """Stop a program, and return its output; assert that there is no traceback."""
    if process.stdout is None or process.stdout.closed:
        return "", ""
    process.terminate()
    try:
        output, errors = process.communicate(timeout=SECONDS)
    finally:
        process.kill()
    assert "Traceback" not in errors, errors
    return output, errors


def python(code: str) -> str:
    """Return the output of a program that runs a separate node."""
    return subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True, timeout=SECONDS
    ).stdout
