"""md5sums and full texts: what two sides compare to know that they mean the same type.

Source: http://wiki.ros.org/ROS/Technical%20Overview ("Message serialization and msg MD5 sums").
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable

from minirospy.idl.spec import MessageSpec, ServiceSpec

__all__ = [
    "Lookup",
    "dependencies",
    "full_text",
    "md5_text",
    "message_md5",
    "service_full_text",
    "service_md5",
]

Lookup = Callable[[str], MessageSpec]
"""``pkg/Name`` -> its spec; raises NotFoundError."""

_SEPARATOR = "=" * 80


def md5_text(spec: MessageSpec, lookup: Lookup) -> str:
    """What the md5sum counts: constants, then fields, nested types replaced by their md5sums."""
    lines = [f"{constant.type} {constant.name}={constant.text}" for constant in spec.constants]
    for field in spec.fields:
        if field.type.is_primitive:
            lines.append(f"{field.type} {field.name}")
        else:
            lines.append(f"{message_md5(lookup(field.type.base), lookup)} {field.name}")
    return "\n".join(lines)


def message_md5(spec: MessageSpec, lookup: Lookup) -> str:
    """A message's md5sum."""
    return hashlib.md5(md5_text(spec, lookup).encode(), usedforsecurity=False).hexdigest()


def service_md5(spec: ServiceSpec, lookup: Lookup) -> str:
    """A service's md5sum: over request and response together."""
    text = md5_text(spec.request, lookup) + md5_text(spec.response, lookup)
    return hashlib.md5(text.encode(), usedforsecurity=False).hexdigest()


def dependencies(spec: MessageSpec, lookup: Lookup) -> list[str]:
    """All types that a message needs, each once, a type before those that it needs itself."""
    found: list[str] = []

    def visit(current: MessageSpec) -> None:
        for field in current.fields:
            if not field.type.is_primitive and field.type.base not in found:
                found.append(field.type.base)
                visit(lookup(field.type.base))

    visit(spec)
    return found


def full_text(spec: MessageSpec, lookup: Lookup) -> str:
    """A message's text and that of all types that it needs, each after a line of 80 ``=``."""
    parts = [spec.text]
    parts += [f"{_SEPARATOR}\nMSG: {name}\n{lookup(name).text}" for name in dependencies(spec, lookup)]
    return "\n".join(parts)


def service_full_text(spec: ServiceSpec, lookup: Lookup) -> str:
    """A service's text with its parts, each with what it needs."""
    return f"{full_text(spec.request, lookup)}---\n{full_text(spec.response, lookup)}"
