"""Launching from a program: the classes of roslaunch.parent, roslaunch.scriptapi and roslaunch.launch.

Source: http://wiki.ros.org/roslaunch/API%20Usage.
"""

from __future__ import annotations

import atexit
import contextlib
import logging
import os
import sys
import uuid
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from minirospy.compat.roslaunch.config import (
    LaunchFile,
    Node,
    RLException,
    ROSLaunchConfig,
    XmlLoader,
    load_config_default,
)
from minirospy.compat.roslaunch.pmon import (
    ApiLauncher,
    Process,
    ProcessListener,
    ProcessMonitor,
    init_signal_handlers,
)
from minirospy.environment import Environment
from minirospy.errors import MasterUnreachableError, MinirospyError, RpcError
from minirospy.launch.load import find_files
from minirospy.launch.output import Output
from minirospy.launch.process import Timeouts
from minirospy.launch.runner import RunOptions
from minirospy.runtime.master_proxy import MasterProxy
from minirospy.workspace.packages import Packages

__all__ = [
    "ROSLaunch",
    "ROSLaunchParent",
    "ROSLaunchRunner",
    "get_or_generate_uuid",
    "resolve_launch_arguments",
]

_Function = TypeVar("_Function", bound=Callable[..., Any])


class ROSLaunchRunner:
    """Runs a configuration beside the program. Errors are RLException."""

    def __init__(
        self,
        run_id: str,
        config: ROSLaunchConfig,
        server_uri: str | None = None,
        pmon: ProcessMonitor | None = None,
        is_core: bool = False,
        remote_runner: object = None,
        is_child: bool = False,
        is_rostest: bool = False,
        num_workers: int = 3,
        timeout: float | None = None,
        master_logger_level: str | bool = False,
        sigint_timeout: float = 15.0,
        sigterm_timeout: float = 2.0,
        *,
        options: RunOptions | None = None,
    ) -> None:
        if not run_id:
            raise RLException("run_id is empty")
        if sigint_timeout <= 0 or sigterm_timeout <= 0:
            raise RLException("sigint_timeout and sigterm_timeout must be positive numbers")
        self.run_id = run_id
        self.config = config
        self._pid = os.getpid()
        self._environment = config.master.environment
        if is_core and config.master.is_running():
            raise RLException("roscore cannot run as another roscore/master is already running.")
        self._options = options or RunOptions(
            summary=False,
            timeouts=Timeouts(sigint_timeout, sigterm_timeout),
            master_arguments=_master_words(timeout, master_logger_level),
        )
        for node in config.nodes:
            node.give_name()
        self._launcher = ApiLauncher(config.spec, self._environment, self._options, run_id)
        self.pm: ProcessMonitor | None = ProcessMonitor(self._launcher)

    def launch(self) -> tuple[list[str], list[str]]:
        """Start everything; the names of the processes that were started, and those of the nodes that were not.

        Raises RLException.
        """
        monitor = self._monitor()
        _replaced("roslaunch.pmon", "_init_signal_handlers", init_signal_handlers)()
        try:
            self._launcher.start()
        except (MinirospyError, RpcError) as error:
            monitor.close()
            raise RLException(str(error)) from error
        except KeyboardInterrupt:
            monitor.close()
            raise
        monitor.watch()
        # Where the program ends without stop(), what it launched ends in order.
        atexit.register(self._end_with_program)
        return [str(process) for process in monitor.procs], [node.base_name for node in self._launcher.failed]

    def launch_node(self, node: Node, core: bool = False) -> tuple[Process | str, bool]:
        """Start one more node: (its process, True), or (its name, False) where that cannot be. Raises RLException."""
        if self._monitor().done:
            raise RLException(f"cannot add process [{node.name}] after process monitor has been shut down")
        node.give_name()
        process = self._launcher.start_node(node.spec)
        return (self._launcher.known[process.name], True) if process else (node.name or "", False)

    def is_node_running(self, node: Node) -> bool:
        """Whether a node was started here, and runs."""
        name = node.spec.name
        return any(
            each.node and each.node.name == name and each.is_running for each in self._launcher.processes
        )

    def add_process_listener(self, l: ProcessListener) -> None:
        """Have it told of each end."""
        self._launcher.listeners.append(l)

    def spin(self) -> None:
        """Wait until all nodes have ended, or a signal came; then end what is left. Without a node it does not wait."""
        monitor = self._monitor()
        try:
            if self._launcher.is_anything_left():
                monitor.mainthread_spin()
            elif not monitor.done:
                Output(title=False).say("No processes to monitor", bold=True)
        except KeyboardInterrupt:
            # As in ROS, where it ends the nodes, and not the program.
            pass
        finally:
            self.stop()

    def spin_once(self) -> bool:
        """Whether it runs on; signals are heard meanwhile."""
        return self.pm is not None and self.pm.mainthread_spin_once()

    def stop(self) -> None:
        """End all, and wait for that. Idempotent."""
        monitor, self.pm = self.pm, None
        if monitor is None:
            return
        atexit.unregister(self._end_with_program)
        if monitor.is_watching:
            monitor.shutdown()
            monitor.join()
        else:
            monitor.close()

    def _end_with_program(self) -> None:
        # A child that the program has forked ends alone.
        if os.getpid() == self._pid:
            self.stop()

    def _monitor(self) -> ProcessMonitor:
        if self.pm is None:
            raise RLException("the process monitor was shut down")
        return self.pm

    def _load_parameters(self) -> None:
        """Set the parameters, and nothing else. Raises RLException."""
        try:
            self._launcher.set_parameters()
        except (MinirospyError, RpcError) as error:
            raise RLException(str(error)) from error


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
        self.logger = logging.getLogger("roslaunch.parent")
        self.run_id = run_id
        self.roslaunch_files = roslaunch_files
        self.roslaunch_strs = roslaunch_strs
        self.is_core = is_core
        self.port = port
        self.local_only = local_only
        self.process_listeners = process_listeners
        self.verbose = verbose
        self.force_screen = force_screen
        self.force_log = force_log
        self.force_required = force_required
        self.show_summary = show_summary
        self.config: ROSLaunchConfig | None = None
        self.runner: ROSLaunchRunner | None = None
        self.pm: ProcessMonitor | None = None
        self.server = self.remote_runner = None
        self._master_words = _master_words(timeout, master_logger_level)
        self._timeouts = Timeouts(sigint_timeout, sigterm_timeout)

    def start(self, auto_terminate: bool = True) -> None:
        """Start everything; it comes back when all was started. Raises RLException.

        Where ``auto_terminate`` is not set, it does not end with the last node.
        """
        if self.runner is not None:
            raise RLException("this roslaunch instance has been started before: make another one")
        if self.config is None:
            self._load_config()
        assert self.config
        runner = ROSLaunchRunner(self.run_id, self.config, is_core=self.is_core, options=self._options())
        for listener in self.process_listeners or ():
            runner.add_process_listener(listener)
        self.runner, self.pm = runner, runner.pm
        try:
            runner.launch()
        except RLException:
            # So that it may be tried again.
            self.runner = None
            raise
        if auto_terminate and self.pm:
            self.pm.registrations_complete()

    def spin(self) -> None:
        """Wait until all nodes have ended, or a signal came; then end what is left."""
        if self.runner is None:
            raise RLException("parent not started yet")
        if self.runner.pm:
            self.runner.spin()

    def spin_once(self) -> bool:
        """Whether it runs on; signals are heard meanwhile."""
        return self.runner is not None and self.runner.spin_once()

    def shutdown(self) -> None:
        """End all, and wait for that. Idempotent."""
        if self.runner:
            self.runner.stop()

    def _load_config(self) -> None:
        """Fill ``config``; programs overwrite this to fill it otherwise."""
        load = _replaced("roslaunch.config", "load_config_default", load_config_default)
        self.config = load(
            self.roslaunch_files, self.port, roslaunch_strs=self.roslaunch_strs, verbose=self.verbose
        )

    def _options(self) -> RunOptions:
        return RunOptions(
            screen=self.force_screen,
            log=self.force_log,
            required=self.force_required,
            local=self.local_only,
            summary=self.show_summary,
            timeouts=self._timeouts,
            master_arguments=self._master_words,
        )


