"""The result of a check: one finding, one line."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

__all__ = ["Finding", "Status", "ok", "problem", "warning"]


class Status(str, Enum):
    """The result of a check. A warning may be harmless; a problem is not."""

    OK = "ok"
    WARNING = "warning"
    PROBLEM = "problem"


class Finding(NamedTuple):
    """``check`` is what was looked at, ``text`` what was seen, ``advice`` what to do about it ("": nothing)."""

    check: str
    status: Status
    text: str
    advice: str = ""


def ok(check: str, text: str) -> Finding:
    """Return nothing to do."""
    return Finding(check, Status.OK, text)


def warning(check: str, text: str, advice: str) -> Finding:
    """Something that is sometimes at fault."""
    return Finding(check, Status.WARNING, text, advice)


def problem(check: str, text: str, advice: str) -> Finding:
    """Something that does not work."""
    return Finding(check, Status.PROBLEM, text, advice)
