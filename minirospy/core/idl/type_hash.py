"""The hash of a type's fields (RIHS01). ROS 2 uses it to distinguish definitions with the same name. Pure.

Source: https://github.com/ros-infrastructure/rep/pull/381 (REP 2016), and rosidl's type description.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping

__all__ = ["Fields", "type_hash"]

Fields = Mapping[str, str]
"""Dict from field name to type: ``uint8``, ``double[3]``, ``sequence<std_msgs/Header>``, ``sequence<float64, 3>``."""

_IDS = {
    "int8": 2, "uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8, "uint64": 9, "float32": 10,
    "float64": 11, "float": 10, "double": 11, "char": 3, "bool": 15, "boolean": 15, "byte": 16, "octet": 16, "string": 17,
}  # fmt: skip
_ARRAY, _BOUNDED, _UNBOUNDED = 48, 96, 144
_EMPTY = {"structure_needs_at_least_one_member": "uint8"}


def type_hash(name: str, fields: Callable[[str], Fields]) -> str:
    """Return the hash of a type: ``RIHS01_`` and 64 digits.

    ``name`` and the types of fields are ``pkg/Name`` for messages, else ``pkg/srv/Name_Request`` and similar; ``fields``
    returns a type's fields; its exceptions are passed on. Raise ValueError if a field's type cannot occur in messages.
    """
    known: dict[str, object] = {}

    def describe(name: str) -> None:
        whole = _whole(name)
        if whole in known:
            return
        known[whole] = None  # marks the type as in progress, to detect a type that contains itself
        found = []
        for field, text in (fields(name) or _EMPTY).items():
            id, capacity, nested = _described(text)
            if nested:
                describe(nested)
            found.append(
                {
                    "name": field,
                    "type": {
                        "type_id": id,
                        "capacity": capacity,
                        "string_capacity": 0,
                        "nested_type_name": _whole(nested) if nested else "",
                    },
                }
            )
        known[whole] = {"type_name": whole, "fields": found}

    describe(name)
    own = known.pop(_whole(name))
    description = {
        "type_description": own,
        "referenced_type_descriptions": [known[each] for each in sorted(known)],
    }
    return "RIHS01_" + hashlib.sha256(json.dumps(description).encode()).hexdigest()


def _described(text: str) -> tuple[int, int, str]:
    """Return a field's type as (type number, maximum number of elements, message name); the name is "" if it is no message."""
    added, capacity, base = 0, 0, text
    if text.startswith("sequence<"):
        base, _, bound = text[len("sequence<") : -1].partition(",")
        capacity = int(bound or 0)
        added = _BOUNDED if capacity else _UNBOUNDED
    elif text.endswith("]"):
        base, _, bound = text[:-1].partition("[")
        capacity, added = int(bound), _ARRAY
    if "/" in base:
        return added + 1, capacity, base
    if base not in _IDS:
        raise ValueError(f"messages have no type [{text}]")
    return added + _IDS[base], capacity, ""


def _whole(name: str) -> str:
    return name if name.count("/") == 2 else name.replace("/", "/msg/")
