"""md5sums and full texts, which two nodes compare to check that they use the same type.

Source: http://wiki.ros.org/ROS/Technical%20Overview ("Message serialization and msg MD5 sums").
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from minirospy.base.errors import DefinitionError
from minirospy.core.idl.spec import MessageSpec, ServiceSpec
from minirospy.core.idl.validate import MAX_LEVELS

try:
    # Use the module that hashlib uses without OpenSSL: loading OpenSSL takes 2 ms, and in FIPS mode OpenSSL refuses MD5.
    from _md5 import md5  # type: ignore[import-not-found]
except ImportError:
    from hashlib import md5

__all__ = [
    "Lookup",
    "dependencies",
    "full_text",
    "joined_texts",
    "md5_text",
    "message_md5",
    "service_md5",
]

Lookup = Callable[[str], MessageSpec]  # maps ``pkg/Name`` to its spec; raises NotFoundError

_SEPARATOR = "=" * 80


def md5_text(spec: MessageSpec, lookup: Lookup) -> str:
    """Return the text from which the md5sum is computed: constants, then fields, with nested types replaced by their md5sums.

    Raise DefinitionError if a message contains itself.
    """
    return _md5_text(spec, lookup, ())


def message_md5(spec: MessageSpec, lookup: Lookup) -> str:
    """Return a message's md5sum. Raise DefinitionError if it contains itself."""
    return _md5(md5_text(spec, lookup))


def service_md5(spec: ServiceSpec, lookup: Lookup) -> str:
    """Return a service's md5sum, computed over request and response together."""
    return _md5(md5_text(spec.request, lookup) + md5_text(spec.response, lookup))


def dependencies(spec: MessageSpec, lookup: Lookup) -> list[str]:
    """Return all types that a message uses, directly or in nested messages. Each type is listed once, depth first."""
    found: dict[str, None] = {}

    def visit(current: MessageSpec) -> None:
        for field in current.fields:
            if not field.type.is_primitive and field.type.base not in found:
                found[field.type.base] = None
                visit(lookup(field.type.base))

    visit(spec)
    return list(found)


def full_text(spec: MessageSpec, lookup: Lookup) -> str:
    """Return a message's full text: its definition, and those of all types that it uses, each after a line of 80 ``=``."""
    return joined_texts(spec.text, ((name, lookup(name).text) for name in dependencies(spec, lookup)))


def joined_texts(text: str, needed: Iterable[tuple[str, str]]) -> str:
    """Return a text followed by the name and text of each type that it uses."""
    return "\n".join((text, *(f"{_SEPARATOR}\nMSG: {name}\n{inner}" for name, inner in needed)))


def _md5(text: str) -> str:
    digest: str = md5(text.encode(), usedforsecurity=False).hexdigest()
    return digest


def _md5_text(
    spec: MessageSpec, lookup: Lookup, around: tuple[str, ...], known: dict[str, str] | None = None
) -> str:
    """Return the text for the md5sum.

    ``around`` are the messages that contain this one, ``known`` the md5sums computed so far.
    """
    if spec.full_name in around:
        raise DefinitionError(around[0], 1, f"[{spec.full_name}] contains itself")
    if len(around) > MAX_LEVELS:
        raise DefinitionError(around[0], 1, f"its types are nested deeper than {MAX_LEVELS} levels")
    around += (spec.full_name,)
    known = {} if known is None else known
    lines = [f"{constant.type} {constant.name}={constant.text}" for constant in spec.constants]

    for field in spec.fields:
        type_ = str(field.type)
        if not field.type.is_primitive:
            base = field.type.base
            if base not in known:
                known[base] = _md5(_md5_text(lookup(base), lookup, around, known))
            type_ = known[base]
        lines.append(f"{type_} {field.name}")

    return "\n".join(lines)
