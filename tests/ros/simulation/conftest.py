"""Fixtures that start programs of packages and launch files."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from tests.ros.robot_state_publisher.conftest import end, start

__all__ = ["launch", "start"]


@pytest.fixture
def launch(master: str) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Return a function that starts `roslaunch WORDS`; stop it after the test."""
    with ExitStack() as running:

        def run(*words: str) -> subprocess.Popen[str]:
            command = [sys.executable, "-m", "minirospy.ros.roslaunch.commands.roslaunch", *words]
            process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            running.callback(end, process)
            return process

        yield run
