"""The classes of roslaunch.pmon and roslaunch.nodeprocess, which manage a program's processes with a Launcher.

Source: http://wiki.ros.org/roslaunch/API%20Usage.
"""

from __future__ import annotations

import contextlib
import logging
import math
import os
import signal
import subprocess
import sys
import threading
import time
import traceback
import weakref
from collections.abc import Sequence
from dataclasses import replace
from types import FrameType
from typing import ClassVar

from minirospy.base.clock import SignalSafeEvent
from minirospy.base.environment import Environment
from minirospy.base.errors import MinirospyError
from minirospy.ros.roslaunch.launcher import process as processes
from minirospy.ros.roslaunch.launcher.command import node_command, node_environment
from minirospy.ros.roslaunch.launcher.output import Output
from minirospy.ros.roslaunch.launcher.preload import ForkedProcess
from minirospy.ros.roslaunch.launcher.runner import Launcher, RunOptions
from minirospy.ros.roslaunch.launcher.spec import LaunchSpec, NodeSpec
from minirospy.ros.roslaunch.own_processes import DeadProcess, OwnProcesses, Process, ProcessListener
from minirospy.ros.roslaunch.roslaunch.core import Node, RLException
from minirospy.ros.roslaunch.roslaunch.node_args import NodeParamsException
from minirospy.workspace.packages import Packages

__all__ = [
    "DeadProcess",
    "FatalProcessLaunch",
    "Process",
    "ProcessListener",
    "ProcessMonitor",
    "RLException",
    "_init_signal_handlers",
    "_shutting_down",
    "pmon_shutdown",
    "rl_signal",
    "shutdown_process_monitor",
    "start_process_monitor",
]


class ApiLauncher(Launcher):
    """A launcher that notifies listeners and keeps a Process for each started node."""

    def __init__(
        self, spec: LaunchSpec, environment: Environment, options: RunOptions | None = None, run_id: str = ""
    ) -> None:
        options = replace(options or RunOptions(), inherit_stdin=True)
        super().__init__(spec, environment, Packages(environment), options, Output(title=False))
        self.run_id = run_id
        self.listeners: list[ProcessListener] = []
        self.known: dict[str, LaunchedProcess] = {}

    def command(self, node: NodeSpec) -> list[str]:
        """Return a node's command. Raise LaunchError if it cannot be built."""
        return node_command(node, self._packages)

    def variables(self, node: NodeSpec) -> dict[str, str]:
        """Return the environment variables for a node's process."""
        return node_environment(node, self._environment)

    @property
    def log_folder(self) -> str:
        """Return the folder for nodes' log files."""
        return str(self._master.log_folder)

    def _start_process(self, node: NodeSpec, name: str) -> processes.Process:
        process = super()._start_process(node, name)
        self.known.setdefault(name, LaunchedProcess(self, node, name)).process = process
        return process

    def _on_end(self, process: processes.Process) -> None:
        self.notify(process.name, process.exit_code or 0)

    def notify(self, name: str, code: int) -> None:
        """Notify all listeners of a process's exit; print the error of any listener that fails."""
        for listener in tuple(self.listeners):
            try:
                listener.process_died(name, code)
            except Exception:  # noqa: BLE001 - the program's own; the nodes live on
                self._output.warn(f"ERROR: a process listener failed\n{traceback.format_exc()}")


class FatalProcessLaunch(RLException):
    """Raised if a process failed to start and the launch cannot continue."""


