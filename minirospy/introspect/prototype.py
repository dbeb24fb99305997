"""A message of default values as YAML: what TAB puts after `rostopic pub TOPIC TYPE`, and `rosmsg-proto` prints."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, NamedTuple

from minirospy.idl.load import Catalogue
from minirospy.idl.spec import FieldType, MessageSpec

__all__ = ["prototype"]

_WIDE = 5


def prototype(
    spec: MessageSpec, catalogue: Catalogue, *, without: Collection[str] = (), empty_arrays: bool = False
) -> str:
    """A message of default values as YAML, as `rosmsg-proto` writes it: to be changed and published.

    An array of no fixed length has one element, which shows what its elements are, or with ``empty_arrays``
    none. ``without``: names of fields to leave out, also of inner messages.
    """
    return "\n".join(_yaml(_Defaults(catalogue, without, empty_arrays).of(spec), tight=False))


class _Defaults(NamedTuple):
    catalogue: Catalogue
    without: Collection[str]
    empty_arrays: bool

    def of(self, spec: MessageSpec) -> dict[str, Any]:
        """The values of a message's fields."""
        fields = (field for field in spec.fields if field.name not in self.without)
        return {field.name: self._value(field.type) for field in fields}

    def _value(self, type_: FieldType) -> Any:
        if type_.is_array:
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


def _yaml(value: Any, *, tight: bool) -> list[str]:
    """The lines of a value. Of a wide one, all that holds no further braces stands on one line: so it fits the screen."""
    inner = list(value.values() if isinstance(value, dict) else value if isinstance(value, list) else ())
    tight = tight or (isinstance(value, dict) and max(len(inner), *map(_length, inner), 0) >= _WIDE)
    if not inner or (tight and not any(isinstance(each, dict | list) for each in inner)):
        return [_yaml_flow(value)]
    lines: list[str] = []
    for key, child in value.items() if isinstance(value, dict) else enumerate(value):
        first, *rest = _yaml(child, tight=tight)
        if isinstance(value, list):
            lines += [f"- {first}", *(f"  {line}" for line in rest)]
        elif rest or (isinstance(child, dict | list) and first[0] not in "{["):
            indent = "  " if isinstance(child, dict) else ""
            lines += [f"{key}:", *(indent + line for line in (first, *rest))]
        else:
            lines.append(f"{key}: {first}")
    return lines


def _yaml_flow(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_yaml_flow(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_yaml_flow, value)) + "]"
    return "''" if value == "" else str(value).lower()


def _length(value: Any) -> int:
    return len(value) if isinstance(value, list) else 0
