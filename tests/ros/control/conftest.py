"""A fixture that runs a program with the tools of ``rig.py``."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from textwrap import dedent
from typing import Any
from xmlrpc.client import ServerProxy

import pytest

ROOT = Path(__file__).parents[3]

Run = Callable[..., Any]


@pytest.fixture
def run(master: str) -> Run:
    """Return a function that runs a program as a node of the master; it returns the value that the program shows.

    With ``is_simulated``, the node's time is that of /clock.
    """

    def run_program(body: str, *, is_simulated: bool = False) -> Any:
        if is_simulated:
            with ServerProxy(master) as proxy:
                proxy.setParam("/test", "/use_sim_time", True)
        program = f"from tests.ros.control.rig import *\n{dedent(body)}"
        done = subprocess.run(
            [sys.executable, "-c", program],
            cwd=ROOT,
            capture_output=True,
            text=True,
            timeout=100,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout.splitlines()[-1])

    return run_program
