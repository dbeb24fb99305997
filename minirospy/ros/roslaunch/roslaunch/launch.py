"""roslaunch.launch: runs a configuration that a program has built."""

from __future__ import annotations

import atexit
import os
import sys
import time
from collections.abc import Callable, Iterable
from typing import TypeVar

from minirospy.base.errors import MinirospyError, RpcError
from minirospy.ros.roslaunch.launcher.output import Output
from minirospy.ros.roslaunch.launcher.process import Timeouts
from minirospy.ros.roslaunch.launcher.runner import RunOptions
from minirospy.ros.roslaunch.roslaunch.config import ROSLaunchConfig
from minirospy.ros.roslaunch.roslaunch.core import Machine, Master, Node, Param, RLException, Test
from minirospy.ros.roslaunch.roslaunch.pmon import (
    ApiLauncher,
    Process,
    ProcessListener,
    ProcessMonitor,
    init_signal_handlers,
    start_process_monitor,
)
from minirospy.ros.roslaunch.roslaunch.pmon import ProcessListener as ROSLaunchListener

__all__ = [
    "Machine",
    "Master",
    "Node",
    "Param",
    "ProcessListener",
    "RLException",
    "RLTestTimeoutException",
    "ROSLaunchListener",
    "ROSLaunchRunner",
    "Test",
    "_unify_clear_params",
    "start_process_monitor",
]

_POLL_SECONDS = 0.05

Function = TypeVar("Function", bound=Callable[..., object])


class RLTestTimeoutException(RLException):
    """Raised if a test exceeded its time limit."""


class ROSLaunchRunner:
    """Runs a configuration in the background. Methods raise RLException on an error."""

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
            master_arguments=master_options(timeout, master_logger_level),
        )

        for node in config.nodes:
            node.give_name()
        self._launcher = ApiLauncher(config.spec, self._environment, self._options, run_id)
        self.pm: ProcessMonitor | None = ProcessMonitor(launcher=self._launcher)

    def launch(self) -> tuple[list[str], list[str]]:
        """Start everything; return the names of the started processes and of the nodes that failed to start.

        Raise RLException if there is no usable master, or if a parameter cannot be set.
        """
        monitor = self._monitor()
        replacement_of("roslaunch.pmon", "_init_signal_handlers", init_signal_handlers)()
        try:
            self._launcher.start()
        except (MinirospyError, RpcError) as error:
            monitor.close()
            raise RLException(str(error)) from error
        except KeyboardInterrupt:
            monitor.close()
            raise
        monitor.watch()
        # If the program exits without calling stop(), still terminate the processes in the right order.
        atexit.register(self._end_with_program)
        return [str(process) for process in monitor.procs], [node.base_name for node in self._launcher.failed]

    def launch_node(self, node: Node, core: bool = False) -> tuple[Process | str, bool]:
        """Start an additional node. Return (its process, True), or (its name, False) on failure.

        Raise RLException after a shutdown.
        """
        monitor = self._monitor()
        if monitor.is_shutdown or monitor.done:
            raise RLException(f"cannot add process [{node.name}] after process monitor has been shut down")
        node.give_name()
        process = self._launcher.start_node(node.spec)
        return (self._launcher.known[process.name], True) if process else (node.name or "", False)

    def run_test(self, test: Test) -> bool:
        """Start a test and wait until it exits; return whether its exit status is 0.

        Raise RLTestTimeoutException after terminating a test that exceeds its time limit, RLException if the test cannot
        be started.
        """
        process, has_started = self.launch_node(test)
        if not has_started or isinstance(process, str):
            raise RLException(f"test [{test.test_name}] failed to launch")
        end = time.monotonic() + test.time_limit
        while process.is_alive():
            if time.monotonic() > end:
                process.stop()
                what = f"test [{test.test_name}] of type [{test.package}/{test.type}]"
                raise RLTestTimeoutException(f"max time [{test.time_limit}s] allotted for {what}")
            time.sleep(_POLL_SECONDS)
        return process.exit_code == 0

    def is_node_running(self, node: Node) -> bool:
        """Return whether a node started by this runner is still running."""
        name = node.spec.name
        return any(
            each.node and each.node.name == name and each.is_running for each in self._launcher.processes
        )

    def add_process_listener(self, l: ProcessListener) -> None:
        """Add a listener to notify when a process exits."""
        self._launcher.listeners.append(l)

    def spin(self) -> None:
        """Wait until all nodes have exited, or terminate them on a signal. Return immediately if there are none."""
        monitor = self._monitor()
        try:
            if self._launcher.supervisor.is_anything_left:
                monitor.mainthread_spin()
            elif not monitor.done:
                Output(title=False).print("No processes to monitor", bold=True)
        except KeyboardInterrupt:
            # As in ROS, the signal terminates the nodes, but not the program.
            pass
        finally:
            self.stop()

    def spin_once(self) -> bool:
        """Handle pending signals; return whether the run continues."""
        return self.pm is not None and self.pm.mainthread_spin_once()

    def stop(self) -> None:
        """Terminate all processes and wait until they exit. Idempotent."""
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
        # A forked child of the program must not stop the nodes when the child exits.
        if os.getpid() == self._pid:
            self.stop()

    def _monitor(self) -> ProcessMonitor:
        if self.pm is None:
            raise RLException("the process monitor was shut down")
        return self.pm

    def _load_parameters(self) -> None:
        """Set the parameters without starting nodes. Raise RLException if a parameter cannot be set."""
        try:
            self._launcher.set_parameters()
        except (MinirospyError, RpcError) as error:
            raise RLException(str(error)) from error


def master_options(timeout: float | None, logger_level: str | bool) -> tuple[str, ...]:
    """Return the master's start options."""
    options: list[str] = ["--timeout", str(timeout)] if timeout is not None else []
    options += ["--master-logger-level", str(logger_level)] if logger_level else []
    return tuple(options)


def replacement_of(module: str, name: str, ours: Function) -> Function:
    """Return the function that a program has substituted for ``ours`` in a roslaunch module, or ``ours``.

    For example, programs disable roslaunch's signal handlers with ``roslaunch.pmon._init_signal_handlers = ...``.
    """
    function: Function = getattr(sys.modules.get(module), name, ours)
    return function


def unify_clear_params(params: Iterable[str]) -> list[str]:
    """Return the namespaces to delete, with trailing slashes, omitting namespaces inside others."""
    names = [name if name.endswith("/") else f"{name}/" for name in params]
    return [
        name
        for name in dict.fromkeys(names)
        if not any(name != other and name.startswith(other) for other in names)
    ]


_unify_clear_params = unify_clear_params
