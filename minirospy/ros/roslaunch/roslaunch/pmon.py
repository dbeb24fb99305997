"""Processes that a program launches: the classes of roslaunch.pmon and roslaunch.nodeprocess, over a Launcher.

Source: http://wiki.ros.org/roslaunch/API%20Usage.
"""

from __future__ import annotations

import math
import os
import signal
import subprocess
import threading
import time
import traceback
import weakref
from collections.abc import Sequence
from types import FrameType
from typing import ClassVar

from minirospy.base.environment import Environment
from minirospy.base.errors import MinirospyError
from minirospy.ros.roslaunch.launcher import process as processes
from minirospy.ros.roslaunch.launcher.command import node_command, node_environment
from minirospy.ros.roslaunch.launcher.output import Output
from minirospy.ros.roslaunch.launcher.runner import Launcher, RunOptions
from minirospy.ros.roslaunch.launcher.spec import LaunchSpec, NodeSpec
from minirospy.ros.roslaunch.roslaunch.core import Node, RLException
from minirospy.ros.roslaunch.roslaunch.node_args import NodeParamsException
from minirospy.workspace.packages import Packages

__all__ = [
    "Process",
    "ProcessListener",
    "ProcessMonitor",
    "RLException",
    "_init_signal_handlers",
    "pmon_shutdown",
    "rl_signal",
    "shutdown_process_monitor",
    "start_process_monitor",
]


class ProcessListener:
    """Is notified of the exit of processes."""

    def process_died(self, process_name: str, exit_code: int) -> None:
        """Handle the exit of a process; called in a thread of roslaunch."""


class ApiLauncher(Launcher):
    """A launcher that notifies listeners, and keeps the Process of each node that it started."""

    def __init__(
        self, spec: LaunchSpec, environment: Environment, options: RunOptions | None = None, run_id: str = ""
    ) -> None:
        super().__init__(spec, environment, Packages(environment), options, Output(title=False))
        self.run_id = run_id
        self.listeners: list[ProcessListener] = []
        self.known: dict[str, Process] = {}

    def command(self, node: NodeSpec) -> list[str]:
        """Return the command of a node. Raise LaunchError."""
        return node_command(node, self._packages)

    def variables(self, node: NodeSpec) -> dict[str, str]:
        """Return the environment of a node's process."""
        return node_environment(node, self._environment)

    @property
    def log_folder(self) -> str:
        """The folder of its nodes' log files."""
        return str(self._master.log_folder)

    def _start_process(self, node: NodeSpec, name: str) -> processes.Process:
        process = super()._start_process(node, name)
        self.known.setdefault(name, Process(self, node, name)).process = process
        return process

    def _on_end(self, process: processes.Process) -> None:
        for listener in tuple(self.listeners):
            try:
                listener.process_died(process.name, process.exit_code or 0)
            except Exception:  # noqa: BLE001 - the program's own; the nodes live on
                self._output.warn(f"ERROR: a process listener failed\n{traceback.format_exc()}")


