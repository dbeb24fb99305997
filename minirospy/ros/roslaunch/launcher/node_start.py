"""Starts a node's process from its NodeSpec, with its command, environment, working folder and log files."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from minirospy.base.environment import Environment
from minirospy.base.errors import MinirospyError
from minirospy.base.keyboard import may_read_stdin
from minirospy.ros.roslaunch.launcher.command import node_command, node_environment, node_folder
from minirospy.ros.roslaunch.launcher.master import LaunchMaster
from minirospy.ros.roslaunch.launcher.options import RunOptions
from minirospy.ros.roslaunch.launcher.preload import MIN_NODES, Preload, Start
from minirospy.ros.roslaunch.launcher.process import Process, start_process
from minirospy.ros.roslaunch.launcher.spec import NodeSpec
from minirospy.workspace.packages import Packages

__all__ = ["NodeStarter"]


class NodeStarter:
    """Starts a launch's nodes."""

    def __init__(
        self, environment: Environment, packages: Packages, options: RunOptions, master: LaunchMaster
    ) -> None:
        self._environment = environment
        self._packages = packages
        self._options = options
        self._master = master
        self._has_warned = False
        self._preload = Preload()

    def prepare(self, nodes: Sequence[NodeSpec]) -> None:
        """Start the preloaded processes that will fork similar ``nodes``."""
        if len(nodes) < MIN_NODES:
            return
        starts = []
        for node in nodes:
            # start() will report this error.
            with contextlib.suppress(MinirospyError):
                command = node_command(node, self._packages)
                folder = node_folder(node, self._packages, self._environment)
                starts.append(Start(tuple(command), self._variables(node), self._made(folder)))
        self._preload.prepare(starts)

    def close(self) -> None:
        """End the preloaded processes, so that later starts do not use them. Idempotent."""
        self._preload.close()

    def start(self, node: NodeSpec, name: str) -> Process:
        """Start a node as process ``name``. Raise MinirospyError if its process or folder cannot be created."""
        command = node_command(node, self._packages)
        folder = node_folder(node, self._packages, self._environment)
        environ = self._variables(node)
        screen = self._uses_screen(node)
        folder = self._made(folder)

        log = self._master.log_folder / name.replace("/", "-")
        process = start_process(
            name,
            [*command, f"__log:={log}.log"],
            environ=environ,
            folder=folder,
            stdout_file=None if screen else log.with_name(f"{log.name}-stdout.log"),
            log_errors=self._options.log_errors,
            stdin=None if self._options.inherit_stdin and may_read_stdin() else subprocess.DEVNULL,
            preload=self._preload,
        )
        process.node = node
        process.log_files = f"{log}*.log" if self._master.has_logs else "none"
        return process

    def _variables(self, node: NodeSpec) -> dict[str, str]:
        """Return the environment variables for a node's process."""
        environ = node_environment(node, self._environment)
        if not self._uses_screen(node) or not sys.stdout.isatty():
            # Make Python write to files and pipes immediately. On a terminal, Python already writes each line at once,
            # and as a whole, so that lines from different nodes do not mix.
            environ.setdefault("PYTHONUNBUFFERED", "1")
        return environ

    def _made(self, folder: Path) -> Path:
        """Create a node's working folder and return it, or the temporary folder if ROS_HOME is not writable."""
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            why = error.strerror or error
            if folder != self._environment.home:
                raise MinirospyError(f"the folder {folder} cannot be made: {why}") from error
            instead = Path(tempfile.gettempdir())
            if not self._has_warned:
                self._has_warned = True
                text = f"WARNING: the folder {folder} cannot be made: {why}; nodes start in {instead}; set ROS_HOME"
                print(text, file=sys.stderr)
            return instead
        return folder

    def _uses_screen(self, node: NodeSpec) -> bool:
        """Return whether a node's output goes to the terminal instead of a file."""
        if not self._master.has_logs:
            return True
        return (self._options.screen or node.output == "screen") and not self._options.log
