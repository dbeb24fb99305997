"""Read and check private parameters of the bridge's nodes; their tokens come from the environment."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import TypeVar

from minirospy.aio.node import Node
from minirospy.base.environment import Environment
from minirospy.base.errors import BridgeError
from minirospy.web.access import Access, is_loopback
from minirospy.web.addresses import host_names
from minirospy.web.tokens import Tokens, kept_tokens

__all__ = ["access_of", "address_of", "globs", "number", "private_parameters", "texts", "value"]

_T = TypeVar("_T", str, int, bool)

_OFF = (None, False, 0, "", "None")
"""Parameter values that mean that a feature is off."""


async def private_parameters(
    node: Node, without_effect: Iterable[str] = (), given: Mapping[str, object] = MappingProxyType({})
) -> dict[str, object]:
    """Return a node's private parameters, overridden by ``given``.

    Warn about each parameter in ``without_effect`` that is set.
    """
    found = await node.get_param("~", {})
    private = {**(found if isinstance(found, dict) else {}), **given}
    for name in without_effect:
        if private.get(name) not in _OFF:
            node.log.warning("parameter ~%s has no effect", name)
    return private


def value(private: Mapping[str, object], name: str, kind: type[_T], default: _T) -> _T:
    """Return a parameter. Raise BridgeError if its type is not ``kind``."""
    found = private.get(name, default)
    if not isinstance(found, kind) or (kind is int and isinstance(found, bool)):
        raise BridgeError(f"parameter ~{name} is {found!r}: it has to be of type {kind.__name__}")
    return found


def number(private: Mapping[str, object], name: str, default: float) -> float:
    """Return a parameter as a number. Raise BridgeError if it is not one."""
    found = private.get(name, default)
    if isinstance(found, bool) or not isinstance(found, int | float):
        raise BridgeError(f"parameter ~{name} is {found!r}: it has to be a number")
    return float(found)


def texts(private: Mapping[str, object], name: str, default: Sequence[str]) -> list[str]:
    """Return a parameter as a list of strings. Raise BridgeError if it is not one."""
    found = private.get(name, default)
    if not isinstance(found, list | tuple) or not all(isinstance(each, str) for each in found):
        raise BridgeError(f"parameter ~{name} is {found!r}: it has to be a list of strings")
    return list(found)


def globs(private: Mapping[str, object], name: str) -> list[str]:
    """Return the globs in a parameter, in either of rosbridge's formats: a list, or a string such as "['/tf', '/odom*']".

    An empty list allows all names.
    """
    found = private.get(name, "")
    if isinstance(found, str):
        found = [each.strip().strip("'\"") for each in found.strip().strip("[]").split(",")]
    return [each for each in texts({name: found}, name, ()) if each]


def address_of(private: Mapping[str, object]) -> str:
    """Return the address to bind. Raise BridgeError if the parameter is invalid."""
    return value(private, "address", str, "") or "127.0.0.1"


def access_of(
    private: Mapping[str, object], environ: Mapping[str, str], origins: Iterable[str] = ()
) -> Access:
    """Return the access rules, with tokens from the environment.

    If other machines may connect and the environment has no tokens, use this user's stored tokens. Raise BridgeError if a
    parameter is invalid or the tokens cannot be stored.
    """
    beyond = not is_loopback(address_of(private))
    tokens = Tokens(environ.get("MINIROSPY_BRIDGE_TOKEN", ""), environ.get("MINIROSPY_BRIDGE_READ_TOKEN", ""))
    if beyond and not any(tokens):
        tokens = kept_tokens(Environment.read().home)
    return Access(
        hosts=tuple(host_names()),
        origins=tuple(origins),
        read_token=tokens.read,
        write_token=tokens.write,
        requires_token=beyond or any(tokens),
    )
