"""Finds errors in launch files without running their nodes."""

from __future__ import annotations

from collections.abc import Sequence

from minirospy.base.errors import LaunchError
from minirospy.ros.roslaunch.launcher.command import node_command
from minirospy.ros.roslaunch.launcher.load import LaunchSource, Problems, load_sources
from minirospy.ros.roslaunch.launcher.spec import LaunchSpec
from minirospy.workspace.packages import Packages

__all__ = ["faults_of", "find_problems", "problem_line"]


def find_problems(sources: Sequence[LaunchSource], packages: Packages) -> tuple[LaunchSpec, Problems]:
    """Return the files' spec and all problems: errors in the files, missing programs and undeclared machines."""
    problems: Problems = []
    spec = load_sources(sources, packages, problems=problems)
    for node in spec.runnables():
        for test in (lambda node: node_command(node, packages), spec.machine_of):
            try:
                test(node)
            except LaunchError as problem:
                problems.append(problem)
    return spec, problems


def faults_of(file: str, packages: Packages, *, ignore_unset_args: bool = False) -> Problems:
    """Return a launch file's errors.

    If ``ignore_unset_args`` and an arg has no value, return no errors at all: the missing value may have caused them.
    """
    _, problems = find_problems([LaunchSource(file, None, {})], packages)
    is_unset = any(problem.text.startswith("requires the '") for problem in problems)
    return [] if is_unset and ignore_unset_args else problems


def problem_line(problem: LaunchError, kind: str = "error") -> str:
    """Format an error for editors: FILE:LINE: KIND: TEXT."""
    where = f"{problem.file}:{problem.line}" if problem.line else problem.file
    return f"{where}: {kind}: {problem.text}"
