"""Masters, peers and tools of real ROS 1 and of minirospy, on separate ports.

`make interop` installs Debian's ROS 1 and runs this folder; all of it is skipped if ROS 1 is not installed.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from http.client import HTTPException
from pathlib import Path
from typing import Any
from xmlrpc.client import Error, ServerProxy

import pytest

from tests.conftest import free_port
from tests.waiting import wait_until

HERE = Path(__file__).parent
REAL_PYTHON = "/usr/bin/python3"
REAL_BIN = Path("/usr/bin")
OUR_BIN = Path(sys.executable).parent

STACKS = ("ours", "rospy", "roscpp")
# seconds after which a program is considered hung; on a busy machine, starting one may take a minute
PATIENCE = 200.0


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    # Start the test that takes minutes first; the others then run in parallel.
    items.sort(key=lambda item: item.name.partition("[")[0] != "test_the_table")
    for item in items:
        if HERE not in item.path.parents:
            continue
        if not (REAL_BIN / "rosmaster").exists():
            item.add_marker(pytest.mark.skip(reason="real ROS 1 is not installed: make interop"))
        elif not item.get_closest_marker("timeout"):
            # Longer than PATIENCE, whose error names the condition. The test may first run a compiler in parallel
            # with other tests.
            item.add_marker(pytest.mark.timeout(3 * PATIENCE))


def pytest_sessionfinish() -> None:
    from tests.interop.browser import close_shared_browser

    close_shared_browser()


def environment(uri: str, stack: str) -> dict[str, str]:
    """Return the process environment for one of STACKS, in which its own programs and modules are found first."""
    path = str(OUR_BIN) if stack == "ours" else str(REAL_BIN)
    return {**os.environ, "ROS_MASTER_URI": uri, "PATH": path + os.pathsep + os.environ["PATH"]}


def start(command: list[str], uri: str, stack: str, **kwargs: object) -> subprocess.Popen[str]:
    """Start a program of ``stack`` with its streams as text pipes."""
    streams = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **kwargs}
    return subprocess.Popen(command, env=environment(uri, stack), text=True, **streams)  # type: ignore[call-overload,no-any-return]


def stop(program: subprocess.Popen[str]) -> None:
    """Stop a program: close stdin, which makes the peers exit, then send signals."""
    if program.stdin:
        program.stdin.close()
        with suppress(subprocess.TimeoutExpired):
            program.wait(3)
    for end in (program.terminate, program.kill):
        if program.poll() is not None:
            break
        end()
        try:
            program.wait(5)
        except subprocess.TimeoutExpired:
            continue
    for stream in (program.stdin, program.stdout, program.stderr):
        if stream:
            stream.close()


def is_ready(master: subprocess.Popen[str], uri: str, stack: str) -> bool:
    """Return whether this master, not another test's, responds, and a roscore's rosout node is registered."""
    try:
        with ServerProxy(uri) as proxy:
            pid: Any = proxy.getPid("/test")
            state: Any = proxy.getSystemState("/test")
    except (OSError, HTTPException, Error):
        return False
    return pid[2] == master.pid and (stack != "ours" or "/rosout" in dict(state[2][1]))


def started_master(stack: str) -> tuple[subprocess.Popen[str], str]:
    """Return a running master and its URI. If another process took its port, the master has exited."""
    port = free_port()
    uri = f"http://localhost:{port}"
    commands = {
        "ours": [str(OUR_BIN / "roscore"), "-p", str(port)],
        "rospy": [str(REAL_BIN / "rosmaster"), "--core", "-p", str(port)],
    }
    program = start(commands[stack], uri, stack)
    try:
        wait_until(
            lambda: program.poll() is not None or is_ready(program, uri, stack),
            PATIENCE,
            "the master does not answer",
        )
    except BaseException:
        end_master(program)
        raise
    return program, uri


def end_master(program: subprocess.Popen[str]) -> None:
    # A master does not read stdin, so send a signal.
    program.terminate()
    stop(program)


@contextmanager
def running_master(stack: str) -> Iterator[str]:
    """Yield the URI of a fresh master of ``stack``."""
    program, uri = started_master(stack)
    for _ in range(2):
        if program.poll() is None:
            break
        stop(program)
        program, uri = started_master(stack)

    try:
        assert program.poll() is None, f"the master has ended: {program.communicate()}"
        yield uri
    finally:
        end_master(program)


@pytest.fixture(autouse=True)
def _patient_publishers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Raise a bridge's limit of one second for subscribers to connect before a client's single publish."""
    from minirospy.aio import topics

    monkeypatch.setattr(topics, "JOIN_SECONDS", 30.0)


@pytest.fixture(params=["ours", "rospy"], ids=["our master", "real master"])
def any_master(request: pytest.FixtureRequest) -> Iterator[str]:
    """Yield the URI of a fresh master, minirospy's and the real one in turn."""
    with running_master(request.param) as uri:
        yield uri


@pytest.fixture
def real_master() -> Iterator[str]:
    """Yield the URI of a fresh rosmaster."""
    with running_master("rospy") as uri:
        yield uri


def compiled(source: str, factory: pytest.TempPathFactory, *libraries: str) -> Path:
    """Compile a C++ file of this folder with ``libraries`` (pkg-config names); return the program.

    The compiler may take minutes on a busy machine, so the first pytest worker compiles for all.
    """
    import fcntl

    folder = factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    program = folder / Path(source).stem
    with program.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not program.exists():
            compiler = shutil.which("g++")
            assert compiler
            command = ["pkg-config", "--cflags", "--libs", *libraries]
            flags = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
            made = program.with_suffix(".made")
            subprocess.run([compiler, "-o", str(made), str(HERE / source), *flags], check=True)
            made.rename(program)
    return program


@pytest.fixture(scope="session")
def cpp_peer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the compiled peer.cpp."""
    return compiled("peer.cpp", tmp_path_factory, "roscpp")


@pytest.fixture
def peer(request: pytest.FixtureRequest) -> Iterator[Callable[[str, str, str], subprocess.Popen[str]]]:
    """Start a peer: ``peer(stack, role, uri)``."""

    with ExitStack() as running:

        def run(stack: str, role: str, uri: str) -> subprocess.Popen[str]:
            command = {
                "ours": [sys.executable, str(HERE / "peer.py")],
                "rospy": [REAL_PYTHON, str(HERE / "peer.py")],
                "roscpp": [str(request.getfixturevalue("cpp_peer"))] if stack == "roscpp" else [],
            }[stack]
            program = start([*command, role], uri, stack)
            running.callback(stop, program)
            return program

        yield run