class Process:
    """A process of a node: a running one, or (of create_node_process) one for start()."""

    def __init__(self, launcher: ApiLauncher, node: NodeSpec, name: str) -> None:
        self.name = name
        self.package = node.package
        self.respawn = node.respawn
        self.respawn_delay = node.respawn_delay
        self.required = node.required
        self.log_output = node.output != "screen"
        self.cwd = node.cwd if node.cwd == "node" else None
        self.run_id = launcher.run_id
        self.log_dir = launcher.log_folder
        self._launcher = launcher
        self._node = node
        self.process: processes.Process | None = None
        """As it was last started."""

    def __str__(self) -> str:
        return f"Process<{self.name}>"

    @property
    def started(self) -> bool:
        """Return whether it was ever started."""
        return self.process is not None

    @property
    def stopped(self) -> bool:
        """Return whether its end was requested."""
        return self.process is not None and self.process.is_ending

    @property
    def popen(self) -> subprocess.Popen[bytes] | None:
        """The process as Python has it."""
        return self.process.popen if self.process else None

    @property
    def pid(self) -> int:
        """The process id; -1 before the start."""
        return self.process.pid if self.process else -1

    @property
    def args(self) -> list[str]:
        """The command."""
        return list(self.process.command if self.process else self._launcher.command(self._node))

    @property
    def env(self) -> dict[str, str]:
        """The variables of its environment."""
        return self._launcher.variables(self._node)

    @property
    def spawn_count(self) -> int:
        """Return the number of its starts."""
        return self.process.starts if self.process else 0

    @property
    def exit_code(self) -> int | None:
        """Its exit status; None while it runs."""
        return self.process.exit_code if self.process else None

    def is_alive(self) -> bool:
        """Return whether it runs. As in ROS, one that was not started yet counts as alive."""
        return self.process is None or self.process.is_running

    def start(self) -> bool:
        """Start it, or start it again where it has ended; whether it runs."""
        before = self.process
        if before and before.is_running:
            return True
        self._launcher.known[self.name] = self
        process = self._launcher.start_node(self._node, self.name)
        if process is None:
            return False
        process.starts += before.starts if before else 0
        return True

    def stop(self, errors: list[str] | None = None) -> None:
        """End it, and wait for that; it is not started again."""
        if self.process:
            self._launcher.supervisor.end_process(self.process)

    def get_info(self) -> dict[str, object]:
        """Return pid, exit code and other facts about it."""
        keys = [
            "package",
            "name",
            "respawn",
            "respawn_delay",
            "required",
            "env",
            "args",
            "pid",
            "spawn_count",
        ]
        info = {key: getattr(self, key) for key in [*keys, "run_id", "log_output"]}
        info["alive"] = self.is_alive()
        if self.exit_code is not None:
            info["exit_code"] = self.exit_code
        return info

    def get_exit_description(self) -> str:
        """Return how it exited."""
        files = f"log file: {os.path.join(self.log_dir, self.name.replace('/', '-'))}*.log"
        if self.exit_code == 0:
            return f"process has finished cleanly\n{files}"
        command = " ".join(self.args)
        if self.exit_code is None:
            return f"process has died without exit code [pid {self.pid}, cmd {command}].\n{files}"
        return f"process has died [pid {self.pid}, exit code {self.exit_code}, cmd {command}].\n{files}"

    def register(self, launcher: ApiLauncher) -> None:
        """Have it watched by another launcher, from its start on."""
        self._launcher = launcher


class ProcessMonitor:
    """The processes of a launch."""

    _living: ClassVar[weakref.WeakSet[ProcessMonitor]] = weakref.WeakSet()
    """Those that a signal ends."""

    def __init__(self, launcher: ApiLauncher) -> None:
        self._launcher = launcher
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None
        self.is_watching = False
        """Whether watch() was called."""
        self._living.add(self)

    @property
    def done(self) -> bool:
        """Return whether all has ended."""
        return self._ended.is_set()

    @property
    def is_shutdown(self) -> bool:
        """Return whether a shutdown was requested."""
        return bool(self._launcher.stopped_by)

    @property
    def procs(self) -> list[Process]:
        """Those that are watched."""
        return [self._launcher.known[process.name] for process in tuple(self._launcher.processes)]

    @property
    def dead_list(self) -> list[Process]:
        """Those that have ended."""
        watched = self.get_active_names()
        return [each for each in self._launcher.known.values() if each.started and each.name not in watched]

    def get_active_names(self) -> list[str]:
        """Return the names of those that are watched."""
        return [process.name for process in self.procs]

    def get_process_names_with_spawn_count(self) -> list[list[tuple[str, int]]]:
        """Return the names of those that are watched, and of those that exited, each with its number of starts."""
        return [[(each.name, each.spawn_count) for each in some] for some in (self.procs, self.dead_list)]

    def has_process(self, name: str) -> bool:
        """Return whether one of this name is watched."""
        return name in self.get_active_names()

    def get_process(self, name: str) -> Process | None:
        """Return the process of this name, or None."""
        return next((process for process in self.procs if process.name == name), None)

    def kill_process(self, name: str) -> bool:
        """End the one of this name; whether there was one."""
        if not isinstance(name, str):
            raise RLException(f"kill_process takes in a process name but was given: {name}")
        process = self.get_process(name)
        if process:
            process.stop()
        return process is not None

    def register(self, p: Process) -> None:
        """Watch a process of create_node_process(); call it before its start()."""
        if self.done:
            raise RLException(f"cannot add process [{p.name}] after process monitor has been shut down")
        p.register(self._launcher)

    def registrations_complete(self) -> None:
        """Let the monitor end with the last process, as no further one will be registered."""
        self._launcher.supervisor.end_with_nodes()

    def add_process_listener(self, l: ProcessListener) -> None:
        """Notify a listener of each process that exits."""
        self._launcher.listeners.append(l)

    def watch(self) -> None:
        """Watch the processes in a thread, and stop them in the end.

        It ends when it is stopped, or when registrations_complete() was called and all processes have exited.
        """

        def watch() -> None:
            try:
                self._launcher.watch(forever=True)
            finally:
                self.close()

        # If the program is killed, so is this thread; then the guardian stops the nodes.
        self._thread = threading.Thread(target=watch, name="roslaunch", daemon=True)
        self.is_watching = True
        self._thread.start()

    def close(self) -> None:
        """End what is left, here and now."""
        self._launcher.close()
        self._ended.set()

    def is_alive(self) -> bool:
        """Return whether it watches."""
        return self.is_watching and not self.done

    def join(self, timeout: float | None = None) -> None:
        """Wait until all has ended, ``timeout`` seconds at most. A listener, in whose thread that is done, cannot wait."""
        if threading.current_thread() is self._thread:
            return
        end = math.inf if timeout is None else time.monotonic() + timeout
        # In slices: on Windows a wait without timeout ignores signals.
        while not self.done and (left := end - time.monotonic()) > 0:
            self._ended.wait(min(0.5, left))

    def mainthread_spin(self) -> None:
        """Wait until all has ended."""
        self.join()

    def mainthread_spin_once(self) -> bool:
        """Return whether it watches on; signals are heard meanwhile."""
        return not self._ended.wait(0.01)

    def shutdown(self) -> None:
        """End all, without waiting for it."""
        self._launcher.stop("shutdown")

    @classmethod
    def living(cls) -> list[ProcessMonitor]:
        """Return all monitors that have not ended."""
        return [monitor for monitor in cls._living if not monitor.done]