class ROSLaunch:
    """Starts nodes one by one: ``start()``, ``launch(Node(...))``, ``stop()``. Errors are RLException."""

    def __init__(self) -> None:
        self.parent = ROSLaunchParent(get_or_generate_uuid(None, True), [])
        self.started = False

    def load(self, f: str) -> None:
        """Have start() run a launch file, too."""
        XmlLoader().load(f, self._config)

    def load_str(self, s: str) -> None:
        """Have start() run the text of a launch file, too."""
        XmlLoader().load_string(s, self._config)

    def start(self) -> None:
        """Begin; nodes can now be launched."""
        self.parent.start(auto_terminate=False)
        self.started = True

    def launch(self, node: Node) -> Process:
        """Start a node."""
        if not self.started or self.parent.runner is None:
            raise RLException("please start ROSLaunch first")
        if not isinstance(node, Node):
            raise ValueError("arg must be of type Node")
        process, _ = self.parent.runner.launch_node(node)
        if isinstance(process, str):
            raise RLException(f"failed to launch {node.package}/{node.type}")
        return process

    def spin(self) -> None:
        """Wait for the end."""
        self.parent.spin()

    def spin_once(self) -> bool:
        """Whether it runs on."""
        return self.parent.spin_once()

    def stop(self) -> None:
        """End all."""
        self.parent.shutdown()

    @property
    def _config(self) -> ROSLaunchConfig:
        if self.parent.config is None:
            self.parent.config = ROSLaunchConfig()
        return self.parent.config


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
    try:
        return find_files([word for word in args if ":=" not in word], Packages())
    except MinirospyError as error:
        raise RLException(str(error)) from error


def _master_answers(environment: Environment) -> bool:
    with contextlib.closing(MasterProxy(environment.master_uri, "/roslaunch")) as master:
        return master.is_online()


def _master_words(timeout: float | None, logger_level: str | bool) -> tuple[str, ...]:
    """The options of a master that is started."""
    words: list[str] = ["--timeout", str(timeout)] if timeout is not None else []
    words += ["--master-logger-level", str(logger_level)] if logger_level else []
    return tuple(words)


def _replaced(module: str, name: str, ours: _Function) -> _Function:
    """A function of roslaunch's modules: what the program has put in its place, if it has.

    Programs silence roslaunch's signal handlers that way (``roslaunch.pmon._init_signal_handlers = ...``).
    """
    function: _Function = getattr(sys.modules.get(module), name, ours)
    return function
