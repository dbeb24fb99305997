"""A fixture that runs a program with the tools of ``rig.py``."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from textwrap import dedent
from typing import Any
from xmlrpc.client import ServerProxy

import pytest

from tests.ros.control.forks import end_server, run_program

Run = Callable[..., Any]


@pytest.fixture(scope="session", autouse=True)
def server() -> Iterator[None]:
    """End the server of programs after the last test."""
    yield
    end_server()


@pytest.fixture
def run(master: str) -> Run:
    """Return a function that runs a program as a node of the master; it returns the value that the program shows.

    With ``is_simulated``, the node's time is that of /clock.
    """

    def run_body(body: str, *, is_simulated: bool = False) -> Any:
        if is_simulated:
            with ServerProxy(master) as proxy:
                proxy.setParam("/test", "/use_sim_time", True)
        program = f"from tests.ros.control.rig import *\n{dedent(body)}"
        done = run_program(program)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout.splitlines()[-1])

    return run_body
