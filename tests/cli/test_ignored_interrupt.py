"""Commands that a script starts with `&`: the shell makes them ignore SIGINT, but `kill -INT` must stop them nevertheless."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

from tests.cli.conftest import BIN, Robot

pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="Windows has no such signals between processes"
)

COMMANDS = {
    # Dict from a command to its words, and to the output that it prints before it waits.
    "rostopic echo": (["rostopic", "echo", "/button_state"], "data: "),
    "rostopic hz": (["rostopic", "hz", "/ns/chatter"], "subscribed to"),
    "rostopic bw": (["rostopic", "bw", "/ns/chatter"], "subscribed to"),
    "rostopic delay": (["rostopic", "delay", "/poly"], "subscribed to"),
    "rostopic pub": (
        ["rostopic", "pub", "/any_text", "std_msgs/String", "data: x"],
        "publishing and latching",
    ),
    "rostopic pub -r": (
        ["rostopic", "pub", "-v", "-r", "10", "/any_text", "std_msgs/String", "x"],
        "publishing",
    ),
    "rosnode ping": (["rosnode", "ping", "/robot"], "xmlrpc reply"),
    "minirospy topic": (["minirospy", "topic", "echo", "/button_state"], "data: "),
    "python -m": ([sys.executable, "-m", "minirospy", "topic", "echo", "/button_state"], "data: "),
}


@pytest.fixture
def started() -> Iterator[list[subprocess.Popen[str]]]:
    processes: list[subprocess.Popen[str]] = []
    yield processes
    for process in processes:
        process.kill()
        process.communicate()


@pytest.mark.parametrize("what", COMMANDS)
def test_an_ignored_sigint_ends_a_command(
    robot: Robot, started: list[subprocess.Popen[str]], what: str
) -> None:
    words, waits_with = COMMANDS[what]
    program = words[0] if os.path.isabs(words[0]) else str(BIN / words[0])
    process = subprocess.Popen(
        # A shell does the same for `&`.
        ["/bin/sh", "-c", 'trap "" INT; exec "$@"', "sh", program, *words[1:]],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    started.append(process)
    assert process.stdout
    lines = iter(process.stdout.readline, "")
    assert any(waits_with in line for line in lines)

    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=45)
    assert process.returncode == 0
    assert "Traceback" not in output