class LaunchedProcess(Process):
    """A node's process, running or, after create_node_process(), not yet started."""

    def __init__(self, launcher: ApiLauncher, node: NodeSpec, name: str) -> None:
        # Do not set `args`, `env`, `spawn_count` and `exit_code`: as properties, they return the process's current
        # values.
        self.name = name
        self.package = node.package
        self.respawn = node.respawn
        self.respawn_delay = node.respawn_delay
        self.required = node.required
        self.lock = threading.Lock()
        self.time_of_death = None
        self.log_output = node.output != "screen"
        self.cwd = node.cwd if node.cwd == "node" else None
        self.run_id = launcher.run_id
        self.log_dir = launcher.log_folder
        self._launcher = launcher
        self._node = node
        self.process: processes.Process | None = None  # the last process started

    @property
    def started(self) -> bool:
        """Return whether the process was ever started."""
        return self.process is not None

    @property
    def stopped(self) -> bool:
        """Return whether the process has been told to exit."""
        return self.process is not None and self.process.is_ending

    @property
    def popen(self) -> subprocess.Popen[bytes] | ForkedProcess | None:
        """Return the process with the interface of subprocess.Popen."""
        return self.process.popen if self.process else None

    @property
    def pid(self) -> int:
        """Return the process id, or -1 before the process starts."""
        return self.process.pid if self.process else -1

    @property
    def args(self) -> list[str]:  # type: ignore[override]
        """Return the node's command."""
        return list(self.process.command if self.process else self._launcher.command(self._node))

    @property
    def env(self) -> dict[str, str]:  # type: ignore[override]
        """Return the node's environment variables."""
        return self._launcher.variables(self._node)

    @property
    def spawn_count(self) -> int:  # type: ignore[override]
        """Return the number of starts."""
        return self.process.starts if self.process else 0

    @property
    def exit_code(self) -> int | None:  # type: ignore[override]
        """Return the exit status, or None while the process is running."""
        return self.process.exit_code if self.process else None

    def is_alive(self) -> bool:
        """Return whether the process is running. As in ROS, return True before its first start."""
        return self.process is None or self.process.is_running

    def start(self) -> bool:
        """Start the process, or restart it after its exit; return whether it is running."""
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
        """Terminate the process and wait for its exit, without restarting it."""
        if self.process:
            self._launcher.supervisor.end_process(self.process)

    def get_info(self) -> dict[str, object]:
        """Return the process's id, exit status and other details."""
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
        """Describe how the process exited."""
        files = f"log file: {os.path.join(self.log_dir, self.name.replace('/', '-'))}*.log"
        if self.exit_code == 0:
            return f"process has finished cleanly\n{files}"
        command = " ".join(self.args)
        if self.exit_code is None:
            return f"process has died without exit code [pid {self.pid}, cmd {command}].\n{files}"
        return f"process has died [pid {self.pid}, exit code {self.exit_code}, cmd {command}].\n{files}"

    def register(self, launcher: ApiLauncher) -> None:
        """Let ``launcher`` start and watch the process, in place of the launcher given to the constructor."""
        self._launcher = launcher


