"""Watches a launch's processes until the run is over. Restarts those with respawn."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from typing import NamedTuple

from minirospy.base.errors import MinirospyError
from minirospy.ros.roslaunch.launcher.output import Output
from minirospy.ros.roslaunch.launcher.process import Process, Timeouts, end_processes
from minirospy.ros.roslaunch.launcher.spec import NodeSpec
from minirospy.ros.roslaunch.launcher.watch import FileWatch

__all__ = ["Supervisor"]

_RESPAWN_SECONDS = 0.1  # minimum seconds between two starts of a node that exits immediately

_SLICE = 0.5
"""Maximum seconds of each wait in the main thread, which receives signals.

A signal just before a wait (on Windows, any signal) is handled only after that wait. Changed files and remote processes
are checked between waits.
"""

_BAR = "=" * 80


class _Exited(NamedTuple):
    """Event: a process has exited."""

    process: Process


class _RemoteExited(NamedTuple):
    """Event: a process on another machine has exited."""

    node: NodeSpec | None
    name: str
    code: int


class _Ended(NamedTuple):
    """Event: :meth:`Supervisor.end_process` has terminated a process."""

    process: Process


class _Stop(NamedTuple):
    """Event: a signal or a caller stops the run."""

    why: str


class _NoMoreNodes(NamedTuple):
    """Event: no more nodes will be started, so the run is over once the current ones have exited."""


_Event = _Exited | _Ended | _RemoteExited | _Stop | _NoMoreNodes


class Supervisor:
    """Watches processes. ``start(node, name)`` restarts a node; ``on_exit(process)`` is called after each exit.

    ``files`` detects nodes whose programs have changed, to restart them. ``is_remote_running()`` returns whether a process
    on another machine is running. ``clock`` returns seconds.
    """

    def __init__(
        self,
        start: Callable[[NodeSpec, str], Process],
        on_exit: Callable[[Process], object],
        output: Output,
        timeouts: Timeouts,
        *,
        files: FileWatch | None = None,
        is_remote_running: Callable[[], bool] = lambda: False,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._start = start
        self._on_exit = on_exit
        self._output = output
        self._timeouts = timeouts
        self._files = files
        self._is_remote_running = is_remote_running
        self._clock = clock

        self._events: queue.SimpleQueue[_Event] = queue.SimpleQueue()
        self._restarts: list[tuple[float, Process]] = []

        self.on_change: Callable[[], object] = lambda: None
        """Called, in any thread, after a process has started, exited, or been told to exit."""
        self.processes: list[Process] = []
        """The processes being watched, including those that will be restarted."""
        self.master: Process | None = None
        """The master, if this launch has started one."""
        self.stopped_by = ""
        """The signal or stop() caller that stopped the run; empty if the nodes exited by themselves."""

    @property
    def is_anything_left(self) -> bool:
        """Return whether a process is running or will be restarted."""
        return bool(self.processes) or self.master is not None or self._is_remote_running()

    def add(self, process: Process) -> None:
        """Watch a node's process."""
        self.processes.append(process)
        self._attend(process)
        self.on_change()

    def add_master(self, process: Process) -> None:
        """Watch a master, whose exit ends the run."""
        self.master = process
        self._attend(process)

    def clear(self) -> None:
        """Stop watching all processes."""
        self.processes.clear()
        self._restarts.clear()
        self.master = None

    # --- called from any thread

    def stop(self, why: str) -> None:
        """Stop the run."""
        self._events.put(_Stop(why))

    def end_with_nodes(self) -> None:
        """Make watch(forever=True) return once the last node has exited."""
        self._events.put(_NoMoreNodes())

    def remote_ended(self, node: NodeSpec | None, name: str, code: int) -> None:
        """Report that a process on another machine has exited."""
        self._events.put(_RemoteExited(node, name, code))

    # --- called in the thread that runs the launch

    def watch(self, *, forever: bool = False) -> int | None:
        """Watch until all processes have exited, a required one has exited or stop() is called.

        Return the exit status, or None if no process is left. ``forever``: continue even if no process is left.
        """
        while forever or self.is_anything_left:
            event = self._next_event()
            status = None
            match event:
                case _Stop(why):
                    self.stopped_by = why
                    return 0
                case _NoMoreNodes():
                    forever = False
                case _Exited(process):
                    status = self._exited(process)
                    self.on_change()
                case _Ended(process):
                    self._forget_restart(process)
                    self.on_change()
                case _RemoteExited():
                    status = self._remote_exited(event)
            if status is not None:
                return status
        return None

    def pause(self, seconds: float) -> None:
        """Sleep; raise KeyboardInterrupt if stop() is called meanwhile."""
        try:
            event = self._events.get(timeout=seconds)
        except queue.Empty:
            return
        self._events.put(event)
        if isinstance(event, _Stop):
            self.stopped_by = event.why
            raise KeyboardInterrupt

    def end_process(self, process: Process) -> None:
        """Terminate one process and wait for its exit; restart it only if its file has changed."""
        process.is_ending = True
        self.on_change()
        end_processes([process], self._timeouts, self._output.warn)
        self._events.put(_Ended(process))

    # --- helpers

    def _attend(self, process: Process) -> None:
        """Wait in a thread for a process's exit, then queue an event."""

        def wait() -> None:
            process.popen.wait()
            self._events.put(_Exited(process))

        threading.Thread(target=wait, name=f"wait-{process.name}", daemon=True).start()

    def _next_event(self) -> _Event | None:
        """Return the next event. If none arrives for a while, handle due restarts and changed files, and return None."""
        pauses = [_SLICE, *(max(0.0, when - self._clock()) for when, _ in self._restarts)]
        try:
            return self._events.get(timeout=min(pauses))
        except queue.Empty:
            pass

        now = self._clock()
        ready = [process for when, process in self._restarts if when <= now]
        self._restarts = [each for each in self._restarts if each[0] > now]
        for process in ready:
            self._restart(process)
        if self._files:
            self._restart_changed(self._files)
        return None

    def _exited(self, process: Process) -> int | None:
        """Handle a process's exit; return an exit status if the run is over."""
        self._on_exit(process)
        if process is self.master:
            self.master = None
            self._output.warn("the master has ended: shutting down")
            return 1
        if process not in self.processes:
            return None
        if process.is_restarting:
            self._restart(process)
            return None
        if process.is_ending:
            self.processes.remove(process)
            return None

        node = process.node
        assert node
        is_clean = process.exit_code == 0
        text = f"{_how_it_exited(process)}\nlog file: {process.log_files}"
        if node.required:
            self.processes.remove(process)
            self._output.warn(
                f"{_BAR}\nREQUIRED process [{process.name}] has died!\n{text}\nInitiating shutdown!\n{_BAR}"
            )
            return 0 if is_clean else 1
        if is_clean:
            self._output.print(f"[{process.name}] {text}", bold=True)
        else:
            self._output.warn(f"[{process.name}] {text}")

        if node.respawn:
            due = self._clock() + max(node.respawn_delay, _RESPAWN_SECONDS)
            self._restarts.append((due, process))
        else:
            self.processes.remove(process)
        return None

    def _remote_exited(self, event: _RemoteExited) -> int | None:
        if event.node is None or not event.node.required:
            return None
        self._output.warn(f"{_BAR}\nREQUIRED process [{event.name}] has died!\nInitiating shutdown!\n{_BAR}")
        return 0 if event.code == 0 else 1

    def _forget_restart(self, process: Process) -> None:
        """Stop watching a process that was terminated while waiting for its restart."""
        others = [each for each in self._restarts if each[1] is not process]
        if len(others) < len(self._restarts) and not process.is_restarting:
            self._restarts = others
            self.processes.remove(process)

    def _restart(self, process: Process) -> None:
        """Restart an exited node at its position in the list of processes."""
        node = process.node
        assert node
        if process.is_ending and not process.is_restarting:
            self.processes.remove(process)
            return
        place = self.processes.index(process)
        self._output.print(f"[{process.name}] restarting process")
        try:
            again = self._start(node, process.name)
        except MinirospyError as error:
            self._output.warn(f"ERROR: cannot launch node of type [{node.package}/{node.type}]: {error}")
            del self.processes[place]
            return
        again.starts = process.starts + 1
        self.processes[place] = again
        self._attend(again)
        self.on_change()

    def _restart_changed(self, files: FileWatch) -> None:
        for process in self.processes:
            if process.node and not process.is_restarting and (file := files.changed(process.node)):
                self._output.print(f"[{process.name}] {file} has changed")
                process.is_restarting = True
                if process.is_running:
                    threading.Thread(target=self.end_process, args=(process,), daemon=True).start()


def _how_it_exited(process: Process) -> str:
    if process.exit_code == 0:
        return "process has finished cleanly"
    command = " ".join(process.command)
    return f"process has died [pid {process.pid}, exit code {process.exit_code}, cmd {command}]."
