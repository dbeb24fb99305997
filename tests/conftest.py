"""The environment of every test, which isolates it from other tests and from the user's ROS."""

from __future__ import annotations

import gc
import itertools
import os
import random
import signal
import socket
import subprocess
import sys
import uuid
from collections.abc import Collection, Generator, Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

# Examples are slow on a busy machine, which is not an error.
settings.register_profile("minirospy", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("minirospy")


def pytest_configure() -> None:
    """Reset signals that a shell (SIGINT, for background jobs) or `nohup` (SIGHUP) ignores, for the tests' processes."""
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if sys.platform != "win32" and signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:
        # The signal has no effect here, and new processes start with the system's default.
        signal.signal(signal.SIGHUP, lambda *_: None)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Stop garbage collection during the collection of tests: it would examine all of them again and again.

    Later collections skip them.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Escape surrogates in a test's output and log, because pytest-xdist cannot send them."""
    report = yield
    report.sections = [(name, escaped_surrogates(text)) for name, text in report.sections]
    return report


def escaped_surrogates(text: str) -> str:
    """Escape a text so that UTF-8 can encode it."""
    return text.encode("utf-8", "backslashreplace").decode()


def write_files(folder: Path, texts: Mapping[str, str], executable: Collection[str] = ()) -> None:
    """Write files by their path below ``folder``; set the executable bit of those named in ``executable``."""
    for name, text in texts.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(text.encode())
        if name in executable:
            file.chmod(0o755)


def modules_loaded_by(code: str) -> set[str]:
    """Run code in a new process, where it may print but write no error; return the names of the modules loaded at its end."""
    program = f"{code}\nimport sys\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return set(done.stdout.splitlines()[-1].split())


def free_port() -> int:
    """Return a port without a listener, for a server that another process starts, or that is restarted.

    The port is below the ephemeral range (from 32768 or 49152 on), whose ports may be assigned to any connection of
    another test before this test uses them.
    """
    while True:
        port = random.SystemRandom().randrange(20_000, 32_000)
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port


@pytest.fixture(scope="session")
def _board_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Yield the folder for all tests' virtual boards; stop all boards at the end."""
    folder = tmp_path_factory.mktemp("boards")
    yield folder
    if any(folder.iterdir()):
        import psutil

        servers = [p for p in psutil.process_iter(["cmdline"]) if str(folder) in (p.info["cmdline"] or ())]
        _, left = psutil.wait_procs(servers, timeout=30)
        assert not left, f"board servers without clients: {left}"


@pytest.fixture(scope="session")
def _homes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Return an endless iterator of new folders for ROS_HOME.

    `mktemp` for each test would list all earlier folders to find a free number: milliseconds, for thousands of tests.
    """
    parent = tmp_path_factory.mktemp("homes")
    return (parent / str(number) for number in itertools.count())


@pytest.fixture(autouse=True)
def _own_environment(_homes: Iterator[Path], monkeypatch: pytest.MonkeyPatch, _board_folder: Path) -> None:
    """Remove the user's ROS variables. Put files into a temporary folder and sockets on loopback."""
    home = next(_homes)
    home.mkdir(mode=0o700)
    for name in list(os.environ):
        if name.startswith(("ROS_", "MINIROSPY_")):
            monkeypatch.delenv(name)
    monkeypatch.setenv("ROS_HOME", str(home))
    monkeypatch.setenv("ROS_LOG_DIR", str(home / "log"))
    monkeypatch.setenv("ROS_HOSTNAME", "localhost")
    # Nothing listens on this port, so a test without its own master fails immediately.
    monkeypatch.setenv("ROS_MASTER_URI", "http://localhost:1")
    monkeypatch.setenv("MINIROSPY_BOARD", f"test-{uuid.uuid4().hex[:12]}")
    monkeypatch.setenv("MINIROSPY_RUNTIME_DIR", str(_board_folder))
    monkeypatch.setenv("PYTHONUNBUFFERED", "1")


@pytest.fixture
def master(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Run a master; yield its URI, to which ROS_MASTER_URI is set during the test."""
    from minirospy.runtime.master.master import Master
    from minirospy.runtime.transport.loop import LoopThread

    loop = LoopThread("test-master")

    async def start() -> Master:
        serving = Master()
        await serving.start()
        return serving

    serving = loop.run(start())
    uri = f"http://localhost:{serving.port}"
    monkeypatch.setenv("ROS_MASTER_URI", uri)
    try:
        yield uri
    finally:
        loop.run(serving.close(), 30.0)
        loop.close()


@pytest.fixture
def interrupted_processes(monkeypatch: pytest.MonkeyPatch) -> list[subprocess.Popen[bytes]]:
    """Return a list of the processes started from now on; this process receives a Ctrl-C each time it starts one."""
    children: list[subprocess.Popen[bytes]] = []

    class Interrupted(subprocess.Popen):  # type: ignore[type-arg]
        def __init__(self, *args: Any, **kwargs: Any) -> None:
            super().__init__(*args, **kwargs)
            children.append(self)
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(subprocess, "Popen", Interrupted)
    return children
