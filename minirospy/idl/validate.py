"""What may become Python source: the names of types and fields, checked before anything is generated.

A definition may come from a file or from any publisher's connection header; its names are written into source that is
executed. So they must match ROS's grammar (http://wiki.ros.org/Names, http://wiki.ros.org/msg), which leaves no
character that could end a name or a text in Python.
"""

from __future__ import annotations

import keyword
import re

from minirospy.errors import DefinitionError
from minirospy.idl.source import python_name
from minirospy.idl.spec import PRIMITIVES, MessageSpec

__all__ = ["check_spec", "check_type_name", "is_type_name"]

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_SHOWN = 80


def is_type_name(name: str) -> bool:
    """Return whether a text is ``pkg/Name`` by ROS's grammar, and neither part is a Python keyword."""
    package, slash, short = name.partition("/")
    return bool(slash) and all(
        _NAME.fullmatch(part) and not keyword.iskeyword(part) for part in (package, short)
    )


def check_type_name(name: str, where: str = "") -> None:
    """Raise DefinitionError unless :func:`is_type_name`; ``where`` names the text that has it."""
    if is_type_name(name):
        return
    shown = _shown(name)
    why = "is not of the form package/Type in letters, digits and underscores"
    if any(keyword.iskeyword(part) for part in name.split("/")):
        why = "cannot be a Python class: a part of the name is a keyword of Python"
    raise DefinitionError(_shown(where) if where else shown, 1, f"[{shown}] {why}")


def check_spec(spec: MessageSpec) -> None:
    """Raise DefinitionError unless all names of a message are fit for generated source."""
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


def _shown(text: str) -> str:
    """Return a text from a peer for an error's line: printable, and not endless."""
    text = text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."
    # A letter of another script may look like one of ours.
    return text if text.isascii() and text.isprintable() else ascii(text)[1:-1]
