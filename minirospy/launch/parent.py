"""Launching from a program: the classes of roslaunch.parent, roslaunch.scriptapi and roslaunch.pmon.

Source: http://wiki.ros.org/roslaunch/API%20Usage.
"""

from __future__ import annotations

import signal
import threading
import uuid
from collections.abc import Sequence
from types import FrameType
from typing import Any

from minirospy.environment import Environment
from minirospy.errors import MasterUnreachableError, MinirospyError, RpcError
from minirospy.launch import process as processes
from minirospy.launch.config import (
    LaunchFile,
    Node,
    RLException,
    ROSLaunchConfig,
    XmlLoader,
    load_config_default,
)
from minirospy.launch.load import find_files
from minirospy.launch.output import Output
from minirospy.launch.process import Timeouts
from minirospy.launch.runner import Launcher, RunOptions
from minirospy.launch.spec import LaunchSpec
from minirospy.runtime.master_proxy import MasterProxy
from minirospy.workspace.packages import Packages

__all__ = [
    "Process",
    "ProcessListener",
    "ProcessMonitor",
    "ROSLaunch",
    "ROSLaunchParent",
    "get_or_generate_uuid",
    "resolve_launch_arguments",
]


class ProcessListener:
    """Hears of the end of processes."""

    def process_died(self, process_name: str, exit_code: int) -> None:
        """A process has ended; called in a thread of roslaunch's own."""


class Process:
    """A launched process."""

    def __init__(self, launcher: _Launcher, process: processes.Process) -> None:
        self._launcher = launcher
        self._process = process
        self.name = process.name
        self.package = process.node.package if process.node else "rosmaster"
        self.respawn = bool(process.node and process.node.respawn)
        self.required = bool(process.node and process.node.required)

    @property
    def pid(self) -> int:
        """The process id."""
        return self._now.pid

    @property
    def args(self) -> list[str]:
        """The command."""
        return list(self._now.command)

    @property
    def spawn_count(self) -> int:
        """How often it was started."""
        return self._now.starts

    @property
    def exit_code(self) -> int | None:
        """Its exit status; None while it runs."""
        return self._now.exit_code

    def is_alive(self) -> bool:
        """Whether it runs."""
        return self._now.is_running

    def stop(self, errors: list[str] | None = None) -> None:
        """End it, and wait for that; it is not started again."""
        self._launcher.end_process(self._now)

    def get_info(self) -> dict[str, Any]:
        """What is known of it."""
        return {
            "package": self.package, "name": self.name, "alive": self.is_alive(), "respawn": self.respawn,
            "required": self.required, "spawn_count": self.spawn_count, "args": self.args, "pid": self.pid,
            "exit_code": self.exit_code,
        }  # fmt: skip

    def get_exit_description(self) -> str:
        """How it ended."""
        if not self.exit_code:
            return f"process has finished cleanly\nlog file: {self._now.log_files}"
        command = " ".join(self.args)
        how = f"process has died [pid {self.pid}, exit code {self.exit_code}, cmd {command}]."
        return f"{how}\nlog file: {self._now.log_files}"

    @property
    def _now(self) -> processes.Process:
        """The process as it was last started."""
        for process in tuple(self._launcher.processes):
            if process.name == self.name:
                self._process = process
        return self._process


class _Launcher(Launcher):
    """A launcher that tells listeners."""

    listeners: list[ProcessListener]

    def _on_end(self, process: processes.Process) -> None:
        for listener in self.listeners:
            listener.process_died(process.name, process.exit_code or 0)


class ProcessMonitor:
    """The processes of a launch."""

    def __init__(self, launcher: _Launcher) -> None:
        self._launcher = launcher

    @property
    def procs(self) -> list[Process]:
        """Those that are watched."""
        return [Process(self._launcher, process) for process in tuple(self._launcher.processes)]

    def get_active_names(self) -> list[str]:
        """The names of those that are watched."""
        return [process.name for process in self.procs]

    def has_process(self, name: str) -> bool:
        """Whether one of this name is watched."""
        return name in self.get_active_names()

    def get_process(self, name: str) -> Process | None:
        """The one of this name."""
        return next((process for process in self.procs if process.name == name), None)

    def kill_process(self, name: str) -> bool:
        """End the one of this name; whether there was one."""
        process = self.get_process(name)
        if process:
            process.stop()
        return process is not None

    def add_process_listener(self, l: ProcessListener) -> None:  # noqa: E741 - ROS's name
        """Have it told of each end."""
        self._launcher.listeners.append(l)

    def shutdown(self) -> None:
        """End all."""
        self._launcher.stop("shutdown")


