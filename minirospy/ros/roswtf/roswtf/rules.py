"""roswtf.rules: converts the checks' return values to errors and warnings in a context.

A rule is a pair (check, message). A check returns the problem, or a falsy value. If it returns a list, each item is shown
separately.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

from minirospy.ros.roswtf.roswtf.model import WtfError, WtfWarning

__all__ = ["error_rule", "warning_rule"]


class Context(Protocol):
    """The context that roswtf's rules examine."""

    errors: list[WtfError]
    warnings: list[WtfError]

    def as_dictionary(self) -> Mapping[str, object]:
        """Return the values for use in a rule's message."""


Rule = tuple[Callable[..., object], str]


def error_rule(rule: Rule, ret: object, ctx: Context) -> None:
    """Add an error to the context if the rule's check found a problem."""
    _add(rule, ret, ctx, ctx.errors, WtfError)


def warning_rule(rule: Rule, ret: object, ctx: Context) -> None:
    """Add a warning to the context if the rule's check found a problem."""
    _add(rule, ret, ctx, ctx.warnings, WtfWarning)


def _add(rule: Rule, ret: object, ctx: Context, found: list[WtfError], kind: type[WtfError]) -> None:
    if not ret:
        return
    text = rule[1] % ctx.as_dictionary()
    if isinstance(ret, (list, tuple)):
        text += "\n" + "".join(f" * {item}\n" for item in ret)
    elif isinstance(ret, str):
        text += ret
    found.append(kind(text, rule[1], ret))
