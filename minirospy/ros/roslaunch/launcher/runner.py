"""Runs a LaunchSpec: starts, watches and terminates its nodes.

The launcher's parts are in separate modules: the master (``master.py``), a node's process (``node_start.py``), the run
(``supervisor.py``), other machines (``remote.py``), termination (``process.py``, ``registrations.py``).
Source: http://wiki.ros.org/roslaunch/Commandline%20Tools, http://wiki.ros.org/roslaunch/Architecture.
"""

from __future__ import annotations

import contextlib
import itertools
import signal
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, ClassVar

from minirospy.base.environment import Environment, is_own_host
from minirospy.base.errors import LaunchError, MinirospyError
from minirospy.base.keyboard import kept_terminal
from minirospy.ros.roslaunch.launcher.command import node_command, node_program
from minirospy.ros.roslaunch.launcher.master import CORE_PARAMETERS, LaunchMaster
from minirospy.ros.roslaunch.launcher.node_start import NodeStarter
from minirospy.ros.roslaunch.launcher.options import RunOptions
from minirospy.ros.roslaunch.launcher.output import Output
from minirospy.ros.roslaunch.launcher.process import Guardian, Process, end_processes
from minirospy.ros.roslaunch.launcher.registrations import DeadNodes
from minirospy.ros.roslaunch.launcher.spec import LaunchSpec, MachineSpec, NodeSpec
from minirospy.ros.roslaunch.launcher.summary import summary
from minirospy.ros.roslaunch.launcher.supervisor import Supervisor
from minirospy.ros.roslaunch.launcher.watch import FileWatch
from minirospy.workspace.hidden_modules import warning_of_hiding_file
from minirospy.workspace.packages import Packages, why_ros_refuses
from minirospy.workspace.stale import warning_of_stale_definitions

if TYPE_CHECKING:
    from minirospy.ros.roslaunch.launcher.remote import RemoteMachines

__all__ = ["Launcher", "RunOptions"]


