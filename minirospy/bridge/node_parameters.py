"""Private parameters of the bridge's nodes, checked; their tokens, which come from the environment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

from minirospy.bridge.tokens import Tokens, kept_tokens
from minirospy.environment import Environment
from minirospy.errors import BridgeError

__all__ = ["globs", "number", "texts", "tokens_of", "value"]

_T = TypeVar("_T", str, int, bool)


def value(private: Mapping[str, object], name: str, kind: type[_T], default: _T) -> _T:
    """Return a parameter. Raises BridgeError where it is of another type."""
    found = private.get(name, default)
    if not isinstance(found, kind) or (kind is int and isinstance(found, bool)):
        raise BridgeError(f"parameter ~{name} is {found!r}: it has to be of type {kind.__name__}")
    return found


def number(private: Mapping[str, object], name: str, default: float) -> float:
    """Return a parameter that is a number. Raises BridgeError."""
    found = private.get(name, default)
    if isinstance(found, bool) or not isinstance(found, int | float):
        raise BridgeError(f"parameter ~{name} is {found!r}: it has to be a number")
    return float(found)


def texts(private: Mapping[str, object], name: str, default: Sequence[str]) -> list[str]:
    """Return a parameter that is a list of strings. Raises BridgeError."""
    found = private.get(name, default)
    if not isinstance(found, list | tuple) or not all(isinstance(each, str) for each in found):
        raise BridgeError(f"parameter ~{name} is {found!r}: it has to be a list of strings")
    return list(found)


def globs(private: Mapping[str, object], name: str) -> list[str]:
    """Return the globs of a parameter as rosbridge has them: a list, or a text such as "['/tf', '/odom*']"; none: all."""
    found = private.get(name, "")
    if isinstance(found, str):
        found = [each.strip().strip("'\"") for each in found.strip().strip("[]").split(",")]
    return [each for each in texts({name: found}, name, ()) if each]


def tokens_of(environ: Mapping[str, str], *, beyond: bool) -> Tokens:
    """Return the tokens of the environment; where others may connect (``beyond``) and there are none, those of this user."""
    given = Tokens(environ.get("MINIROSPY_BRIDGE_TOKEN", ""), environ.get("MINIROSPY_BRIDGE_READ_TOKEN", ""))
    return kept_tokens(Environment.read().home) if beyond and not any(given) else given
