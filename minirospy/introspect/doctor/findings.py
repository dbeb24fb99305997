"""The result of a check: one finding, printed as one line."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

__all__ = ["Finding", "Status", "ok", "problem", "warning"]


class Status(str, Enum):
    """The result of a check. A warning may be harmless; a problem is a definite failure."""

    OK = "ok"
    WARNING = "warning"
    PROBLEM = "problem"


class Finding(NamedTuple):
    """The result of one check.

    ``check``: the check's subject; ``text``: the observation; ``advice``: the action to take, or "" if none is needed.
    """

    check: str
    status: Status
    text: str
    advice: str = ""


def ok(check: str, text: str) -> Finding:
    """Return a finding that requires no action."""
    return Finding(check, Status.OK, text)


def warning(check: str, text: str, advice: str) -> Finding:
    """Return a finding for a possible cause of a failure."""
    return Finding(check, Status.WARNING, text, advice)


def problem(check: str, text: str, advice: str) -> Finding:
    """Return a finding for a definite failure."""
    return Finding(check, Status.PROBLEM, text, advice)
