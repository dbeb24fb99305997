"""The text of `rosmsg show`: fields and constants, nested types unfolded and indented. From generated classes.

Source: http://wiki.ros.org/rosmsg.
"""

from __future__ import annotations

from minirospy.errors import DefinitionError
from minirospy.idl.load import message_class, service_class, specs_of_text
from minirospy.idl.spec import MessageSpec

__all__ = ["message_text", "service_text"]


def message_text(type_: str) -> str:
    """A message's fields, a line each. Raises NotFoundError."""
    return _unfolded(message_class(type_))


def service_text(type_: str) -> str:
    """A service's request and response, with ``---`` between. Raises NotFoundError."""
    found = service_class(type_)
    return f"{_unfolded(found._request_class)}---\n{_unfolded(found._response_class)}"


def _unfolded(data_class: type) -> str:
    full_name: str = data_class._type  # type: ignore[attr-defined]
    specs = specs_of_text(full_name, data_class._full_text)  # type: ignore[attr-defined]
    lines: list[str] = []

    def walk(spec: MessageSpec, indent: str) -> None:
        lines.extend(f"{indent}{c.type} {c.name}={c.value}" for c in spec.constants)
        for field in spec.fields:
            lines.append(f"{indent}{field.type} {field.name}")
            if not field.type.is_primitive:
                inner = specs.get(field.type.base)
                if inner is None:
                    raise DefinitionError(full_name, 1, f"the full text lacks [{field.type.base}]")
                walk(inner, indent + "  ")

    walk(specs[full_name], "")
    return "".join(f"{line}\n" for line in lines)
