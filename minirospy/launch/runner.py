"""A LaunchSpec -> running nodes: starts them, watches them, ends them.

Source: http://wiki.ros.org/roslaunch/Commandline%20Tools, http://wiki.ros.org/roslaunch/Architecture.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import queue
import signal
import sys
import threading
import time
import uuid
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, ClassVar, NamedTuple

from minirospy.environment import DISTRO, ROS_VERSION, Environment, is_own_host, run_folder
from minirospy.errors import LaunchError, MasterUnreachableError, MinirospyError, RpcError, ValueTextError
from minirospy.launch.command import node_command, node_environment, node_folder
from minirospy.launch.output import Output
from minirospy.launch.process import Guardian, Process, Timeouts, end_processes, start_process
from minirospy.launch.registrations import DeadNodes
from minirospy.launch.spec import LaunchSpec, MachineSpec, NodeSpec
from minirospy.launch.summary import summary
from minirospy.launch.watch import FileWatch
from minirospy.runtime.master_proxy import MasterProxy
from minirospy.workspace.packages import Packages

if TYPE_CHECKING:
    from minirospy.launch.remote import RemoteMachines

__all__ = ["Launcher", "RunOptions"]

_WINDOWS = sys.platform == "win32"
_MASTER_SECONDS = 15.0
_RESPAWN_SECONDS = 0.1
"""A node that ends at once is not started more often than that."""

_WATCH_SECONDS = 0.5


@dataclass(frozen=True)
class RunOptions:
    """How a spec is run.

    ``screen``, ``log``: where all output goes, whatever the file says; ``log_errors``: what nodes write to standard
    error goes to their log file, too. ``required``: every node is. ``local``: nodes of other machines are not run.
    ``strict``: a node that cannot be started ends it all. ``watch``: a node whose file changes is started again.
    ``name`` is what stands in the terminal's title.
    """

    screen: bool = False
    log: bool = False
    log_errors: bool = False
    required: bool = False
    local: bool = False
    strict: bool = False
    watch: bool = False
    summary: bool = True
    name: str = ""
    timeouts: Timeouts = field(default_factory=Timeouts)
    master_arguments: tuple[str, ...] = ()


class _Ended(NamedTuple):
    """A process has ended."""

    process: Process


class _RemoteEnded(NamedTuple):
    """A process on another machine has ended."""

    node: NodeSpec | None
    name: str
    code: int


class _Stop(NamedTuple):
    """A signal, or somebody, asks all to stop."""

    why: str


class _NoMoreNodes(NamedTuple):
    """No further node will be asked for: the run ends with those that there are."""


_Event = _Ended | _RemoteEnded | _Stop | _NoMoreNodes


class Launcher:
    """Runs what a spec says until all nodes have ended or somebody asks it to stop."""

    _numbers: ClassVar[Iterator[int]] = itertools.count(1)
    """Of the processes, so that no two that one program launches have a name, and log files, in common."""

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
        self._options = options or RunOptions()
        self._output = output or Output()
        self._events: queue.SimpleQueue[_Event] = queue.SimpleQueue()
        self._restarts: list[tuple[float, Process]] = []
        self._master = MasterProxy(environment.master_uri, "/roslaunch")
        self._dead = DeadNodes(environment.master_uri)
        self._guardian: Guardian | None = None
        self._remote: RemoteMachines | None = None
        self._files = FileWatch(packages)
        self._master_process: Process | None = None
        self._has_begun = False
        self._has_run = False
        self._has_logs = True
        self.run_id = ""
        """The folder of the log files, and /run_id at the master."""
        self.processes: list[Process] = []
        """The nodes that were started and are watched, those that wait to be started again included."""
        self.stopped_by = ""
        """The signal, or who called stop(), that ended the run; empty where the nodes ended it."""
        self.failed: list[NodeSpec] = []
        """The nodes that could not be started."""

    def run(self, *, wait: bool = False) -> int:
        """Run until the end; the exit status: 0, or 1 where a required node died of a fault.

        ``wait``: wait for a master instead of starting one. Raises LaunchError, MasterUnreachableError.
        """
        with self.signals():
            try:
                self.start(wait=wait)
                return self.watch()
            except KeyboardInterrupt:
                return 0
            finally:
                self.close()

    def stop(self, why: str) -> None:
        """End the run; from any thread."""
        self._events.put(_Stop(why))

    def end_with_nodes(self) -> None:
        """Have a watch(forever=True) end with the last node after all; from any thread."""
        self._events.put(_NoMoreNodes())

    # --- beginning

    def start(self, *, wait: bool = False) -> None:
        """Show the summary, find or start a master, set the parameters, start the nodes.

        Raises LaunchError, MasterUnreachableError, MinirospyError; KeyboardInterrupt where stop() was called meanwhile.
        """
        here, elsewhere = self._nodes()
        if elsewhere and self._environment.local:
            node = elsewhere[0]
            why = f"node [{node.name}] is for machine [{node.machine or self._spec.default_machine}]"
            raise LaunchError(
                node.file,
                node.line,
                f"{why}, and MINIROSPY_LOCAL=1 keeps everything on this machine: `unset MINIROSPY_LOCAL`, or leave such "
                "nodes out with `roslaunch --local`",
            )

        if self._options.strict:
            for node in here:
                node_command(node, self._packages)
        self._has_begun = True
        had_master = self._master.is_online()
        if wait and not had_master:
            self._wait_for_master()
            had_master = True
        if had_master:
            self._find_run_id()
        self._output.title(self._options.name)
        if self._options.local:
            self._output.say("local only launch specified, will not launch remote nodes", bold=True)
        if self._options.summary:
            params = {**self._spec.params, **_core_parameters()}
            self._output.say(summary([*here, *elsewhere], params, self._spec.clear))
        for warning in self._spec.warnings:
            self._output.warn(f"WARNING: {warning}")
        if not had_master:
            self._start_master()
        self._output.say(f"ROS_MASTER_URI={self._environment.master_uri}", bold=True)
        self._output.title(f"{self._options.name} {self._environment.master_uri}")
        if self._master_process:
            self._output.say(f"setting /run_id to {self.run_id}", bold=True)
            self._output.say("started core service [/rosout]")
            # As in ROS, where /rosout is the first process of a master that roslaunch started.
            next(self._numbers)
        self.set_parameters()
        if elsewhere:
            from minirospy.launch.remote import RemoteMachines

            self._has_run = True
            timeouts = self._options.timeouts
            self._remote = RemoteMachines(self._environment, self.run_id, self._output, timeouts, self)
            self._remote.start(
                [(node, machine) for node in elsewhere if (machine := self._spec.machine_of(node))]
            )
        for node in here:
            self.start_node(node)

    def process_name(self, node: NodeSpec) -> str:
        """A new name for a process of a node: that of the node, and a number."""
        return f"{node.name.lstrip('/')}-{next(self._numbers)}"

    def start_node(self, node: NodeSpec, name: str = "") -> Process | None:
        """Start a node, as the process ``name`` (a new one, if empty); None where that cannot be (it is told why)."""
        self._has_run = True
        try:
            process = self._start_process(node, name or self.process_name(node))
        except MinirospyError as error:
            if self._options.strict:
                raise
            self.failed.append(node)
            self._output.warn(f"ERROR: cannot launch node of type [{node.package}/{node.type}]: {error}")
            return None
        self.processes.append(process)
        self._attend(process)
        return process

    def _nodes(self) -> tuple[list[NodeSpec], list[NodeSpec]]:
        """The nodes of this machine, and those of others. Raises LaunchError on an unknown machine."""
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

    def _wait_for_master(self) -> None:
        self._output.say("roscore/master is not yet running, will wait for it to start")
        while not self._master.is_online():
            self._pause(0.1)
        self._output.say("master has started, initiating launch")

    def _find_run_id(self) -> None:
        try:
            found = self._master.get_param("/run_id")
        except RpcError:
            found = None
        if run_folder(self._environment.log_dir, found):
            self.run_id = str(found)
        else:
            if found is not None:
                self._output.warn(
                    "WARNING: /run_id at the master cannot be the name of a folder: it is replaced"
                )
            self.run_id = self.run_id or str(uuid.uuid1())
            self._master.set_param("/run_id", self.run_id)
            self._output.say(f"setting /run_id to {self.run_id}", bold=True)
        try:
            self._output.say(f"... logging to {self._output.log_to(self._log_folder)}")
        except OSError as error:
            # A disk that is full or read-only must not stop the nodes.
            self._has_logs = False
            if not self._master_process:  # which has said so itself
                why = error.strerror or error
                self._output.warn(f"WARNING: cannot write logs to {self._log_folder}: {why}; set ROS_LOG_DIR")

    def _start_master(self) -> None:
        if not self._environment.master_is_local:
            raise MasterUnreachableError(self._environment.master_uri)
        self._output.say("auto-starting new master")
        port = self._environment.master_address[1]
        arguments = ["-q", "-p", str(port), *self._options.master_arguments]
        self._has_run = True
        self._ready_guardian()
        process = start_process(
            "master", [sys.executable, "-m", "minirospy.cli.ros.master", *arguments], environ=os.environ
        )
        self._master_process = process
        self.guard(process)
        self._attend(process)
        self._output.say(f"process[master]: started with pid [{process.pid}]", bold=True)
        end = time.monotonic() + _MASTER_SECONDS
        while not self._master.is_online():
            if not process.is_running:
                raise MinirospyError(f"the master ended with status {process.exit_code}")
            if time.monotonic() > end:
                raise MinirospyError(f"the master does not answer at {self._environment.master_uri}")
            self._pause(0.02)
        if self.run_id:
            # That of a program that launches: the folder of its log files is named by it.
            self._master.set_param("/run_id", self.run_id)
        self._find_run_id()

    def set_parameters(self) -> None:
        """Set the parameters, after what <rosparam> commands and clear_params delete. Raises MinirospyError."""
        for namespace in self._spec.clear:
            with contextlib.suppress(RpcError):
                self._master.delete_param(namespace)
        for command in self._spec.commands:
            if command.file is None:
                self._output.say(f"running rosparam delete {command.name}")
                try:
                    self._master.delete_param(command.name)
                except RpcError:
                    self._output.warn(f"ERROR: parameter [{command.name}] is not set")
            else:
                self._output.say(f"running rosparam dump {command.file} {command.name}")
                self._dump(command.name, command.file)
        for name, value in {**_core_parameters(), **self._spec.params}.items():
            try:
                self._master.set_param(name, value)
            except (RpcError, ValueTextError) as error:
                raise MinirospyError(f"parameter [{name}]: {error}") from error

    def _dump(self, name: str, file: str) -> None:
        from minirospy.introspect.parameters import dump_parameters

        try:
            Path(file).write_text(dump_parameters(self._master.get_param(name)), encoding="utf-8")
        except (OSError, RpcError) as error:
            self._output.warn(f"ERROR: parameters cannot be dumped to [{file}]: {error}")

    @property
    def _log_folder(self) -> Path:
        return self._environment.log_dir / self.run_id

    def _start_process(self, node: NodeSpec, name: str) -> Process:
        command = node_command(node, self._packages)
        folder = node_folder(node, self._packages, self._environment)
        stem = name.replace("/", "-")
        environ = node_environment(node, self._environment)
        screen = (self._options.screen or node.output == "screen") and not self._options.log
        screen = screen or not self._has_logs
        if not screen or not sys.stdout.isatty():
            # So that what a node prints is seen when it prints it. On a terminal Python does so by itself, and
            # writes whole lines, which those of another node do not cut in two.
            environ.setdefault("PYTHONUNBUFFERED", "1")
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            why = error.strerror or error
            raise MinirospyError(f"the folder {folder} cannot be made: {why}; set ROS_HOME") from error
        self._ready_guardian()
        if self._options.watch:
            self._files.add(node)
        process = start_process(
            name,
            [*command, f"__log:={self._log_folder / stem}.log"],
            environ=environ,
            folder=folder,
            stdout_file=None if screen else self._log_folder / f"{stem}-stdout.log",
            log_errors=self._options.log_errors,
        )
        process.node = node
        process.log_files = f"{self._log_folder / stem}*.log" if self._has_logs else "none"
        self.guard(process)
        self._output.say(f"process[{name}]: started with pid [{process.pid}]", bold=True)
        return process

    def _attend(self, process: Process) -> None:
        """Have a process's end told."""

        def wait() -> None:
            process.popen.wait()
            self._events.put(_Ended(process))

        threading.Thread(target=wait, name=f"wait-{process.name}", daemon=True).start()

    def guard(self, process: Process) -> None:
        """Have a process ended where we are killed."""
        self._ready_guardian().add(process)

    def _ready_guardian(self) -> Guardian:
        """The guardian; asked for before a process starts, too, so that it is there from the first moment on."""
        if self._guardian is None:
            self._guardian = Guardian(self._options.timeouts, self._environment.master_uri)
        return self._guardian

    # --- watching

    def watch(self, *, forever: bool = False) -> int:
        """Watch the nodes until they, or a required one, have ended, or stop() was called; the exit status.

        ``forever``: also where no node is left.
        """
        if not forever and not self.is_anything_left():
            self._output.say("No processes to monitor", bold=True)
        while forever or self.is_anything_left():
            event = self._next_event()
            if isinstance(event, _Stop):
                self.stopped_by = event.why
                return 0
            status = None
            if isinstance(event, _NoMoreNodes):
                forever = False
                continue
            if isinstance(event, _Ended):
                status = self._ended(event.process)
            elif event:
                status = self._remote_ended(event)
            if status is not None:
                return status
        if self._has_run:
            self._output.say("all processes on machine have died, roslaunch will exit")
        return 0

    def is_anything_left(self) -> bool:
        """Whether a process runs, or waits to be started again."""
        remote = self._remote is not None and self._remote.is_running
        return bool(self.processes) or self._master_process is not None or remote

    def _next_event(self) -> _Event | None:
        """What happened; None after a while in which nothing did, when restarts and files have been looked after."""
        due = min((when for when, _ in self._restarts), default=None)
        pauses = [0.5] if _WINDOWS or self._remote else []
        pauses += [_WATCH_SECONDS] if self._options.watch else []
        pauses += [max(0.0, due - time.monotonic())] if due is not None else []
        try:
            return self._events.get(timeout=min(pauses, default=None))
        except queue.Empty:
            pass
        now = time.monotonic()
        ready = [process for when, process in self._restarts if when <= now]
        self._restarts = [each for each in self._restarts if each[0] > now]
        for process in ready:
            self._restart(process)
        if self._options.watch:
            self._restart_changed()
        return None

    def _ended(self, process: Process) -> int | None:
        """React to a process's end; a status where all have to stop."""
        if self._guardian:
            self._guardian.remove(process)
        if process is self._master_process:
            self._master_process = None
            self._output.warn("the master has ended: shutting down")
            return 1
        if process not in self.processes:
            return None
        node, code = process.node, process.exit_code
        assert node
        self._dead.add(node.name)
        self._on_end(process)
        if process.is_restarting:
            self._restart(process)
            return None
        if process.is_ending:
            self.processes.remove(process)
            return None
        if code == 0:
            how, tell = "process has finished cleanly", self._say_bold
        else:
            command = " ".join(process.command)
            how = f"process has died [pid {process.pid}, exit code {code}, cmd {command}]."
            tell = self._output.warn
        told = f"{how}\nlog file: {process.log_files}"
        if node.required:
            self.processes.remove(process)
            bar = "=" * 80
            text = f"REQUIRED process [{process.name}] has died!\n{told}\nInitiating shutdown!"
            self._output.warn(f"{bar}\n{text}\n{bar}")
            return 0 if code == 0 else 1
        tell(f"[{process.name}] {told}")
        if node.respawn:
            due = time.monotonic() + max(node.respawn_delay, _RESPAWN_SECONDS)
            self._restarts.append((due, process))
        else:
            self.processes.remove(process)
        return None

    def remote_ended(self, node: NodeSpec | None, name: str, code: int) -> None:
        """A process on another machine has ended; from any thread."""
        self._events.put(_RemoteEnded(node, name, code))

    def _remote_ended(self, event: _RemoteEnded) -> int | None:
        if event.node is None or not event.node.required:
            return None
        bar = "=" * 80
        self._output.warn(f"{bar}\nREQUIRED process [{event.name}] has died!\nInitiating shutdown!\n{bar}")
        return 0 if event.code == 0 else 1

    def _on_end(self, process: Process) -> None:
        """A node has ended: for those who want to know."""

    def _say_bold(self, text: str) -> None:
        self._output.say(text, bold=True)

    def _restart(self, process: Process) -> None:
        """Start an ended node again, in its place among the others."""
        node = process.node
        assert node
        if process.is_ending and not process.is_restarting:
            self.processes.remove(process)
            return
        place = self.processes.index(process)
        self._output.say(f"[{process.name}] restarting process")
        try:
            again = self._start_process(node, process.name)
        except MinirospyError as error:
            self._output.warn(f"ERROR: cannot launch node of type [{node.package}/{node.type}]: {error}")
            del self.processes[place]
            return
        again.starts = process.starts + 1
        self.processes[place] = again
        self._attend(again)

    def _restart_changed(self) -> None:
        for process in self.processes:
            if process.node and not process.is_restarting and (file := self._files.changed(process.node)):
                self._output.say(f"[{process.name}] {file} has changed")
                process.is_restarting = True
                if process.is_running:
                    threading.Thread(target=self.end_process, args=(process,), daemon=True).start()

    def end_process(self, process: Process) -> None:
        """End one process, and wait for that; it is not started again, unless its file has changed."""
        process.is_ending = True
        end_processes([process], self._options.timeouts, self._output.warn)

    def _pause(self, seconds: float) -> None:
        """Wait; a request to stop ends it, and comes back."""
        try:
            event = self._events.get(timeout=seconds)
        except queue.Empty:
            return
        self._events.put(event)
        if isinstance(event, _Stop):
            self.stopped_by = event.why
            raise KeyboardInterrupt

    # --- ending

    def close(self) -> None:
        """End all processes: the nodes, the last one first, then the master. Idempotent."""
        killed: list[Process] = []
        if self._remote:
            self._remote.close()
            self._remote = None
        exited = [process.node.name for process in self.processes if process.node]
        nodes = [process for process in reversed(self.processes) if process.is_running]
        master = [self._master_process] if self._master_process else []
        for group in (nodes, master):
            for process in group:
                self._output.say(f"[{process.name}] killing on exit")
            killed += end_processes(group, self._options.timeouts, self._output.warn)
            if group is nodes:
                self._unregister(exited)
        self.processes.clear()
        self._restarts.clear()
        self._master_process = None
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
            self._output.say("shutting down processing monitor...")
            self._output.say("... shutting down processing monitor complete")
            self._has_begun = False
        if self._has_run:
            self._output.say("done", bold=True)
            self._has_run = False
        self._master.close()

    def _unregister(self, nodes: list[str]) -> None:
        """Unregister what nodes have left, unless the master ends with them."""
        if not self._master_process:
            for node in nodes:
                self._dead.add(node)
        self._dead.close()

    @contextlib.contextmanager
    def signals(self) -> Iterator[None]:
        """SIGINT, SIGTERM and SIGHUP ask all to stop, meanwhile (in the main thread)."""

        def on_signal(number: int, _: FrameType | None) -> None:
            self.stop(signal.Signals(number).name)

        wanted = [getattr(signal, name, None) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")]
        before = {number: signal.signal(number, on_signal) for number in wanted if number is not None}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


def _is_here(machine: MachineSpec) -> bool:
    """Whether a machine is the one that this runs on, and its user this one."""
    if machine.user:
        import getpass

        if machine.user != getpass.getuser():
            return False
    return is_own_host(machine.address)


def _core_parameters() -> dict[str, str]:
    return {"/rosdistro": DISTRO, "/rosversion": ROS_VERSION}