class ROSLaunchParent:
    """Runs launch files (paths, or paths with arguments) beside the program. Errors are RLException."""

    def __init__(
        self,
        run_id: str,
        roslaunch_files: Sequence[LaunchFile],
        is_core: bool = False,
        port: int | None = None,
        local_only: bool = False,
        process_listeners: Sequence[ProcessListener] | None = None,
        verbose: bool = False,
        force_screen: bool = False,
        force_log: bool = False,
        is_rostest: bool = False,
        roslaunch_strs: Sequence[str] | None = None,
        num_workers: int = 3,
        timeout: float | None = None,
        master_logger_level: str | bool = False,
        show_summary: bool = True,
        force_required: bool = False,
        sigint_timeout: float = 15.0,
        sigterm_timeout: float = 2.0,
    ) -> None:
        if sigint_timeout <= 0 or sigterm_timeout <= 0:
            raise RLException("sigint_timeout and sigterm_timeout must be positive numbers")
        self.run_id = run_id
        self.config: ROSLaunchConfig | None = None
        self.pm: ProcessMonitor | None = None
        self._files = list(roslaunch_files)
        self._texts = list(roslaunch_strs or ())
        self._is_core = is_core
        self._port = port
        self._listeners = list(process_listeners or ())
        words: list[str] = ["--timeout", str(timeout)] if timeout is not None else []
        words += ["--master-logger-level", str(master_logger_level)] if master_logger_level else []
        self._options = RunOptions(
            screen=force_screen,
            log=force_log,
            required=force_required,
            local=local_only,
            summary=show_summary,
            timeouts=Timeouts(sigint_timeout, sigterm_timeout),
            master_arguments=tuple(words),
        )
        self._launcher: _Launcher | None = None
        self._ended = threading.Event()

    def start(self, auto_terminate: bool = True) -> None:
        """Start everything; it comes back when all was started. Raises RLException."""
        self.config = load_config_default(self._files, self._port, self._texts)
        self._start(self.config.spec)

    def spin(self) -> None:
        """Wait until all nodes have ended, or a signal came; then end what is left."""
        if self._launcher is None:
            raise RLException("this roslaunch instance has not been started")
        try:
            # In slices: on Windows a wait without end hears no signal.
            while not self._ended.wait(0.5):
                pass
        finally:
            self.shutdown()

    def spin_once(self) -> bool:
        """Whether it runs on; signals are heard meanwhile."""
        return self._launcher is not None and not self._ended.wait(0.01)

    def shutdown(self) -> None:
        """End all, and wait for that. Idempotent."""
        if self._launcher:
            self._launcher.stop("shutdown")
            self._ended.wait()

    def launch(self, node: Node) -> Process:
        """Start one more node. Raises RLException."""
        if self._launcher is None or self._ended.is_set():
            raise RLException("roslaunch has not been started, or was stopped")
        process = self._launcher.start_node(node.spec)
        if process is None:
            raise RLException(f"cannot launch node of type [{node.package}/{node.type}]")
        return Process(self._launcher, process)

    def _start(self, spec: LaunchSpec, *, forever: bool = False) -> None:
        if self._launcher is not None:
            raise RLException("this roslaunch instance has been started before")
        environment = Environment.read()
        if self._port:
            environment = environment._replace(master_uri=f"http://{environment.uri_host}:{self._port}")
        if self._is_core and _master_answers(environment):
            raise RLException("roscore cannot run as another roscore/master is already running.")
        launcher = _Launcher(spec, environment, Packages(environment), self._options, Output(title=False))
        launcher.listeners, launcher.run_id = self._listeners, self.run_id
        self._launcher, self.pm = launcher, ProcessMonitor(launcher)
        try:
            launcher.start()
        except (MinirospyError, RpcError) as error:
            launcher.close()
            self._ended.set()
            raise RLException(str(error)) from error

        def watch() -> None:
            try:
                launcher.watch(forever=forever)
            finally:
                launcher.close()
                self._ended.set()

        # Where the program ends without shutdown(), this thread does, and the guardian ends the nodes.
        threading.Thread(target=watch, name="roslaunch", daemon=True).start()
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._end_at(number)

    def _end_at(self, number: signal.Signals) -> None:
        """End all at a signal, too; whoever handled it before does so still."""
        before = signal.getsignal(number)

        def on_signal(signum: int, frame: FrameType | None) -> None:
            if self._launcher:
                self._launcher.stop(signal.Signals(signum).name)
            signal.signal(signum, before)
            if callable(before):
                before(signum, frame)

        signal.signal(number, on_signal)


class ROSLaunch:
    """Starts nodes one by one: ``start()``, ``launch(Node(...))``, ``stop()``. Errors are RLException."""

    def __init__(self) -> None:
        self.parent = ROSLaunchParent(get_or_generate_uuid(None, True), [], show_summary=False)
        self.started = False
        self._config = ROSLaunchConfig()

    def load(self, f: str) -> None:
        """Have start() run a launch file, too."""
        XmlLoader().load(f, self._config)

    def load_str(self, s: str) -> None:
        """Have start() run the text of a launch file, too."""
        XmlLoader().load_string(s, self._config)

    def start(self) -> None:
        """Begin; nodes can now be launched."""
        self.parent._start(self._config.spec, forever=True)
        self.started = True

    def launch(self, node: Node) -> Process:
        """Start a node."""
        if not self.started:
            raise RLException("please start ROSLaunch first")
        if not isinstance(node, Node):
            raise ValueError("arg must be of type Node")
        return self.parent.launch(node)

    def spin(self) -> None:
        """Wait for the end."""
        self.parent.spin()

    def spin_once(self) -> bool:
        """Whether it runs on."""
        return self.parent.spin_once()

    def stop(self) -> None:
        """End all."""
        self.parent.shutdown()


def get_or_generate_uuid(options_runid: str | None, options_wait_for_master: bool) -> str:
    """The run id: the given one, that of the master, or (where none answers) a new one."""
    if options_runid:
        return options_runid
    master = MasterProxy(Environment.read().master_uri, "/roslaunch")
    try:
        return str(master.get_param("/run_id"))
    except (MasterUnreachableError, RpcError):
        return str(uuid.uuid1())
    finally:
        master.close()


def resolve_launch_arguments(args: Sequence[str]) -> list[str]:
    """The paths of the launch files that a command line (package and file, or files) names. Raises RLException."""
    words = [word for word in args if ":=" not in word]
    if not words:
        raise RLException("no launch file is named")
    try:
        return find_files(words, Packages())
    except MinirospyError as error:
        raise RLException(str(error)) from error


def _master_answers(environment: Environment) -> bool:
    master = MasterProxy(environment.master_uri, "/roslaunch")
    try:
        master.get_pid()
    except MasterUnreachableError:
        return False
    finally:
        master.close()
    return True
