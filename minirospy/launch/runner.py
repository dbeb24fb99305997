"""A LaunchSpec -> running nodes: starts them, watches them, ends them.

Source: http://wiki.ros.org/roslaunch/Commandline%20Tools, http://wiki.ros.org/roslaunch/Architecture.
"""

from __future__ import annotations

import contextlib
import os
import queue
import shlex
import signal
import subprocess
import sys
import threading
import time
import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import IO, Any, NamedTuple

from minirospy.environment import Environment
from minirospy.errors import LaunchError, MasterUnreachableError, MinirospyError, NotFoundError, RpcError
from minirospy.launch.spec import LaunchSpec, NodeSpec
from minirospy.runtime.master_proxy import MasterProxy
from minirospy.workspace.packages import NotExecutableError, Packages

__all__ = ["Launcher", "node_command", "node_environment"]

_WINDOWS = sys.platform == "win32"
_INTERRUPT_SECONDS = 10.0
_TERMINATE_SECONDS = 2.0
_MASTER_SECONDS = 15.0


class _Ended(NamedTuple):
    """A process has ended."""

    process: _Process


class _Stop(NamedTuple):
    """A signal, or a required node's end, asks all to stop."""

    why: str


@dataclass
class _Process:
    name: str
    popen: subprocess.Popen[bytes]
    command: list[str]
    node: NodeSpec | None = None
    log_file: Path | None = None


