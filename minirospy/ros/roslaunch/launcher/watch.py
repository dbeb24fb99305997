"""Detects changes in nodes' files, for `roslaunch --watch`."""

from __future__ import annotations

from pathlib import Path

from minirospy.base.errors import MinirospyError
from minirospy.ros.roslaunch.launcher.command import node_program
from minirospy.ros.roslaunch.launcher.spec import NodeSpec
from minirospy.workspace.packages import Packages

__all__ = ["FileWatch"]


class FileWatch:
    """Watches a node's program and the Python modules in its package's ``src`` folder."""

    def __init__(self, packages: Packages) -> None:
        self._packages = packages
        self._seen: dict[str, dict[Path, int]] = {}

    def add(self, node: NodeSpec) -> None:
        """Start watching a node's files."""
        self._seen[node.name] = self._times(node)

    def changed(self, node: NodeSpec) -> Path | None:
        """Return a file that has changed since add() or the last call, or None."""
        before, now = self._seen.get(node.name, {}), self._times(node)
        self._seen[node.name] = now
        # Ignore missing files, which are probably being rewritten.
        return next((path for path, when in now.items() if before.get(path) != when), None)

    def _times(self, node: NodeSpec) -> dict[Path, int]:
        times: dict[Path, int] = {}
        try:
            files = [Path(node_program(node, self._packages)[-1])]
            files += (self._packages.find(node.package) / "src").rglob("*.py")
        except MinirospyError:
            return times
        for path in files:
            try:
                times[path] = path.stat().st_mtime_ns
            except OSError:
                continue
        return times
