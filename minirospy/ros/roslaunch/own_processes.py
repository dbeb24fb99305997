"""Watches processes that a program defines, as objects of subclasses of roslaunch.pmon.Process.

Source: http://wiki.ros.org/roslaunch/API%20Usage.
"""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable, Mapping, Sequence

from minirospy.base.clock import SignalSafeEvent
from minirospy.ros.roslaunch.launcher.output import Output
from minirospy.ros.roslaunch.roslaunch.core import RLException

__all__ = ["DeadProcess", "OwnProcesses", "Process", "ProcessListener"]

_BAR = "=" * 80
_POLL_SECONDS = 0.1  # seconds between checks of the processes


class ProcessListener:
    """Base class for objects to notify when processes exit."""

    def process_died(self, process_name: str, exit_code: int) -> None:
        """Handle a process's exit. Called in one of roslaunch's threads."""


class Process:
    """A process watched by a ProcessMonitor. Programs override start(), stop() and is_alive()."""

    def __init__(
        self,
        package: str,
        name: str,
        args: Sequence[str],
        env: Mapping[str, str],
        respawn: bool = False,
        respawn_delay: float = 0.0,
        required: bool = False,
    ) -> None:
        self.package = package
        self.name = name
        self.args = args
        self.env = env
        self.respawn = respawn
        self.respawn_delay = respawn_delay
        self.required = required

        self.lock = threading.Lock()
        self.exit_code: int | None = None
        self.spawn_count = 0  # number of starts
        self.time_of_death: float | None = None  # time.time() when the process exited

    def __str__(self) -> str:
        return f"Process<{self.name}>"

    def get_info(self) -> dict[str, object]:
        """Return a dict of the process's details."""
        keys = (
            "spawn_count",
            "args",
            "env",
            "package",
            "name",
            "alive",
            "respawn",
            "respawn_delay",
            "required",
        )
        info = {key: self.is_alive() if key == "alive" else getattr(self, key) for key in keys}
        if self.exit_code is not None:
            info["exit_code"] = self.exit_code
        return info

    def start(self) -> bool | None:
        """Start the process; return whether it is running."""
        self.spawn_count += 1
        return None

    def is_alive(self) -> bool:
        """Return whether the process is running; set ``time_of_death`` after it has exited."""
        if self.time_of_death is None:
            self.time_of_death = time.time()
        return False

    def should_respawn(self) -> float | bool:
        """Return the seconds until the process may restart, or False if it must not restart."""
        if not self.respawn:
            return False
        return (self.time_of_death or time.time()) + self.respawn_delay - time.time()

    def stop(self, errors: list[str] | None = None) -> None:
        """Terminate the process; append error descriptions to ``errors``."""

    def get_exit_description(self) -> str:
        """Describe how the process exited."""
        if self.exit_code is None:
            return "process has died"
        return (
            f"process has died with exit code {self.exit_code}"
            if self.exit_code
            else "process has finished cleanly"
        )


class DeadProcess(Process):
    """An exited process in a monitor's ``dead_list``."""

    def __init__(self, p: Process) -> None:
        super().__init__(p.package, p.name, p.args, p.env, p.respawn, p.respawn_delay, p.required)
        self.exit_code, self.spawn_count = p.exit_code, p.spawn_count
        self.lock = p.lock

    def start(self) -> bool:
        """Raise RLException: an exited process cannot be started."""
        raise RLException("call to start on dead process!")

    def is_alive(self) -> bool:
        """Return False."""
        return False


class OwnProcesses:
    """The processes that a program added to a ProcessMonitor. A thread polls them and restarts those that respawn."""

    def __init__(
        self,
        *,
        on_exit: Callable[[str, int], None],
        on_required_exit: Callable[[], None],
        on_last_exit: Callable[[], None],
    ) -> None:
        self.watched: list[Process] = []
        self.dead: list[Process] = []  # a DeadProcess for each exited process
        self.lock = threading.RLock()  # guards the lists, the flags and the thread
        self.is_stopping = False  # set at shutdown: start no more processes
        self.is_complete = False  # set if no more processes will be registered
        self.thread: threading.Thread | None = None  # the polling thread, set by start()
        self._closing = SignalSafeEvent()
        self._on_exit = on_exit  # called with an exited process's name and exit status
        self._on_required_exit = on_required_exit
        self._on_last_exit = on_last_exit  # called at each poll if no process is left and none will be added

    def start(self, name: str) -> None:
        """Start the polling thread under this name, unless it is already running or there are no processes."""
        with self.lock:
            if self.watched and self.thread is None:
                self.thread = threading.Thread(target=self._run, name=name, daemon=True)
                self.thread.start()

    def close(self, core: Sequence[Process]) -> None:
        """Wait for the thread that restarts processes, then terminate all processes, those in ``core`` last."""
        with self.lock:
            self.is_stopping = True
            polling = self.thread
        self._closing.set()
        # Wait without holding the lock: the thread calls the program's methods, which may use the monitor.
        if polling and polling is not threading.current_thread():
            polling.join()

        errors: list[str] = []
        # Terminate the core processes last, the others in reverse order of registration.
        others = [each for each in reversed(self.watched) if each not in core]
        for process in (*others, *(each for each in core if each in self.watched)):
            Output(title=False).print(f"[{process.name}] killing on exit")
            try:
                process.stop(errors)
            except Exception:  # noqa: BLE001 - the program's own class; the other processes end, too
                errors.append(traceback.format_exc())
            self._remove(process)
        for error in errors:
            Output(title=False).warn(error)

    def _run(self) -> None:
        """Poll the processes until the monitor stops."""
        respawning: set[Process] = set()
        while not self._closing.wait(_POLL_SECONDS) and not self.is_stopping:
            for process in tuple(self.watched):
                try:
                    self._poll(process, respawning)
                except Exception:  # noqa: BLE001 - the program's own class; the other processes are still watched
                    Output(title=False).warn(f"ERROR: [{process.name}]\n{traceback.format_exc()}")
                    self._remove(process)
            with self.lock:
                is_over = self.is_complete and not self.watched
            if is_over:
                self._on_last_exit()

    def _poll(self, process: Process, respawning: set[Process]) -> None:
        if process not in respawning:
            if process.is_alive():
                return
            self._report_exit(process)
            if process.required:
                self._on_required_exit()
                return
        seconds = process.should_respawn()
        if seconds is False:
            process.stop([])
            self._remove(process)
        elif seconds <= 0:
            respawning.discard(process)
            Output(title=False).print(f"[{process.name}] restarting process")
            process.stop([])
            # If shutdown starts after this check, close() waits for start() and then terminates the process.
            if not self.is_stopping:
                process.start()
        else:
            respawning.add(process)

    def _report_exit(self, process: Process) -> None:
        text = process.get_exit_description()
        output = Output(title=False)
        if process.required:
            output.warn(
                f"{_BAR}REQUIRED process [{process.name}] has died!\n{text}\nInitiating shutdown!\n{_BAR}"
            )
        elif process.exit_code:
            output.warn(f"[{process.name}] {text}")
        else:
            output.print(f"[{process.name}] {text}", bold=True)
        self._on_exit(process.name, process.exit_code or 0)

    def _remove(self, process: Process) -> None:
        with self.lock:
            if process in self.watched:
                self.watched.remove(process)
                self.dead.append(DeadProcess(process))
