"""roslaunch.core, filled in by minirospy: nodes, parameters and machines, and what roslaunch says."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Mapping

from minirospy.compat.roslaunch.config import Machine, Node
from minirospy.environment import Environment
from minirospy.launch.command import node_environment
from minirospy.launch.output import ERROR, Output

__all__ = [
    "PHASE_RUN",
    "PHASE_SETUP",
    "PHASE_TEARDOWN",
    "add_printerrlog_handler",
    "add_printlog_handler",
    "clear_printerrlog_handlers",
    "clear_printlog_handlers",
    "generate_run_id",
    "get_master_uri_env",
    "printerrlog",
    "printlog",
    "printlog_bold",
    "setup_env",
]

PHASE_SETUP, PHASE_RUN, PHASE_TEARDOWN = "setup", "run", "teardown"


class _Handler:
    """Hears the lines of one kind: errors, or all others."""

    def __init__(self, function: Callable[[str], object], *, errors: bool) -> None:
        self._function = function
        self.errors = errors

    def __call__(self, level: int, text: str) -> None:
        if (level >= ERROR) == self.errors:
            self._function(text)


def add_printlog_handler(h: Callable[[str], object]) -> None:
    """Have a function called with each line that roslaunch writes to standard output."""
    Output.handlers.append(_Handler(h, errors=False))


def add_printerrlog_handler(h: Callable[[str], object]) -> None:
    """Have a function called with each line that roslaunch writes to standard error."""
    Output.handlers.append(_Handler(h, errors=True))


def clear_printlog_handlers() -> None:
    """Forget the functions of add_printlog_handler()."""
    _clear(errors=False)


def clear_printerrlog_handlers() -> None:
    """Forget the functions of add_printerrlog_handler()."""
    _clear(errors=True)


def generate_run_id() -> str:
    """A new run id."""
    return str(uuid.uuid1())


def get_master_uri_env() -> str:
    """The master's URI, as the environment has it."""
    return Environment.read().master_uri


def setup_env(
    node: Node | None, machine: Machine, master_uri: str, env: Mapping[str, str] | None = None
) -> dict[str, str]:
    """The environment of a node's process, on ``env`` (of this process, where none is given)."""
    environment = Environment.read()._replace(master_uri=master_uri)
    return node_environment((node or Node("p", "t", "n")).spec, environment, env)


def printlog(msg: str) -> None:
    """A line on standard output."""
    Output().say(msg)


def printlog_bold(msg: str) -> None:
    """A line on standard output, bold on a terminal."""
    Output().say(msg, bold=True)


def printerrlog(msg: str) -> None:
    """A line on standard error, red on a terminal."""
    Output().warn(msg)


def _clear(*, errors: bool) -> None:
    Output.handlers[:] = [
        each for each in Output.handlers if not (isinstance(each, _Handler) and each.errors == errors)
    ]