class ProcessMonitor:
    """Watches the processes of a launch."""

    _living: ClassVar[weakref.WeakSet[ProcessMonitor]] = weakref.WeakSet()
    """The monitors whose processes a signal or pmon_shutdown() terminates. Monitors created by programs are not included."""

    def __init__(self, name: str = "ProcessMonitor", *, launcher: ApiLauncher | None = None) -> None:
        self.name = name
        self._launcher = launcher or ApiLauncher(LaunchSpec(), Environment.read())
        self._ended = SignalSafeEvent()
        self._thread: threading.Thread | None = None
        self.is_watching = False  # whether watch() has been called
        if launcher is not None:
            self._living.add(self)

        self._own = OwnProcesses(
            on_exit=self._launcher.notify,
            on_required_exit=self.shutdown,
            on_last_exit=self._launcher.supervisor.end_with_nodes,
        )
        self.plock = self._own.lock
        self.core_procs: list[Process] = []

    daemon = True  # an attribute of threading.Thread, the base class in ROS

    def getName(self) -> str:
        """Return the monitor's name."""
        return self.name

    def has_main_thread_jobs(self) -> bool:
        """Return False: the main thread has nothing to do."""
        return False

    def do_main_thread_jobs(self) -> None:
        """Do nothing: no process needs to be started in the main thread."""

    @property
    def listeners(self) -> list[ProcessListener]:
        """Return the objects to notify when processes exit."""
        return self._launcher.listeners

    @property
    def done(self) -> bool:
        """Return whether all processes have exited."""
        return self._ended.is_set()

    @property
    def is_shutdown(self) -> bool:
        """Return whether a shutdown was requested or has started."""
        return self._own.is_stopping

    @property
    def procs(self) -> list[Process]:
        """Return the watched processes."""
        launched = [self._launcher.known[process.name] for process in tuple(self._launcher.processes)]
        return [*launched, *self._own.watched]

    @property
    def dead_list(self) -> list[Process]:
        """Return the exited processes."""
        watched = self.get_active_names()
        known = tuple(self._launcher.known.values())
        launched = [each for each in known if each.started and each.name not in watched]
        return [*launched, *self._own.dead]

    def get_active_names(self) -> list[str]:
        """Return the names of the watched processes."""
        return [process.name for process in self.procs]

    def get_process_names_with_spawn_count(self) -> list[list[tuple[str, int]]]:
        """Return [watched, exited]: two lists of (process name, number of starts)."""
        return [[(each.name, each.spawn_count) for each in some] for some in (self.procs, self.dead_list)]

    def has_process(self, name: str) -> bool:
        """Return whether a watched process has this name."""
        return name in self.get_active_names()

    def get_process(self, name: str) -> Process | None:
        """Return the process with this name, or None."""
        return next((process for process in self.procs if process.name == name), None)

    def kill_process(self, name: str) -> bool:
        """Terminate the process with this name; return whether it exists."""
        if not isinstance(name, str):
            raise RLException(f"kill_process takes in a process name but was given: {name}")
        process = self.get_process(name)
        if not isinstance(process, LaunchedProcess):
            Output(title=False).print(f"[{name}] kill requested")
        if process:
            process.stop([])
        return process is not None

    def register(self, p: Process) -> None:
        """Watch a process. For a process from create_node_process(), call this before the process's start().

        Raise RLException if another process has its name, or after a shutdown.
        """
        with self.plock:
            if self.is_shutdown:
                raise RLException(f"cannot add process [{p.name}] after process monitor has been shut down")
            if isinstance(p, LaunchedProcess):
                p.register(self._launcher)
                return
            if self.has_process(p.name):
                text = f"cannot add process with duplicate name '{p.name}'"
                logging.getLogger("roslaunch.pmon").error(
                    "%s.register[%s] failed %s", self.name, p.name, text
                )
                raise RLException(text)
            self._own.watched.append(p)
            if self.is_watching:
                self._own.start(self.name)

    def register_core_proc(self, p: Process) -> None:
        """Watch a process that belongs to the launch itself, such as the master."""
        self.register(p)
        self.core_procs.append(p)

    def unregister(self, p: Process) -> None:
        """Stop watching a process without terminating it. Raise ValueError if it is not watched."""
        with self.plock:
            self._own.watched.remove(p)

    def registrations_complete(self) -> None:
        """Let the monitor stop after the last process exits: no more processes will be registered."""
        with self.plock:
            self._own.is_complete = True
            if not self._own.watched:
                self._launcher.supervisor.end_with_nodes()

    def add_process_listener(self, l: ProcessListener) -> None:
        """Add a listener to notify when a process exits."""
        self._launcher.listeners.append(l)

    def watch(self) -> None:
        """Start a thread that watches the processes and, when it stops, terminates them.

        The thread stops after shutdown(), or after registrations_complete() when all processes have exited.
        """

        def watch() -> None:
            try:
                self._launcher.watch(forever=True)
            finally:
                self.close()

        # If the program is killed, this thread dies too, and the guardian terminates the nodes.
        self._thread = threading.Thread(target=watch, name="roslaunch", daemon=True)
        self.is_watching = True
        self._thread.start()
        self._own.start(self.name)

    def start(self) -> None:
        """Do the same as :meth:`watch`."""
        self.watch()

    def close(self) -> None:
        """Terminate the remaining processes, in the calling thread."""
        # Call both callbacks even after an error: other threads wait until the shutdown is complete.
        with contextlib.ExitStack() as stack:
            stack.callback(self._ended.set)
            stack.callback(self._launcher.close)
            self._own.close(self.core_procs)

    def is_alive(self) -> bool:
        """Return whether the monitor is watching."""
        return self.is_watching and not self.done

    def join(self, timeout: float | None = None) -> None:
        """Wait up to ``timeout`` seconds until all processes have exited; return immediately in a listener's thread."""
        if threading.current_thread() in (self._thread, self._own.thread):
            return
        end = math.inf if timeout is None else time.monotonic() + timeout
        # Wait in slices: on Windows, a wait without a timeout ignores signals.
        while not self.done and (left := end - time.monotonic()) > 0:
            self._ended.wait(min(0.5, left))

    def mainthread_spin(self) -> None:
        """Wait until all processes have exited."""
        self.join()

    def mainthread_spin_once(self) -> bool:
        """Handle pending signals; return whether the monitor is still watching."""
        return not self._ended.wait(0.01)

    def shutdown(self) -> None:
        """Terminate all processes without waiting for their exit."""
        # Acquire no lock, not even an Event's: a signal handler may interrupt this method and call it again.
        self._own.is_stopping = True
        self._launcher.stop("shutdown")

    @classmethod
    def living(cls) -> list[ProcessMonitor]:
        """Return all monitors that are not done."""
        return [monitor for monitor in cls._living if not monitor.done]


