"""Commands of real ROS in forks behave as separate starts do: their output, exit status, input, folder and signals."""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path

import pytest

from .conftest import PATIENCE, REAL_BIN
from .forked_commands import ForkedCommand, Server, can_fork


def separate(words: list[str], environment: dict[str, str], folder: Path) -> subprocess.Popen[str]:
    pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
    return subprocess.Popen(words, env=environment, cwd=folder, text=True, **pipes)  # type: ignore[call-overload,no-any-return]


@pytest.mark.parametrize(
    ("words", "given"),
    [
        (["rosparam", "dump", "-v", "dumped.yaml"], ""),
        (["rosparam", "load", "-v", "-", "/q"], "d: 4\n"),
        (["rosservice", "type", "/nope"], ""),
        (["rosmsg-proto", "msg", "std_msgs/Header"], ""),
        (["rossrv", "show"], "std_srvs/SetBool\n"),
    ],
)
def test_forks_print_the_same(real_master: str, tmp_path: Path, words: list[str], given: str) -> None:
    environment = {**os.environ, "ROS_MASTER_URI": real_master}
    with Server(REAL_BIN / words[0]) as server:
        forked = server.start(words[1:], environment, tmp_path)
        found = forked.communicate(given, PATIENCE)
    program = separate([str(REAL_BIN / words[0]), *words[1:]], environment, tmp_path)
    assert found == program.communicate(given, PATIENCE)
    assert forked.returncode == program.returncode


def test_signals_reach_the_fork(real_master: str, tmp_path: Path) -> None:
    environment = {**os.environ, "ROS_MASTER_URI": real_master}

    def ended(program: ForkedCommand | subprocess.Popen[str], number: int) -> int:
        assert program.stderr
        try:
            assert "does not appear to be published yet" in program.stderr.readline()
            program.send_signal(number)
            program.communicate(timeout=PATIENCE)
        except BaseException:
            program.send_signal(signal.SIGKILL)
            raise
        return program.returncode

    words = ["echo", "/nothing"]
    with Server(REAL_BIN / "rostopic") as server:
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            program = separate([str(REAL_BIN / "rostopic"), *words], environment, tmp_path)
            forked = server.start(words, environment, tmp_path)
            assert ended(forked, number) == ended(program, number)


def test_remappings_need_a_separate_start() -> None:
    assert can_fork(["rostopic", "list"])
    assert not can_fork(["rostopic", "list", "__ns:=x"])
    assert not can_fork(["roslaunch", "-h"])
