"""Graph resource names: their syntax and their resolution.

Pure. Source: http://wiki.ros.org/Names and http://wiki.ros.org/Remapping%20Arguments.
"""

from __future__ import annotations

import os
import re
import socket
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

__all__ = [
    "Arguments",
    "anonymous_name",
    "canonicalize",
    "is_global",
    "is_legal_base_name",
    "is_legal_name",
    "is_private",
    "join",
    "namespace_of",
    "parse_arguments",
    "parse_launch_arguments",
    "resolve",
]

_LEGAL = re.compile(r"^[~/A-Za-z][\w/]*\Z", re.ASCII)
_LEGAL_BASE = re.compile(r"^[A-Za-z]\w*\Z", re.ASCII)
_ASSIGNMENT = re.compile(r"^[~/A-Za-z_][\w/]*:=")


def is_legal_name(name: str) -> bool:
    """Return whether ``name`` is a legal graph resource name. The empty name is legal: it resolves to the namespace."""
    return name == "" or (bool(_LEGAL.match(name)) and "//" not in name)


def is_legal_base_name(name: str) -> bool:
    """Return whether ``name`` is legal without any namespace, as required for a node name."""
    return bool(_LEGAL_BASE.match(name))


def is_global(name: str) -> bool:
    """Return whether ``name`` is global, that is, starts with ``/``."""
    return name.startswith("/")


def is_private(name: str) -> bool:
    """Return whether ``name`` starts with ``~``."""
    return name.startswith("~")


def canonicalize(name: str) -> str:
    """Return ``name`` without repeated or trailing slashes."""
    if not name or name == "/":
        return name
    return ("/" if name[0] == "/" else "") + "/".join(part for part in name.split("/") if part)


def namespace_of(name: str) -> str:
    """Return the namespace that contains ``name``, with a trailing slash: ``/a/`` for ``/a/b``."""
    if not name:
        return "/"
    stem = name.removesuffix("/")
    return (stem[: stem.rfind("/") + 1] or "/") if "/" in stem else "/"


def join(namespace: str, name: str) -> str:
    """Return ``name`` below ``namespace``. Global and private names are returned unchanged."""
    if is_global(name) or is_private(name):
        return name
    if namespace == "~":
        return "~" + name
    if not namespace:
        return name
    return namespace.rstrip("/") + "/" + name


def resolve(name: str, node_name: str, remappings: Mapping[str, str] | None = None) -> str:
    """Remap ``name`` and return it as a global name, resolved relative to the node ``node_name`` (global)."""
    if not name:
        return namespace_of(node_name)
    name = canonicalize(name)
    if is_global(name):
        resolved = name
    elif is_private(name):
        resolved = canonicalize(node_name + "/" + name[1:])
    else:
        resolved = namespace_of(node_name) + name
    return remappings.get(resolved, resolved) if remappings else resolved


def anonymous_name(base: str) -> str:
    """Return a unique name made from ``base``, the host, the process id and a random number."""
    host = re.sub(r"[^A-Za-z0-9_]", "_", socket.gethostname())
    number = int.from_bytes(os.urandom(8), "big") >> 1
    return f"{base}_{host}_{os.getpid()}_{number}"


class Arguments(NamedTuple):
    """A parsed command line.

    ``plain``: the arguments that remain for the program; ``remappings``: names as typed, unresolved;
    ``parameters``: private parameters as (name without the underscore, YAML text);
    ``special``: ``__name``, ``__ns`` and similar; ``wrong``: arguments with more than one ``:=``.
    """

    plain: list[str]
    remappings: dict[str, str]
    parameters: dict[str, str]
    special: dict[str, str]
    wrong: list[str]

    def resolved_remappings(self, node_name: str) -> dict[str, str]:
        """Return the remappings with old and new names resolved to global names."""
        return {resolve(a, node_name): resolve(b, node_name) for a, b in self.remappings.items()}


def parse_arguments(argv: Sequence[str] | Iterable[str]) -> Arguments:
    """Extract ``from:=to``, ``_param:=value`` and ``__special:=value`` from a command line.

    An argument that does not start with a name, such as ``--flag:=x``, remains for the program; an assignment without a
    value has no effect.
    """
    parsed = Arguments([], {}, {}, {}, [])
    for argument in argv:
        if not _ASSIGNMENT.match(argument):
            parsed.plain.append(argument)
            continue
        key, _, value = argument.partition(":=")
        value = value.strip()
        if ":=" in value:
            parsed.wrong.append(argument)
        elif not value:
            continue
        elif key.startswith("__"):
            parsed.special[key] = value
        elif key.startswith("_") and key != "_":
            parsed.parameters[key[1:]] = value
        else:
            parsed.remappings[key] = value
    return parsed


def parse_launch_arguments(words: Iterable[str]) -> dict[str, str]:
    """Parse the launch-file arguments ``name:=value`` among ``words`` into a dict.

    As in roslaunch, spaces around a value are stripped, and an argument with an empty value keeps its default;
    special names (``__ns``) and private parameters (``_name``) are not arguments.
    """
    pairs = (word.partition(":=") for word in words)
    return {name: text for name, _, value in pairs if name and name[0] != "_" and (text := value.strip())}