_shutting_down = False  # programs set this to False to launch again after a signal


def start_process_monitor() -> ProcessMonitor | None:
    """Return a monitor for registered processes, or None if the program has set ``_shutting_down``."""
    if getattr(sys.modules.get("roslaunch.pmon"), "_shutting_down", False):
        return None
    monitor = ProcessMonitor(launcher=ApiLauncher(LaunchSpec(), Environment.read()))
    monitor.watch()
    return monitor


def shutdown_process_monitor(process_monitor: ProcessMonitor | None) -> bool:
    """Terminate a monitor's processes and wait for their exit; return whether there was a monitor."""
    if process_monitor is None:
        return False
    process_monitor.shutdown()
    if process_monitor.is_watching:
        process_monitor.join()
    return True


def create_node_process(run_id: str | None, node: Node, master_uri: str) -> LaunchedProcess:
    """Return a node's process without starting it. Raise NodeParamsException if the node has no program."""
    node.give_name()
    launcher = ApiLauncher(
        LaunchSpec(), Environment.read()._replace(master_uri=master_uri), run_id=run_id or ""
    )
    try:
        launcher.command(node.spec)
    except MinirospyError as error:
        raise NodeParamsException(str(error)) from error
    return LaunchedProcess(launcher, node.spec, launcher.process_name(node.spec))


def pmon_shutdown() -> None:
    """Terminate all processes launched by this program and wait for their exit."""
    monitors = ProcessMonitor.living()
    for monitor in monitors:
        monitor.shutdown()
    for monitor in monitors:
        if monitor.is_watching:
            monitor.join()


class _Handler:
    """A signal handler that stops everything this program has launched, then calls the previous handler."""

    def __init__(self, number: signal.Signals) -> None:
        self._before = signal.getsignal(number)
        signal.signal(number, self)

    def __call__(self, number: int, frame: FrameType | None) -> None:
        for monitor in ProcessMonitor.living():
            monitor.shutdown()
        if callable(self._before):
            self._before(number, frame)


def init_signal_handlers() -> None:
    """Make SIGINT, SIGTERM and SIGHUP also terminate all launched processes. Works only in the main thread.

    A SIGHUP that is ignored, as under nohup, stays ignored.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    numbers: Sequence[signal.Signals | None] = [
        getattr(signal, name, None) for name in ("SIGINT", "SIGTERM", "SIGHUP")
    ]
    for number in numbers:
        if number is None or isinstance(handler := signal.getsignal(number), _Handler):
            continue
        if (number.name, handler) != ("SIGHUP", signal.SIG_IGN):
            _Handler(number)


_init_signal_handlers = init_signal_handlers


def rl_signal(sig: int, stackframe: FrameType | None) -> None:
    """Handle a signal: stop everything this program has launched."""
    pmon_shutdown()
