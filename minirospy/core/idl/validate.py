"""Check all text that becomes Python source (names of types and fields, and sizes) before anything is generated.

A definition may come from a file or from any publisher's connection header, and its names are written into source that
is executed. Therefore they must match ROS's grammar (http://wiki.ros.org/Names, http://wiki.ros.org/msg), which allows
no character that could end a name or a string in Python. Also, a short text may expand to a very large message, for
example by types that each have two fields of the next type, or by an array of a billion numbers. Therefore the expanded
size is computed first.
"""

from __future__ import annotations

import keyword
import re
from collections.abc import Callable
from graphlib import CycleError, TopologicalSorter
from typing import NamedTuple

from minirospy.base.errors import DefinitionError
from minirospy.core.idl.source import python_name
from minirospy.core.idl.spec import PRIMITIVES, MessageSpec

__all__ = ["MAX_LEVELS", "MAX_TEXT", "check_spec", "check_type_name", "check_types", "is_type_name"]

# maximum number of characters in a full text; the largest ones in real packages have about 30,000
MAX_TEXT = 1 << 20

MAX_LEVELS = 50  # maximum depth of nested messages

# Maximum number of fields per message, including those of nested messages: the generated source has code for each of them
_MAX_FIELDS = 4_000

# Maximum number of fields in all types that a message uses; MoveIt's largest message has about 17,000
_MAX_FIELDS_IN_ALL = 32_000

_MAX_BYTES = 1 << 27  # maximum total size in bytes of a message's fixed-length arrays in memory

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_SHOWN = 80


def is_type_name(name: str) -> bool:
    """Return whether a string is ``pkg/Name`` in ROS's grammar, without a Python keyword in either part."""
    package, slash, short = name.partition("/")
    return bool(slash) and all(
        _NAME.fullmatch(part) and not keyword.iskeyword(part) for part in (package, short)
    )


def check_type_name(name: str, where: str = "") -> None:
    """Raise DefinitionError if ``name`` is not a type name; ``where`` is the name of the text that contains it."""
    if is_type_name(name):
        return
    shown = _shown(name)
    why = "is not of the form package/Type in letters, digits and underscores"
    if any(keyword.iskeyword(part) for part in name.split("/")):
        why = "cannot be a Python class: a part of the name is a keyword of Python"
    raise DefinitionError(_shown(where) if where else shown, 1, f"[{shown}] {why}")


def check_spec(spec: MessageSpec) -> None:
    """Raise DefinitionError unless all names in a message are safe in generated source."""
    check_type_name(spec.full_name)

    seen: set[str] = set()
    for name in (*(field.name for field in spec.fields), *(constant.name for constant in spec.constants)):
        if not _NAME.fullmatch(name):
            raise DefinitionError(spec.full_name, 1, f"[{_shown(name)}] is not a legal field name")
        if python_name(name) in seen:
            raise DefinitionError(spec.full_name, 1, f"[{_shown(name)}] is declared twice in Python")
        seen.add(python_name(name))

    for field in spec.fields:
        if field.type.base not in PRIMITIVES:
            check_type_name(field.type.base, spec.full_name)


def check_types(spec: MessageSpec, lookup: Callable[[str], MessageSpec]) -> list[str]:
    """Return the names of a message and of all types that it uses, dependencies first.

    Raise DefinitionError if a name is not legal, if a message contains itself, or if it is too large or too
    deeply nested for a class. Exceptions in ``lookup`` are passed on.
    """
    specs = {spec.full_name: spec}
    check_spec(spec)
    needed: dict[str, set[str]] = {}
    waiting = [spec.full_name]
    while waiting:
        name = waiting.pop()
        needed[name] = {field.type.base for field in specs[name].fields if not field.type.is_primitive}
        for inner in needed[name] - specs.keys():
            specs[inner] = lookup(inner)
            check_spec(specs[inner])
            waiting.append(inner)

    try:
        order = list(TopologicalSorter(needed).static_order())
    except CycleError as error:
        # graphlib lists a cycle with the first name repeated at the end.
        around = spec.full_name if spec.full_name in error.args[1] else error.args[1][0]
        raise DefinitionError(spec.full_name, 1, f"[{around}] contains itself") from None

    sizes: dict[str, _Size] = {}
    for name in order:
        sizes[name] = _size_of(specs[name], sizes)
        _check_size(spec.full_name, sizes[name])
    if sum(size.fields for size in sizes.values()) > _MAX_FIELDS_IN_ALL:
        raise DefinitionError(
            spec.full_name, 1, f"its types have more than {_MAX_FIELDS_IN_ALL} fields in all"
        )
    return order


class _Size(NamedTuple):
    """The size of an expanded message."""

    fields: int
    levels: int
    bytes: int


def _size_of(spec: MessageSpec, sizes: dict[str, _Size]) -> _Size:
    """Return a message's size, computed from the ``sizes`` of its inner messages."""
    fields, levels, memory = 5, 1, 0
    for field in spec.fields:
        inner = sizes.get(field.type.base)
        each = 1 if field.type.is_bytes else 8
        if inner:
            each = 64 + inner.bytes
            levels = max(levels, inner.levels + 1)
        fields += 1 + (inner.fields if inner else 0)
        # An array without a fixed length is empty in a new message.
        memory += each * (1 if not field.type.is_array else field.type.length or 0)
    return _Size(fields, levels, memory)


def _check_size(where: str, size: _Size) -> None:
    if size.fields > _MAX_FIELDS:
        raise DefinitionError(where, 1, f"it has more than {_MAX_FIELDS} fields, those of its types included")
    if size.levels > MAX_LEVELS:
        raise DefinitionError(where, 1, f"its types are nested deeper than {MAX_LEVELS} levels")
    if size.bytes > _MAX_BYTES:
        raise DefinitionError(where, 1, f"its arrays of fixed length take more than {_MAX_BYTES >> 20} MiB")


def _shown(text: str) -> str:
    """Return text from a peer, shortened and made printable for a one-line error message."""
    text = text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."
    # Escape non-ASCII letters: a letter of another script may look like an ASCII letter.
    return text if text.isascii() and text.isprintable() else ascii(text)[1:-1]
