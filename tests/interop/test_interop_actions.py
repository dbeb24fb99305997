"""Action servers and clients by minirospy, actionlib in Python and actionlib in C++, in every combination."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from .conftest import PATIENCE, compiled

HERE = Path(__file__).parent
STACKS = ("ours", "asyncio", "rospy", "roscpp")
OURS = {"ours", "asyncio"}
Run = Callable[[str, str, str], "subprocess.Popen[str]"]

PAIRS = [
    (server, client)
    for server in STACKS
    for client in STACKS
    if len(OURS & {server, client}) == 1 or server == client == "ours"
]
SAID = """\
server True
succeeds True SUCCEEDED reached 1
succeeds feedback 10 11 12
aborts True ABORTED failed 2
aborts feedback
state ACTIVE
cancelled True PREEMPTED made way 3
cancelled feedback
state ACTIVE
after another True SUCCEEDED reached 1
after another feedback 10 11 12
state ACTIVE
all cancelled True PREEMPTED made way 3
all cancelled feedback
state ACTIVE
cancelled by time True PREEMPTED made way 3
cancelled by time feedback
out of time True
in time ABORTED
"""


@pytest.fixture(scope="session")
def cpp_action_peer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the compiled action_peer.cpp."""
    return compiled("action_peer.cpp", tmp_path_factory, "actionlib", "roscpp")


@pytest.fixture
def run(request: pytest.FixtureRequest) -> Iterator[Run]:
    """Start a peer: ``run(stack, role, uri)``."""
    programs = []

    def start(stack: str, role: str, uri: str) -> subprocess.Popen[str]:
        command = {
            "ours": [sys.executable, str(HERE / "action_peer.py")],
            "asyncio": [sys.executable, str(HERE / "action_peer_aio.py")],
            "rospy": ["/usr/bin/python3", str(HERE / "action_peer.py")],
            "roscpp": [str(request.getfixturevalue("cpp_action_peer"))] if stack == "roscpp" else [],
        }[stack]
        program = subprocess.Popen(
            [*command, role],
            env={**os.environ, "ROS_MASTER_URI": uri},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        programs.append(program)
        return program

    yield start
    for program in programs:
        # A server exits when stdin is closed.
        if program.poll() is None:
            try:
                program.communicate(timeout=PATIENCE)
            except subprocess.TimeoutExpired:
                program.kill()
        program.communicate()


@pytest.mark.parametrize(("server", "client"), PAIRS)
def test_goals_end_the_same_between_all_clients_and_servers(
    real_master: str, run: Run, server: str, client: str
) -> None:
    serving = run(server, "serve", real_master)
    assert serving.stdout
    assert any(line.strip() == "ready" for line in serving.stdout)
    output, errors = run(client, "ask", real_master).communicate(timeout=PATIENCE)
    assert output == SAID, errors


@pytest.mark.parametrize(
    ("server", "client"),
    [*(("ours", stack) for stack in STACKS), ("asyncio", "ours"), ("asyncio", "asyncio")],
)
def test_goals_over_our_master(run: Run, server: str, client: str, master: str) -> None:
    serving = run(server, "serve", master)
    assert serving.stdout
    assert any(line.strip() == "ready" for line in serving.stdout)
    output, errors = run(client, "ask", master).communicate(timeout=PATIENCE)
    assert output == SAID, errors
