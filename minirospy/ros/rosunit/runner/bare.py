"""Runs a unit test file as a separate program; returns its results, and the errors of the run itself.

Source: http://wiki.ros.org/rosunit.
"""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from minirospy.base.child_lifetime import guard_children
from minirospy.base.clock import SignalSafeEvent
from minirospy.base.errors import MinirospyError
from minirospy.base.signal_dispatch import interrupt_signals
from minirospy.ros.rosunit.runner.junit import Result, TestCaseResult, TestError, TestFailure, read
from minirospy.ros.rosunit.runner.unit import XML_OUTPUT_FLAG

__all__ = ["POLL_SECONDS", "interrupt_noted", "run_bare"]

POLL_SECONDS = 0.02
_INTERRUPT_SECONDS = 5.0
_TERMINATE_SECONDS = 2.0


@contextlib.contextmanager
def interrupt_noted() -> Iterator[SignalSafeEvent]:
    """Make Ctrl-C set the yielded event, because an exception could leave a new process running."""
    noted = SignalSafeEvent()
    before = {number: signal.signal(number, lambda *_: noted.set()) for number in interrupt_signals()}
    try:
        yield noted
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def run_bare(
    file: Path,
    arguments: Sequence[str],
    results_file: Path,
    package: str,
    name: str,
    *,
    seconds: float,
    text: bool,
) -> tuple[Result, TestCaseResult]:
    """Run a Python file or executable for at most ``seconds``; return its tests' results and the whole run's result.

    If ``text``, the test prints its results and writes no file, so the exit status determines the result.
    """
    case = TestCaseResult("runTest")
    case.classname = "rosunit.baretest.BareTestCase"
    results_file.unlink(missing_ok=True)
    command = [sys.executable, str(file)] if file.suffix == ".py" else [str(file.absolute())]
    command += [*arguments, f"{XML_OUTPUT_FLAG}{results_file}", *(["--text"] if text else [])]

    started = time.perf_counter()
    try:
        status = _run(command, seconds)
    except OSError as error:
        case.add_failure(_failure(f"test [{name}] cannot be run: {error}"))
        return Result(""), case
    case.time = time.perf_counter() - started
    if status is None:
        case.add_error(TestError("TestTimeoutException", f"test max time allotted: {seconds:g} s"))
    elif text:
        if status:
            case.add_failure(_failure(f"test [{name}] ended with status {status}"))
    elif not results_file.is_file():
        text_ = f"test [{name}] did not generate test results (it ended with status {status})"
        case.add_failure(_failure(text_))
    else:
        return read(results_file, f"{package}/{name}"), case
    return Result(""), case


def _run(command: list[str], seconds: float) -> int | None:
    """Return the exit status, or None if the time limit is exceeded. Raise MinirospyError on Ctrl-C."""
    with interrupt_noted() as interrupted, guard_children(), subprocess.Popen(command) as popen:
        end = time.monotonic() + seconds
        while (status := popen.poll()) is None and not interrupted.is_set() and time.monotonic() < end:
            interrupted.wait(POLL_SECONDS)
        if status is None:
            _end(popen)
    if interrupted.is_set():
        raise MinirospyError("interrupted: how the test went is not known")
    return status


def _end(popen: subprocess.Popen[bytes]) -> None:
    if sys.platform != "win32":
        popen.send_signal(signal.SIGINT)
        try:
            popen.wait(_INTERRUPT_SECONDS)
        except subprocess.TimeoutExpired:
            popen.terminate()
    try:
        popen.wait(_TERMINATE_SECONDS)
    except subprocess.TimeoutExpired:
        popen.kill()


def _failure(text: str) -> TestFailure:
    return TestFailure("AssertionError", text)
