"""The roslaunch process on another machine, started through ssh. It runs the nodes that its parent sends.

Source: http://wiki.ros.org/roslaunch/Architecture.
"""

from __future__ import annotations

import contextlib
import os
import threading

from minirospy.base.clock import SignalSafeEvent
from minirospy.base.environment import Environment
from minirospy.base.errors import MinirospyError, RpcError
from minirospy.ros.roslaunch.launcher.load import load_text
from minirospy.ros.roslaunch.launcher.output import Output
from minirospy.ros.roslaunch.launcher.process import Process
from minirospy.ros.roslaunch.launcher.remote import Api, Method, call
from minirospy.ros.roslaunch.launcher.runner import Launcher, RunOptions
from minirospy.ros.roslaunch.launcher.spec import LaunchSpec
from minirospy.workspace.packages import Packages

__all__ = ["run_child"]

_HEARTBEAT_SECONDS = 3.0
_MAX_MISSED = 3


def run_child(
    name: str, parent: str, run_id: str, environment: Environment, packages: Packages, options: RunOptions
) -> int:
    """Run as child ``name`` of the roslaunch at the URI ``parent``; return the exit status.

    Run until the parent or a signal stops it. Raise MinirospyError if the parent does not respond.
    """

    def listener(level: int, text: str) -> None:
        with contextlib.suppress(RpcError):
            call(parent, "log", name, level, text)

    launcher = _Child(parent, environment, packages, options, Output(title=False, listener=listener))
    launcher.run_id = run_id
    with launcher.signals():
        api = Api(environment, launcher.methods())
        done = SignalSafeEvent()
        try:
            try:
                call(parent, "register", name, api.uri)
            except RpcError as error:
                raise MinirospyError(
                    f"the roslaunch that started this one does not answer: {error}"
                ) from error
            threading.Thread(target=launcher.look_after_parent, args=(done,), daemon=True).start()
            return launcher.watch(forever=True)
        finally:
            done.set()
            launcher.close()
            api.close()


class _Child(Launcher):
    def __init__(
        self, parent: str, environment: Environment, packages: Packages, options: RunOptions, output: Output
    ) -> None:
        super().__init__(LaunchSpec(), environment, packages, options, output)
        self._parent = parent

    def methods(self) -> dict[str, Method]:
        """Return the XML-RPC methods that the parent calls."""
        return {
            "launch": self._launch,
            "shutdown": self._shutdown,
            "get_pid": os.getpid,
            "get_node_names": lambda: [process.name for process in self.processes],
            "list_processes": lambda: [[[process.name, process.starts] for process in self.processes], []],
        }

    def look_after_parent(self, done: threading.Event) -> None:
        """Poll the parent regularly; stop the run if it no longer responds."""
        missed = 0
        while not done.wait(_HEARTBEAT_SECONDS):
            try:
                call(self._parent, "get_pid", timeout=_HEARTBEAT_SECONDS)
                missed = 0
            except RpcError:
                missed += 1
                if missed == _MAX_MISSED:
                    self.stop("the parent does not answer")
                    return

    def _launch(self, text: str) -> list[list[str]]:
        spec = load_text(text, {}, self._packages)
        self._output.print("launching nodes...")
        names: list[list[str]] = [[], []]
        for node in spec.nodes:
            process = self.start_node(node)
            names[process is None].append(process.name if process else node.base_name)
        self._output.print("... done launching nodes")
        return names

    def _shutdown(self) -> int:
        self.stop("shutdown")
        return 1

    def _on_end(self, process: Process) -> None:
        with contextlib.suppress(RpcError):
            call(self._parent, "process_died", process.name, process.exit_code or 0)
