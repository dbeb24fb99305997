"""Shut a node down at each step of its init_node, with one forked process per step.

A step is a call of a function in Python or C, or its return: Python runs signal handlers at these points. At each of them, a
signal must end the process with status 0 and without output, after its hooks have run once, without a deadlock, and the
master (ROS_MASTER_URI) must not know the node any more.

usage: python signal_steps.py WAY [EVERY]

``passes``: the signal arrives at the step, and the main thread continues. ``stands``: the main thread stays at the step
until the signal is dispatched there. ``elsewhere``: another thread shuts the node down while the main thread stays at
the step. ``twice``: two signals, of which the second may interrupt the hook and the wait for the master. EVERY 30 tests
every thirtieth step. Prints the faults; the exit status is 1 if there are any.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import signal
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Callable
from types import FrameType
from typing import IO

import rospy
from roscpp import msg, srv  # noqa: F401

from minirospy.base.errors import RpcRefused

# Import the modules that init_node uses: the steps of an import do not count as steps of the node.
from minirospy.client import params, shutdown, startup  # noqa: F401
from minirospy.client.session import current_session
from minirospy.runtime.master import log_file  # noqa: F401
from minirospy.runtime.node import node, registration  # noqa: F401
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.runtime.transport import loop

_AT_ONCE = 3
_numbers = itertools.count()
# seconds after which a process is considered hung; a machine that runs tests may stall for a while
_GUARD = 60.0
# Maximum seconds to stay at a step. In a critical section, or before the library's thread has started, no signal is
# dispatched.
_STAND = 0.3


def passes() -> None:
    """Send a signal."""
    signal.raise_signal(signal.SIGINT)


def stands() -> None:
    """Send a signal, and wait until it is dispatched."""
    deferral = current_session().lifecycle.deferral
    signal.raise_signal(signal.SIGINT)
    end = time.monotonic() + _STAND
    while deferral.pending and not deferral.is_active and time.monotonic() < end:
        time.sleep(0.001)


def twice() -> None:
    """Send a signal, and another once the library's thread has counted it."""
    machine = current_session().lifecycle.machine
    signal.raise_signal(signal.SIGINT)
    end = time.monotonic() + _STAND
    while not machine.signals and time.monotonic() < end:
        time.sleep(0.001)
    signal.raise_signal(signal.SIGINT)


def elsewhere() -> None:
    """Shut down in another thread."""
    thread = threading.Thread(target=current_session().lifecycle.signal_shutdown, args=("",), daemon=True)
    thread.start()
    thread.join(_STAND)


_WAYS = {way.__name__: way for way in (passes, stands, twice, elsewhere)}


def run_node(name: str, at: int, way: Callable[[], None], notes: int) -> None:
    """Make this process a node that is shut down at step ``at``; write the counted steps and the position to ``notes``.

    At step 0 the node is not shut down.
    """
    # Disable the timeouts that depend on the machine's speed: the interrupt of a running main thread, and the report
    # of slow work.
    shutdown._GRACE_SECONDS = shutdown._REPORT_SECONDS = 1000.0
    # Raise the limits that would hide a deadlock.
    loop.CLOSE_SECONDS = registration.SILENT_SECONDS = registration.STILL_SILENT_SECONDS = 1000.0
    signal.signal(signal.SIGINT, signal.default_int_handler)
    steps = hooks = 0

    def count(frame: FrameType | None, event: str, argument: object) -> None:
        nonlocal steps
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            return
        steps += 1
        if steps == at:
            places: list[str] = []
            while frame is not None and len(places) < 9:
                places.append(f"{os.path.basename(frame.f_code.co_filename)}:{frame.f_lineno}")
                frame = frame.f_back
            os.write(notes, f"{event} {' < '.join(places)}".encode())
            way()

    def start() -> None:
        sys.setprofile(count)
        try:
            rospy.init_node(name, argv=[])
        finally:
            sys.setprofile(None)
        if 0 < at <= steps:
            rospy.spin()

    def hook() -> None:
        nonlocal hooks
        hooks += 1

    rospy.on_shutdown(hook)
    session = current_session()
    for part in (start, session.shut_down_at_exit):
        try:
            part()
        except BaseException as error:  # noqa: BLE001 - as at the end of a program, which is silent about an interrupt
            with contextlib.suppress(SystemExit):
                sys.excepthook(type(error), error, error.__traceback__)
    if not at:
        os.write(notes, str(steps).encode())
    if way is not twice and (hooks, session.is_shutdown()) != (1, True):
        raise AssertionError(f"{hooks} hooks have run, is_shutdown() is {session.is_shutdown()}")


def _file() -> IO[bytes]:
    return tempfile.TemporaryFile()


class Trial:
    """A forked process that is shut down at one step."""

    def __init__(self, at: int, way: Callable[[], None]) -> None:
        """Start the process."""
        self.name = f"at_{at}_{next(_numbers)}"
        self._output, self._notes = _file(), _file()
        self._is_twice = way is twice
        self._end = time.monotonic() + _GUARD
        self._pid = os.fork()
        if not self._pid:
            status = 1
            try:
                os.dup2(self._output.fileno(), 1)
                os.dup2(self._output.fileno(), 2)
                run_node(self.name, at, way, self._notes.fileno())
                status = 0
            except BaseException:  # noqa: BLE001 - the process ends here
                traceback.print_exc()
            finally:
                os._exit(status)

    @property
    def has_ended(self) -> bool:
        """Return whether the process has exited; kill a process that hangs."""
        if time.monotonic() > self._end:
            os.kill(self._pid, signal.SIGKILL)
        pid, status = os.waitpid(self._pid, os.WNOHANG)
        self._status = os.waitstatus_to_exitcode(status)
        return pid != 0

    def result(self, master: MasterProxy) -> tuple[str, str]:
        """Return the process's notes, and the fault at its exit, or "" if there is none."""
        texts = []
        for file in (self._output, self._notes):
            with file:
                file.seek(0)
                texts.append(file.read().decode())
        output, notes = texts
        if self._is_twice:
            # The second signal may cause a warning, and may leave the node in the master's lists.
            output = output if "Traceback" in output else ""
        else:
            with contextlib.suppress(RpcRefused):
                master.lookup_node(f"/{self.name}")
                output += "the master knows it\n"
        is_good = self._status == 0 and not output
        return notes, "" if is_good else f"{self.name}: {notes}: status {self._status}\n{output}"


def main(way: str, every: str = "1") -> int:
    """Try the steps; return the exit status."""
    master = MasterProxy(os.environ["ROS_MASTER_URI"], "/signal_steps")
    # Imports and caches in the first call must not count as steps of init_node.
    master.get_pid()
    counting = Trial(0, _WAYS[way])
    while not counting.has_ended:
        time.sleep(0.001)
    steps, fault = counting.result(master)
    faults = [fault] if fault else []

    left = list(range(1, int(steps or 0) + 1, int(every)))
    running: list[Trial] = []
    while left or running:
        while left and len(running) < _AT_ONCE:
            running.append(Trial(left.pop(), _WAYS[way]))
        for trial in [trial for trial in running if trial.has_ended]:
            running.remove(trial)
            faults += filter(None, [trial.result(master)[1]])
        time.sleep(0.001)
    print(*faults, f"{steps} steps, each {every}th: {len(faults)} faults", sep="\n")
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
