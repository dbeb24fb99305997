"""Bonds between minirospy's bondpy, Debian's bondpy and bondcpp.

They are formed, and broken by an endpoint or by killing one.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.interop.conftest import PATIENCE, REAL_PYTHON, compiled, start, stop

HERE = Path(__file__).parent
PAIRS = [("ours", "ours"), ("ours", "rospy"), ("rospy", "ours"), ("ours", "roscpp"), ("roscpp", "ours")]

Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture(scope="session")
def cpp_bond(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the compiled bond_peer.cpp."""
    return compiled("bond_peer.cpp", tmp_path_factory, "bondcpp")


@pytest.fixture
def end(master: str, request: pytest.FixtureRequest) -> Iterator[Start]:
    """Return a function that starts an endpoint of a bond with a stack; stop the endpoints after the test."""
    with ExitStack() as stack:

        def make(
            which: str, *, connect_timeout: float = PATIENCE, heartbeat_timeout: float = PATIENCE
        ) -> subprocess.Popen[str]:
            programs = {
                "ours": [sys.executable, str(HERE / "bond_peer.py")],
                "rospy": [REAL_PYTHON, str(HERE / "bond_peer.py")],
            }
            command = programs.get(which) or [str(request.getfixturevalue("cpp_bond"))]
            program = start(
                [*command, "/bonds", "pair", str(connect_timeout), str(heartbeat_timeout)], master, which
            )
            stack.callback(stop, program)
            return program

        yield make


def send(program: subprocess.Popen[str], word: str) -> None:
    assert program.stdin
    program.stdin.write(f"{word}\n")
    program.stdin.flush()


def lines(program: subprocess.Popen[str], count: int) -> list[str]:
    """Return the next lines, sorted, because a callback and a waiting thread print in any order."""
    assert program.stdout
    return sorted(program.stdout.readline().strip() for _ in range(count))


ENDED = ["broken", "waited True True True"]


@pytest.mark.parametrize(("one", "other"), PAIRS)
def test_bond_broken_by_one_endpoint_breaks_at_the_other(one: str, other: str, end: Start) -> None:
    ends = end(one), end(other)
    assert [lines(each, 1) for each in ends] == [["formed"], ["formed"]]
    send(ends[0], "break")
    assert [lines(each, 2) for each in ends] == [ENDED, ENDED]


@pytest.mark.parametrize(("one", "other"), PAIRS)
def test_bond_with_a_killed_end_breaks(one: str, other: str, end: Start) -> None:
    # A live endpoint may stall for up to this long.
    ends = end(one, heartbeat_timeout=10.0), end(other)
    assert [lines(each, 1) for each in ends] == [["formed"], ["formed"]]
    send(ends[0], "wait")
    assert lines(ends[0], 1) == ["known True"]
    ends[1].kill()
    assert lines(ends[0], 2) == ENDED


def test_end_that_is_alone_breaks_after_its_time(end: Start) -> None:
    found = [lines(end(stack, connect_timeout=0.5), 2) for stack in ("ours", "rospy", "roscpp")]
    assert found == [ENDED, ENDED, ENDED]