class Launcher:
    """Runs a spec's nodes until all exit or a caller stops them."""

    _numbers: ClassVar[Iterator[int]] = itertools.count(1)
    """A counter shared by all launches in this program, to make process names and log files unique."""

    def __init__(
        self,
        spec: LaunchSpec,
        environment: Environment,
        packages: Packages,
        options: RunOptions | None = None,
        output: Output | None = None,
    ) -> None:
        self._spec = spec
        self._environment = environment
        self._packages = packages
        self._options = options = options or RunOptions()
        self._output = output or Output()
        self._guardian: Guardian | None = None
        self._remote: RemoteMachines | None = None
        self._files = FileWatch(packages) if options.watch else None

        self.supervisor = Supervisor(
            self._start_process,
            self._process_exited,
            self._output,
            options.timeouts,
            files=self._files,
            is_remote_running=lambda: self._remote is not None and self._remote.is_running,
        )
        self._master = LaunchMaster(environment, self._output, self.supervisor.pause)
        self._starter = NodeStarter(environment, packages, options, self._master)
        self._dead = DeadNodes(environment.master_uri)

        self._has_begun = False
        self._has_run = False
        self.failed: list[NodeSpec] = []
        """The nodes that could not be started."""

    @property
    def processes(self) -> list[Process]:
        """Return the watched processes, including those that will be restarted."""
        return self.supervisor.processes

    @property
    def run_id(self) -> str:
        """Return the run id, which names the log folder and is the master's /run_id."""
        return self._master.run_id

    @run_id.setter
    def run_id(self, run_id: str) -> None:
        self._master.run_id = run_id

    def run(self, *, wait: bool = False) -> int:
        """Run until the launch is over; return 1 if a required node failed, else 0.

        ``wait``: wait for a master instead of starting one. Raise MasterUnreachableError if the master cannot be started here,
        LaunchError if a node cannot be run.
        """
        with kept_terminal(), self.signals():
            try:
                self.start(wait=wait)
                return self.watch()
            except KeyboardInterrupt:
                return 0
            finally:
                self.close()

    # --- starting

    def start(self, *, wait: bool = False) -> None:
        """Print the summary, find or start a master, set the parameters and start the nodes.

        Raise LaunchError if a node cannot be run, MasterUnreachableError if the master cannot be started here, MinirospyError
        for other failures, KeyboardInterrupt if the run is stopped in the meantime.
        """
        here, elsewhere = self._nodes()
        self._check(here, elsewhere)
        self._has_begun = True

        had_master = self._master.is_online()
        if wait and not had_master:
            self._master.wait()
            had_master = True
        if had_master:
            self._master.find_run_id()
        self._show(here, elsewhere)

        self._starter.prepare(here)
        if not had_master:
            self._start_master()
        self._output.print(f"ROS_MASTER_URI={self._environment.master_uri}", bold=True)
        self._output.title(f"{self._options.name} {self._environment.master_uri}")
        if not had_master:
            self._output.print(f"setting /run_id to {self.run_id}", bold=True)
            self._output.print("started core service [/rosout]")
            # Skip the first number, which ROS uses for /rosout if roslaunch starts the master.
            next(self._numbers)

        self.set_parameters()
        if elsewhere:
            self._start_remote(elsewhere)
        for node in here:
            self.start_node(node)
        self._starter.close()

    def set_parameters(self) -> None:
        """Delete the namespaces of clear_params, run the <rosparam> commands, then set the parameters.

        Raise MinirospyError if a value cannot be set.
        """
        self._master.set_parameters(self._spec)

    def process_name(self, node: NodeSpec) -> str:
        """Return a new process name for a node: its name and a number."""
        return f"{node.name.lstrip('/')}-{next(self._numbers)}"

    def start_node(self, node: NodeSpec, name: str = "") -> Process | None:
        """Start a node as process ``name`` ("": a new name). If that fails, warn and return None."""
        self._has_run = True
        try:
            process = self._start_process(node, name or self.process_name(node))
        except MinirospyError as error:
            if self._options.strict:
                raise
            self.failed.append(node)
            self._output.warn(f"ERROR: cannot launch node of type [{node.package}/{node.type}]: {error}")
            return None
        self.supervisor.add(process)
        return process

    def _nodes(self) -> tuple[list[NodeSpec], list[NodeSpec]]:
        """Return two lists: the nodes on this machine, and those on other machines. Raise LaunchError if a machine is unknown."""
        here: list[NodeSpec] = []
        elsewhere: list[NodeSpec] = []
        for node in self._spec.nodes:
            machine = self._spec.machine_of(node)
            if self._options.required:
                node = replace(node, required=True, respawn=False)  # noqa: PLW2901 - the same node, as it is run
            if machine is None or _is_here(machine):
                here.append(node)
            elif not self._options.local:
                elsewhere.append(node)
        return here, elsewhere

    def _check(self, here: list[NodeSpec], elsewhere: list[NodeSpec]) -> None:
        """Raise LaunchError if nodes on other machines are forbidden or, with ``strict``, if a node cannot be run here."""
        if elsewhere and self._environment.local:
            node = elsewhere[0]
            why = f"node [{node.name}] is for machine [{node.machine}]"
            raise LaunchError(
                node.file,
                node.line,
                f"{why}, and MINIROSPY_LOCAL=1 keeps everything on this machine: `unset MINIROSPY_LOCAL`, or leave such "
                "nodes out with `roslaunch --local`",
            )
        if self._options.strict:
            for node in here:
                node_command(node, self._packages)

    def _show(self, here: list[NodeSpec], elsewhere: list[NodeSpec]) -> None:
        self._output.title(self._options.name)
        if self._options.local:
            self._output.print("local only launch specified, will not launch remote nodes", bold=True)
        if self._options.summary:
            params = {**self._spec.params, **CORE_PARAMETERS}
            self._output.print(summary([*here, *elsewhere], params, self._spec.clear))
        for warning in self._spec.warnings:
            self._output.warn(f"WARNING: {warning}")
        programs = list(dict.fromkeys(self._programs(here)))
        found = [why_ros_refuses(program) for program in programs]
        found += map(warning_of_hiding_file, programs)
        found += map(warning_of_stale_definitions, self._folders(here))
        for text in dict.fromkeys(filter(None, found)):
            self._output.warn(f"WARNING: {text}")

    def _folders(self, nodes: list[NodeSpec]) -> Iterator[Path]:
        """Yield the folders of the nodes' packages, skipping missing ones."""
        for package in dict.fromkeys(node.package for node in nodes):
            with contextlib.suppress(MinirospyError):
                yield self._packages.find(package)

    def _programs(self, nodes: list[NodeSpec]) -> Iterator[Path]:
        """Yield the nodes' programs, skipping missing ones, which are reported when their node starts."""
        for node in nodes:
            with contextlib.suppress(MinirospyError):
                yield Path(node_program(node, self._packages)[-1])

    def _start_master(self) -> None:
        self._ready_guardian()
        process = self._master.start(self._options.master_arguments)
        self._has_run = True
        self.guard(process)
        self.supervisor.add_master(process)
        self._output.print(f"process[master]: started with pid [{process.pid}]", bold=True)
        self._master.wait_for_start(process)

    def _start_remote(self, nodes: list[NodeSpec]) -> None:
        from minirospy.ros.roslaunch.launcher.remote import RemoteMachines

        self._has_run = True
        self._remote = RemoteMachines(
            self._environment, self.run_id, self._output, self._options.timeouts, self
        )
        self._remote.start([(node, machine) for node in nodes if (machine := self._spec.machine_of(node))])

    def _start_process(self, node: NodeSpec, name: str) -> Process:
        self._ready_guardian()
        if self._files:
            self._files.add(node)
        process = self._starter.start(node, name)
        self.guard(process)
        self._output.print(f"process[{name}]: started with pid [{process.pid}]", bold=True)
        return process

    def guard(self, process: Process) -> None:
        """Ensure that the process is terminated even if roslaunch is killed."""
        self._ready_guardian().add(process)

    def _ready_guardian(self) -> Guardian:
        """Return the guardian, creating it if needed.

        Call this before starting a process, so that the process is always covered.
        """
        if self._guardian is None:
            self._guardian = Guardian(self._options.timeouts, self._environment.master_uri)
        return self._guardian

    # --- running

    @property
    def stopped_by(self) -> str:
        """Return the signal or stop() caller that stopped the run, or "" if the nodes exited on their own."""
        return self.supervisor.stopped_by

    def watch(self, *, forever: bool = False) -> int:
        """Watch until all nodes have exited, a required node has exited or stop() is called; return the exit status.

        ``forever``: continue even if no node is left.
        """
        if not forever and not self.supervisor.is_anything_left:
            self._output.print("No processes to monitor", bold=True)
        status = self.supervisor.watch(forever=forever)
        if status is not None:
            return status
        if self._has_run:
            self._output.print("all processes on machine have died, roslaunch will exit")
        return 0

    def stop(self, why: str) -> None:
        """Stop the run. Thread-safe."""
        self.supervisor.stop(why)

    def remote_ended(self, node: NodeSpec | None, name: str, code: int) -> None:
        """Report that a process on another machine has exited. Thread-safe."""
        self.supervisor.remote_ended(node, name, code)

    def _process_exited(self, process: Process) -> None:
        if self._guardian:
            self._guardian.remove(process)
        if process.node and process in self.processes:
            self._dead.add(process.node.name)
            self._on_end(process)

    def _on_end(self, process: Process) -> None:
        """Do nothing. Called when a node exits; subclasses may override this method."""

    # --- shutdown

    def close(self) -> None:
        """Terminate all processes: the nodes in reverse order, then the master. Idempotent."""
        self._starter.close()
        if self._remote:
            self._remote.close()
            self._remote = None

        exited = [process.node.name for process in self.processes if process.node]
        nodes = [process for process in reversed(self.processes) if process.is_running]
        master = [self.supervisor.master] if self.supervisor.master else []
        killed = self._end(nodes)
        self._unregister(exited)
        killed += self._end(master)
        self.supervisor.clear()

        if self._guardian:
            for process in (*nodes, *master):
                self._guardian.remove(process)
            self._guardian.close()
            self._guardian = None

        if killed:
            lines = [
                f" * process[{process.name}, pid {process.pid}]: required SIGKILL." for process in killed
            ]
            self._output.warn("\n".join(["Shutdown errors:", *lines]))
        if self._has_begun:
            self._output.print("shutting down processing monitor...")
            self._output.print("... shutting down processing monitor complete")
            self._has_begun = False
        if self._has_run:
            self._output.print("done", bold=True)
            self._has_run = False
        self._master.close()

    def _end(self, processes: list[Process]) -> list[Process]:
        """Terminate processes; return those that needed SIGKILL."""
        for process in processes:
            self._output.print(f"[{process.name}] killing on exit")
        return end_processes(processes, self._options.timeouts, self._output.warn)

    def _unregister(self, nodes: list[str]) -> None:
        """Unregister exited nodes from the master. Not needed if this launch started the master, which also exits."""
        if not self.supervisor.master:
            for node in nodes:
                self._dead.add(node)
        self._dead.close()

    @contextlib.contextmanager
    def signals(self) -> Iterator[None]:
        """Let SIGINT, SIGTERM and SIGHUP stop the run inside the ``with`` block (main thread only).

        A SIGHUP that is ignored, as under nohup, stays ignored.
        """

        def on_signal(number: int, _: FrameType | None) -> None:
            self.stop(signal.Signals(number).name)

        numbers = {
            name: getattr(signal, name)
            for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
            if hasattr(signal, name)
        }
        if "SIGHUP" in numbers and signal.getsignal(numbers["SIGHUP"]) == signal.SIG_IGN:
            del numbers["SIGHUP"]
        before = {number: signal.signal(number, on_signal) for number in numbers.values()}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


def _is_here(machine: MachineSpec) -> bool:
    """Return whether a ``<machine>`` means this machine and, if it names a user, the current user."""
    if machine.user:
        import getpass

        if machine.user != getpass.getuser():
            return False
    return is_own_host(machine.address)
