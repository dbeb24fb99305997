"""A launch file run for the page: roslaunch's launcher in a thread, with all output in log files."""

from __future__ import annotations

import itertools
import logging
import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import ClassVar, NamedTuple

from minirospy.base.environment import Environment
from minirospy.base.errors import MinirospyError, UsageError
from minirospy.ros.roslaunch.launcher.load import LaunchSource, load_sources
from minirospy.ros.roslaunch.launcher.options import RunOptions
from minirospy.ros.roslaunch.launcher.output import Output
from minirospy.ros.roslaunch.launcher.process import Process
from minirospy.ros.roslaunch.launcher.runner import Launcher
from minirospy.ros.roslaunch.launcher.spec import LaunchSpec, NodeSpec
from minirospy.workspace.packages import Packages

__all__ = ["LaunchRun", "NodeState", "RunState"]

_log = logging.getLogger(__name__)

_MAX_LINES = 2000


class NodeState(NamedTuple):
    """The state of a node in a launch: starting, running, ending, exited (with ``status``), failed (to start) or stopped.

    ``starts``: the number of starts; ``respawns``: whether it is restarted when it exits.
    """

    name: str
    program: str
    state: str
    status: int | None
    pid: int | None
    starts: int
    respawns: bool


class RunState(NamedTuple):
    """The state of a launch: starting, running, stopping or ended. ``error`` is the error that ended it, or ""."""

    id: int
    package: str
    file: str
    args: Mapping[str, str]
    state: str
    error: str
    nodes: list[NodeState]


class _Lines(Output):
    """roslaunch's own output, stored instead of printed. ``on_change`` is called after each line."""

    def __init__(self, on_change: Callable[[], object]) -> None:
        super().__init__(title=False)
        self._on_change = on_change
        self._lock = threading.Lock()
        self._lines: deque[str] = deque(maxlen=_MAX_LINES)
        self._count = 0

    def since(self, count: int) -> tuple[list[str], int]:
        """Return the stored lines after the first ``count``, and the total number of lines. May be called from any thread."""
        with self._lock:
            new = min(self._count - count, len(self._lines))
            return list(self._lines)[len(self._lines) - new :], self._count

    def _write(self, text: str, colour: str, level: int) -> None:
        if text:
            with self._lock:
                self._count += 1
                self._lines.append(text)
            self._to_log(text, level)
            self._on_change()


class _PageLauncher(Launcher):
    """A launcher that reports exited nodes."""

    def __init__(
        self,
        spec: LaunchSpec,
        environment: Environment,
        packages: Packages,
        output: Output,
        on_end: Callable[[Process], None],
        on_change: Callable[[], object],
    ) -> None:
        options = RunOptions(log=True, log_errors=True, summary=False, name="dashboard")
        super().__init__(spec, environment, packages, options, output)
        self._report = on_end
        self.supervisor.on_change = on_change

    def _on_end(self, process: Process) -> None:
        self._report(process)


