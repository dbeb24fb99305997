"""roslib.rospack: the commands rospack and rosstack as functions, for old programs; rospkg replaces them."""

from __future__ import annotations

import subprocess
import sys
import warnings
from collections.abc import Sequence

from minirospy.ros.roslib.roslib.exceptions import ROSLibException

__all__ = [
    "rospack_depends",
    "rospack_depends_1",
    "rospack_depends_on",
    "rospack_depends_on_1",
    "rospack_plugins",
    "rospackexec",
    "rosstack_depends",
    "rosstack_depends_1",
    "rosstack_depends_on",
    "rosstack_depends_on_1",
    "rosstackexec",
]

warnings.warn("roslib.rospack is deprecated, please use rospkg", stacklevel=2)


def rospackexec(args: Sequence[str]) -> str:
    """Return the stripped stdout of `rospack` with these arguments, or an empty string on failure."""
    return _output("main", args)


def rosstackexec(args: Sequence[str]) -> str:
    """Return the stripped stdout of `rosstack` with these arguments, or an empty string on failure."""
    return _output("rosstack", args)


def rospack_depends(pkg: str) -> list[str]:
    """Return a package's direct and indirect dependencies."""
    return rospackexec(["depends", pkg]).split()


def rospack_depends_1(pkg: str) -> list[str]:
    """Return a package's direct dependencies."""
    return rospackexec(["depends1", pkg]).split()


def rospack_depends_on(pkg: str) -> list[str]:
    """Return the packages that depend on a package, directly or indirectly."""
    return rospackexec(["depends-on", pkg]).split()


def rospack_depends_on_1(pkg: str) -> list[str]:
    """Return the packages that depend on a package directly."""
    return rospackexec(["depends-on1", pkg]).split()


def rospack_plugins(pkg: str) -> list[tuple[str, str]]:
    """Return (package, plugin attribute) for each package that exports a plugin for ``pkg``."""
    lines = rospackexec(["plugins", "--attrib=plugin", pkg]).splitlines()
    return [(name, value.strip()) for name, _, value in (line.partition(" ") for line in lines)]


def rosstack_depends(s: str) -> list[str]:
    """Return a stack's direct and indirect dependencies."""
    return rosstackexec(["depends", s]).split()


def rosstack_depends_1(s: str) -> list[str]:
    """Return a stack's direct dependencies."""
    return rosstackexec(["depends1", s]).split()


def rosstack_depends_on(s: str) -> list[str]:
    """Return the stacks that depend on a stack, directly or indirectly."""
    return rosstackexec(["depends-on", s]).split()


def rosstack_depends_on_1(s: str) -> list[str]:
    """Return the stacks that depend on a stack directly."""
    return rosstackexec(["depends-on1", s]).split()


def _output(function: str, args: Sequence[str]) -> str:
    code = (
        f"import sys; from minirospy.ros.rospack.commands.rospack import {function} as run; sys.exit(run())"
    )
    try:
        done = subprocess.run(
            [sys.executable, "-c", code, *args], capture_output=True, text=True, check=False
        )
    except OSError as error:
        raise ROSLibException(str(error)) from error
    return done.stdout.strip()
