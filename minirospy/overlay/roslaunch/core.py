"""roslaunch.core, filled in by minirospy: nodes, parameters and machines, and what roslaunch says."""

from __future__ import annotations

import sys
import uuid

from minirospy.environment import is_own_host
from minirospy.launch.config import Machine, Node, Param, RLException, Test

__all__ = [
    "PHASE_RUN",
    "PHASE_SETUP",
    "PHASE_TEARDOWN",
    "Machine",
    "Node",
    "Param",
    "RLException",
    "Test",
    "generate_run_id",
    "is_machine_local",
    "local_machine",
    "printerrlog",
    "printlog",
    "printlog_bold",
]

PHASE_SETUP, PHASE_RUN, PHASE_TEARDOWN = "setup", "run", "teardown"


def generate_run_id() -> str:
    """A new run id."""
    return str(uuid.uuid1())


def local_machine() -> Machine:
    """This machine."""
    return Machine("", "localhost")


def is_machine_local(machine: Machine) -> bool:
    """Whether a machine is this one."""
    return not machine.user and is_own_host(machine.address)


def printlog(msg: str) -> None:
    """A line on standard output."""
    print(msg, flush=True)


def printlog_bold(msg: str) -> None:
    """A line on standard output, bold on a terminal."""
    print(f"\033[1m{msg}\033[0m" if sys.stdout.isatty() else msg, flush=True)


def printerrlog(msg: str) -> None:
    """A line on standard error, red on a terminal."""
    print(f"\033[31m{msg}\033[0m" if sys.stderr.isatty() else msg, file=sys.stderr, flush=True)