class Launcher:
    """Runs what a spec says until all nodes have ended or somebody asks it to stop.

    ``screen`` shows every node's output, whatever the file says.
    """

    def __init__(
        self, spec: LaunchSpec, environment: Environment, packages: Packages, *, screen: bool = False
    ) -> None:
        self._spec = spec
        self._environment = environment
        self._packages = packages
        self._screen = screen
        self._events: queue.SimpleQueue[_Ended | _Stop] = queue.SimpleQueue()
        self._processes: list[_Process] = []
        self._master = MasterProxy(environment.master_uri, "/roslaunch")
        self._run_id = ""
        self._counter = 0

    def run(self, *, wait: bool = False) -> int:
        """Run until the end; the exit status: 0, or 1 where a required node died of a fault.

        ``wait``: wait for a master instead of starting one. Raises LaunchError, MasterUnreachableError.
        """
        commands = [(node, node_command(node, self._packages)) for node in self._spec.nodes]
        self._print_summary()
        with self._signals():
            try:
                self._find_master(wait=wait)
                self._set_parameters()
                for node, command in commands:
                    self._start_node(node, command)
                return self._watch()
            finally:
                self._end_all()
                self._master.close()

    # --- beginning

    def _find_master(self, *, wait: bool) -> None:
        told = False
        while not self._master_answers():
            if not wait:
                self._start_master()
                return
            if not told:
                _say("roscore/master is not yet running, will wait for it to start")
                told = True
            self._pause(0.2)
        _say(f"ROS_MASTER_URI={self._environment.master_uri}")
        try:
            self._run_id = str(self._master.get_param("/run_id"))
        except RpcError:
            self._run_id = str(uuid.uuid1())

    def _start_master(self) -> None:
        if not self._environment.master_is_local:
            raise MasterUnreachableError(self._environment.master_uri)
        _say("auto-starting new master")
        port = self._environment.master_address[1]
        command = [sys.executable, "-m", "minirospy.cli.master", "-q", "-p", str(port)]
        process = self._spawn("master", command, dict(os.environ), None, None)
        _say(f"process[master]: started with pid [{process.popen.pid}]")
        end = time.monotonic() + _MASTER_SECONDS
        while not self._master_answers():
            if process.popen.poll() is not None:
                raise MinirospyError(f"the master ended with status {process.popen.returncode}")
            if time.monotonic() > end:
                raise MinirospyError(f"the master does not answer at {self._environment.master_uri}")
            self._pause(0.02)
        _say(f"ROS_MASTER_URI={self._environment.master_uri}\n")
        self._run_id = str(self._master.get_param("/run_id"))
        _say(f"setting /run_id to {self._run_id}\nstarted core service [/rosout]")

    def _master_answers(self) -> bool:
        try:
            self._master.get_pid()
        except MasterUnreachableError:
            return False
        return True

    def _set_parameters(self) -> None:
        for namespace in self._spec.clear:
            with contextlib.suppress(RpcError):
                self._master.delete_param(namespace)
        for name, value in self._spec.params.items():
            try:
                self._master.set_param(name, value)
            except RpcError as error:
                raise LaunchError(self._spec.files[0], 0, f"parameter [{name}]: {error}") from error

    def _start_node(self, node: NodeSpec, command: list[str]) -> None:
        self._counter += 1
        name = f"{node.name.lstrip('/')}-{self._counter}"
        folder = self._environment.log_dir / self._run_id
        stem = name.replace("/", "-")
        environment = node_environment(node, self._environment)
        environment["ROS_MASTER_URI"] = self._environment.master_uri
        log_argument = f"__log:={folder / (stem + '.log')}"
        screen = self._screen or node.output == "screen"
        log_file = None if screen else folder / f"{stem}-stdout.log"
        cwd = self._packages.find(node.package) if node.cwd == "node" else self._environment.home
        cwd.mkdir(parents=True, exist_ok=True)
        if log_file or not sys.stdout.isatty():
            # So that what a node prints is seen when it prints it. On a terminal Python does so by itself, and
            # writes whole lines, which those of another node do not cut in two.
            environment.setdefault("PYTHONUNBUFFERED", "1")
        with _output(log_file) as output:
            process = self._spawn(name, [*command, log_argument], environment, output, cwd)
        process.node, process.log_file = node, folder / f"{stem}*.log"
        _say(f"process[{name}]: started with pid [{process.popen.pid}]")

    def _spawn(
        self,
        name: str,
        command: list[str],
        environment: dict[str, str],
        output: IO[bytes] | None,
        cwd: Path | None,
    ) -> _Process:
        # A group of its own: Ctrl-C in the terminal reaches roslaunch alone, which ends the nodes in order.
        group: dict[str, Any] = {"start_new_session": True}
        if sys.platform == "win32":
            group = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
        try:
            popen = subprocess.Popen(
                command,
                env=environment,
                cwd=cwd,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output and subprocess.STDOUT,
                **group,
            )
        except OSError as error:
            raise LaunchError(self._spec.files[0], 0, f"[{name}] cannot be started: {error}") from error
        process = _Process(name, popen, command)
        self._processes.append(process)
        threading.Thread(target=self._wait_for, args=(process,), name=f"wait-{name}", daemon=True).start()
        return process

    def _wait_for(self, process: _Process) -> None:
        process.popen.wait()
        self._events.put(_Ended(process))

    # --- watching

    def _watch(self) -> int:
        while any(process.node for process in self._processes):
            event = self._next_event()
            if isinstance(event, _Stop):
                return 0
            status = self._ended(event.process)
            if status is not None:
                return status
        # As roslaunch: without a node left, there is nothing to wait for.
        if self._spec.nodes:
            _say("all processes on machine have died, roslaunch will exit")
        return 0

    def _next_event(self) -> _Ended | _Stop:
        while True:
            try:
                # On Windows Ctrl-C does not end a wait: there look twice a second.
                return self._events.get(timeout=0.5 if _WINDOWS else None)
            except queue.Empty:
                continue

    def _ended(self, process: _Process) -> int | None:
        """React to a process's end; a status where all have to stop."""
        if process not in self._processes:
            return None
        self._processes.remove(process)
        node, code = process.node, process.popen.returncode
        if code == 0:
            _say(f"[{process.name}] process has finished cleanly\nlog file: {process.log_file}")
        else:
            _say(
                f"[{process.name}] process has died [pid {process.popen.pid}, exit code {code}, "
                f"cmd {' '.join(process.command)}].\nlog file: {process.log_file}",
                sys.stderr,
            )
        if node is None:
            _say("the master has ended: shutting down", sys.stderr)
            return 1
        if node.required:
            bar = "=" * 80
            how = "has finished" if code == 0 else f"has died with exit code {code}"
            _say(f"{bar}\nREQUIRED process [{process.name}] {how}\nInitiating shutdown!\n{bar}")
            return 0 if code == 0 else 1
        if node.respawn:
            if node.respawn_delay:
                self._pause(node.respawn_delay)
            _say(f"[{process.name}] restarting process")
            self._counter -= 1
            self._start_node(node, node_command(node, self._packages))
        return None

    def _pause(self, seconds: float) -> None:
        """Wait; a request to stop ends it, and comes back."""
        try:
            event = self._events.get(timeout=seconds)
        except queue.Empty:
            return
        self._events.put(event)
        if isinstance(event, _Stop):
            raise KeyboardInterrupt

    # --- ending

    def _end_all(self) -> None:
        nodes = [process for process in self._processes if process.node]
        others = [process for process in self._processes if not process.node]
        for group in (nodes[::-1], others):
            for process in group:
                if process.popen.poll() is None:
                    _say(f"[{process.name}] killing on exit")
            _end(group)
        if self._processes:
            _say("shutting down processing monitor...\n... shutting down processing monitor complete")
        self._processes.clear()
        _say("done")

    @contextlib.contextmanager
    def _signals(self) -> Iterator[None]:
        """SIGINT, SIGTERM and SIGHUP ask all to stop."""

        def on_signal(number: int, _: FrameType | None) -> None:
            self._events.put(_Stop(signal.Signals(number).name))

        wanted = [getattr(signal, name, None) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")]
        before = {number: signal.signal(number, on_signal) for number in wanted if number is not None}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def _print_summary(self) -> None:
        _say("\nSUMMARY\n========\n\nPARAMETERS")
        for name, value in sorted(self._spec.params.items()):
            text = str(value).replace("\n", " ").strip()
            _say(f" * {name}: {text if len(text) <= 20 else text[:17] + '...'}")
        _say("\nNODES")
        by_namespace: dict[str, list[NodeSpec]] = {}
        for node in self._spec.nodes:
            by_namespace.setdefault(node.namespace, []).append(node)
        for namespace, nodes in sorted(by_namespace.items()):
            _say(f"  {namespace}")
            for node in sorted(nodes, key=lambda n: n.base_name):
                _say(f"    {node.base_name} ({node.package}/{node.type})")
        _say("")


def node_command(node: NodeSpec, packages: Packages) -> list[str]:
    """The command that runs a node, with its name and remappings. Raises LaunchError."""
    try:
        program = packages.find_executable(node.package, node.type)
    except (NotFoundError, NotExecutableError) as error:
        raise LaunchError(node.file, node.line, f"node [{node.base_name}]: {error}") from error
    prefix = shlex.split(node.launch_prefix) if node.launch_prefix else []
    remaps = [f"{a}:={b}" for a, b in node.remaps]
    return [*prefix, *program, *shlex.split(node.args), *remaps, f"__name:={node.base_name}"]


def node_environment(node: NodeSpec, environment: Environment) -> dict[str, str]:
    """The environment of a node's process."""
    variables = {**os.environ, **dict(node.env)}
    namespace = node.namespace.rstrip("/")
    if namespace:
        variables["ROS_NAMESPACE"] = namespace
    else:
        variables.pop("ROS_NAMESPACE", None)
    return variables


@contextlib.contextmanager
def _output(path: Path | None) -> Iterator[IO[bytes] | None]:
    if path is None:
        yield None
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = path.open("ab")
    except OSError as error:
        raise MinirospyError(f"cannot write the log file {path}: {error.strerror}") from error
    with file:
        yield file


def _end(processes: list[_Process]) -> None:
    """SIGINT, then SIGTERM, then SIGKILL, each pause over as soon as all have ended."""
    steps = [(_interrupt, _INTERRUPT_SECONDS), (_terminate, _TERMINATE_SECONDS), (_kill, _TERMINATE_SECONDS)]
    for number, (step, seconds) in enumerate(steps):
        running = [process for process in processes if process.popen.poll() is None]
        if number and running:
            words = ("", "escalating to SIGTERM", "escalating to SIGKILL")
            for process in running:
                _say(f"[{process.name}] {words[number]}")
        for process in running:
            with contextlib.suppress(OSError):
                step(process.popen)
        end = time.monotonic() + seconds
        for process in running:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.popen.wait(max(0.0, end - time.monotonic()))


def _interrupt(popen: subprocess.Popen[bytes]) -> None:
    if _WINDOWS:
        popen.send_signal(signal.CTRL_BREAK_EVENT)  # type: ignore[attr-defined,unused-ignore]
    else:
        os.killpg(popen.pid, signal.SIGINT)


def _terminate(popen: subprocess.Popen[bytes]) -> None:
    if _WINDOWS:
        popen.terminate()
    else:
        os.killpg(popen.pid, signal.SIGTERM)


def _kill(popen: subprocess.Popen[bytes]) -> None:
    """The process and all that it started."""
    import psutil

    with contextlib.suppress(psutil.Error):
        for child in psutil.Process(popen.pid).children(recursive=True):
            child.kill()
    popen.kill()


def _say(text: str, stream: Any = None) -> None:
    print(text, file=stream or sys.stdout, flush=True)
