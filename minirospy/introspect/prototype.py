"""Format a message of default values as YAML, for tab completion after `rostopic pub TOPIC TYPE` and for `rosmsg-proto`."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import NamedTuple

from minirospy.core.idl.load import Catalogue
from minirospy.core.idl.spec import FieldType, MessageSpec

__all__ = ["prototype"]

_WIDE = 5
_COLUMNS = 80
_NO_BYTES = '!!binary ""'  # YAML for an empty uint8[], which is bytes in Python, not a list of numbers


def prototype(
    spec: MessageSpec, catalogue: Catalogue, *, without: Collection[str] = (), empty_arrays: bool = False
) -> str:
    """Return the YAML of a message with default values, like `rosmsg-proto`, for the user to edit and publish.

    A variable-length array has one element, as an example, or none with ``empty_arrays``. ``without``: names of fields to
    leave out, including those of inner messages.
    """
    lines = _Yaml().lines(_Defaults(catalogue, without, empty_arrays).of(spec))
    return "\n".join(map(_wrapped, lines))


class _Defaults(NamedTuple):
    catalogue: Catalogue
    without: Collection[str]
    empty_arrays: bool

    def of(self, spec: MessageSpec) -> dict[str, object]:
        """Return the default values of a message type's fields, keyed by field name."""
        fields = (field for field in spec.fields if field.name not in self.without)
        return {field.name: self._value(field.type) for field in fields}

    def _value(self, type_: FieldType) -> object:
        if type_.is_array:
            if type_.length is None and type_.base in ("uint8", "char"):
                return b""
            if type_.length is None and self.empty_arrays:
                return []
            if type_.length is None and type_.base in ("float32", "float64"):
                return [0]
            single = type_._replace(is_array=False, length=None)
            return [self._value(single)] * (1 if type_.length is None else type_.length)
        if not type_.is_primitive:
            return self.of(self.catalogue.message(type_.base))
        if type_.base in ("time", "duration"):
            return {"secs": 0, "nsecs": 0}
        return {"string": "", "bool": False, "float32": 0.0, "float64": 0.0}.get(type_.base, 0)


class _Yaml:
    """Formats values as YAML.

    After the first wide value, it writes innermost lists and dictionaries on one line, as `rosmsg-proto` does.
    """

    def __init__(self) -> None:
        self._tight = False

    def lines(self, value: object) -> list[str]:
        """Return the YAML lines for a value, with nested values indented."""
        inner = list(value.values() if isinstance(value, dict) else value if isinstance(value, list) else ())
        if isinstance(value, dict) and max(len(inner), *map(_length, inner), 0) >= _WIDE:
            self._tight = True
        if not inner or (self._tight and not any(isinstance(each, dict | list) for each in inner)):
            return [_flow(value)]
        lines: list[str] = []
        for key, child in value.items() if isinstance(value, dict) else enumerate(inner):
            first, *rest = self.lines(child)
            if isinstance(value, list):
                lines += [f"- {first}", *(f"  {line}" for line in rest)]
            elif rest or (isinstance(child, dict | list) and first[0] not in "{["):
                indent = "  " if isinstance(child, dict) else ""
                lines += [f"{key}:", *(indent + line for line in (first, *rest))]
            else:
                lines.append(f"{key}: {first}")
        return lines


def _flow(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_flow, value)) + "]"
    if value == b"":
        return _NO_BYTES
    return "''" if value == "" else str(value).lower()


def _wrapped(line: str) -> str:
    """Wrap a line that is too wide. Like YAML libraries, break before the first word that starts beyond the last column."""
    if len(line) <= _COLUMNS:
        return line
    # Before a key, a dash counts as indentation; before a brace, it does not.
    start = re.match(r" *(?:- (?=\w))?", line)
    indent = start.end() if start else 0
    column, depth, text = 0, 0, []
    for word in line.split(" "):
        if column > _COLUMNS:
            text.append("\n" + " " * (indent + 2 * depth))
            column = indent + 2 * depth
        elif text:
            text.append(" ")
            column += 1
        text.append(word)
        column += len(word)
        depth += word.count("[") + word.count("{") - word.count("]") - word.count("}")
    return "".join(text)


def _length(value: object) -> int:
    return len(value) if isinstance(value, list) else 0