class LaunchRun:
    """A launch file that runs in a separate thread.

    ``on_change`` is called in that thread when :meth:`state` or ``output`` has changed.
    """

    _ids: ClassVar[Iterator[int]] = itertools.count(1)

    def __init__(
        self,
        package: str,
        file: str,
        path: Path,
        args: Mapping[str, str],
        environment: Environment,
        packages: Packages,
        on_change: Callable[[], object] = lambda: None,
    ) -> None:
        self.id = next(self._ids)
        self.package, self.file, self.path, self.args = package, file, path, dict(args)
        self.output = _Lines(on_change)
        self._on_change = on_change
        self._environment = environment
        self._packages = packages
        self._state = "starting"
        self._error = ""
        self._is_stopped = False
        self._launcher: _PageLauncher | None = None
        self._nodes: list[NodeSpec] = []
        self._exited: dict[str, Process] = {}
        self._known: dict[str, Process] = {}
        self._lock = threading.Lock()
        # A daemon thread lets this process exit during a launch; the launcher's guardian then stops the nodes.
        self._thread = threading.Thread(target=self._run, name=f"launch-{self.id}", daemon=True)
        self._thread.start()

    @property
    def is_ended(self) -> bool:
        """Return whether the launch and all its nodes have exited."""
        return self._state == "ended"

    @property
    def is_stopping(self) -> bool:
        """Return whether the nodes are being stopped."""
        return self._state == "stopping"

    @property
    def _is_ending(self) -> bool:
        return self._state in ("stopping", "ended")

    def has_exited(self, node: str) -> bool:
        """Return whether a node has been started and has exited."""
        process = self._known.get(node)
        return process is not None and not process.is_running

    def state(self) -> RunState:
        """Return the launch's current state. May be called from any thread."""
        launcher = self._launcher
        for process in tuple(launcher.processes) if launcher else ():
            if process.node:
                self._known[process.node.name] = process
        nodes = [self._node_state(node) for node in self._nodes]
        return RunState(self.id, self.package, self.file, self.args, self._state, self._error, nodes)

    def log_file(self, node: str) -> Path | None:
        """Return the file that contains a node's output, or None if it does not exist yet."""
        process = self._known.get(node)
        return process.stdout_file if process else None

    def stop(self) -> None:
        """Begin to stop all nodes, and return without waiting for them. May be called from any thread."""
        with self._lock:
            self._is_stopped = True
            if self._state in ("starting", "running"):
                self._state = "stopping"
            if self._launcher:
                self._launcher.stop("the page")
        self._on_change()

    def join(self) -> None:
        """Wait until the launch has ended."""
        self._thread.join()

    def end_node(self, name: str, *, restarts: bool) -> None:
        """Stop a node; if ``restarts`` is true, start it again. Raise UsageError if it is not running."""
        launcher, process = self._launcher, self._known.get(name)
        if not launcher or not process or not process.is_running or self._state != "running":
            raise UsageError(f"node [{name[:200]}] does not run")
        if process.is_ending:
            raise UsageError(f"node [{name[:200]}] is being ended already")
        process.is_ending, process.is_restarting = True, restarts
        threading.Thread(target=launcher.supervisor.end_process, args=(process,), daemon=True).start()

    def _run(self) -> None:
        try:
            self._launch()
        except KeyboardInterrupt:
            pass  # the launch was stopped while the node was starting
        except MinirospyError as error:
            self._error = str(error)
        except Exception as error:  # noqa: BLE001 - the page shows it
            self._error = f"the launch failed: {error!r}"
            _log.exception("%s/%s", self.package, self.file)
        finally:
            self._end()

    def _launch(self) -> None:
        spec = load_sources([LaunchSource(str(self.path), None, self.args)], self._packages)
        unknown = [name for name in self.args if name not in spec.args]
        if unknown:
            raise UsageError(f"the launch file declares no <arg> '{unknown[0]}'")
        launcher = _PageLauncher(
            spec, self._environment, self._packages, self.output, self._node_ended, self._on_change
        )
        self._nodes = list(spec.nodes)
        with self._lock:
            self._launcher = launcher
            if self._is_stopped:
                launcher.stop("the page")
        launcher.start()
        with self._lock:
            if not self._is_stopped:
                self._state = "running"
        self._on_change()
        status = launcher.watch()
        if status and not self._is_stopped:
            self._error = "a required node has died"

    def _end(self) -> None:
        with self._lock:
            self._state = "stopping"
        self.state()
        self._on_change()
        try:
            if self._launcher:
                self._launcher.close()
        except (MinirospyError, OSError) as error:
            self._error = self._error or str(error)
        except Exception as error:  # noqa: BLE001 - the page shows it
            self._error = self._error or f"the launch did not end in order: {error!r}"
            _log.exception("%s/%s", self.package, self.file)
        finally:
            self._state = "ended"
            self._on_change()

    def _node_ended(self, process: Process) -> None:
        assert process.node
        self._known[process.node.name] = process
        self._exited[process.node.name] = process

    def _node_state(self, node: NodeSpec) -> NodeState:
        process = self._known.get(node.name)
        program = f"{node.package}/{node.type}"
        if process is None:
            failed = self._launcher.failed if self._launcher else []
            is_failed = any(each.name == node.name for each in failed)
            state = "failed" if is_failed else "stopped" if self._state == "ended" else "starting"
            return NodeState(node.name, program, state, None, None, 0, node.respawn)

        status = process.exit_code
        if status is None:
            state = "ending" if process.is_ending else "running"
        elif process.is_ending or (self._is_ending and process is not self._exited.get(node.name)):
            state = "stopped"
        else:
            state = "exited"
        pid = process.pid if status is None else None
        return NodeState(node.name, program, state, status, pid, process.starts, node.respawn)