def start_process_monitor() -> ProcessMonitor:
    """Return a monitor for processes of create_node_process()."""
    monitor = ProcessMonitor(ApiLauncher(LaunchSpec(), Environment.read()))
    monitor.watch()
    return monitor


def shutdown_process_monitor(process_monitor: ProcessMonitor | None) -> bool:
    """End all that a monitor watches, and wait for that; whether there was a monitor."""
    if process_monitor is None:
        return False
    process_monitor.shutdown()
    if process_monitor.is_watching:
        process_monitor.join()
    return True


def create_node_process(run_id: str | None, node: Node, master_uri: str) -> Process:
    """Return a process for a node, to be started with its start(). Raise NodeParamsException if it has no program."""
    node.give_name()
    launcher = ApiLauncher(
        LaunchSpec(), Environment.read()._replace(master_uri=master_uri), run_id=run_id or ""
    )
    try:
        launcher.command(node.spec)
    except MinirospyError as error:
        raise NodeParamsException(str(error)) from error
    return Process(launcher, node.spec, launcher.process_name(node.spec))


def pmon_shutdown() -> None:
    """End all that this program launched, and wait for that."""
    monitors = ProcessMonitor.living()
    for monitor in monitors:
        monitor.shutdown()
    for monitor in monitors:
        if monitor.is_watching:
            monitor.join()


class _Handler:
    """A signal handler that stops all that this program launched, and then calls the previous handler."""

    def __init__(self, number: signal.Signals) -> None:
        self._before = signal.getsignal(number)
        signal.signal(number, self)

    def __call__(self, number: int, frame: FrameType | None) -> None:
        for monitor in ProcessMonitor.living():
            monitor.shutdown()
        if callable(self._before):
            self._before(number, frame)


def init_signal_handlers() -> None:
    """Have SIGINT, SIGTERM and SIGHUP end all that this program launches, too; in the main thread alone."""
    if threading.current_thread() is not threading.main_thread():
        return
    numbers: Sequence[signal.Signals | None] = [
        getattr(signal, name, None) for name in ("SIGINT", "SIGTERM", "SIGHUP")
    ]
    for number in numbers:
        if number is not None and not isinstance(signal.getsignal(number), _Handler):
            _Handler(number)


_init_signal_handlers = init_signal_handlers


def rl_signal(sig: int, stackframe: FrameType | None) -> None:
    """Handle a signal: stop all that this program launched."""
    pmon_shutdown()
