"""Generate stubs (``__init__.pyi``) with messages' fields and constructor arguments, for editors and type checkers.

A message's constructor accepts all fields in order, or some by name, so each argument has a default. Arrays may be
any collection, such as a tuple or a numpy array. Source: PEP 484, section Stub Files.
"""

from __future__ import annotations

from collections.abc import Sequence

from minirospy.core.idl.source import python_name
from minirospy.core.idl.spec import FieldType, MessageSpec, ServiceSpec

__all__ = ["emit_stub"]

_TYPES = {"bool": "bool", "float32": "float", "float64": "float", "string": "str"}


def emit_stub(messages: Sequence[MessageSpec], services: Sequence[ServiceSpec] = ()) -> str:
    """Generate the stub for a package's msg or srv folder. The module ``emit`` must have checked the names in it."""
    stub = _Stub(messages, has_services=bool(services))
    for message in messages:
        stub.message(message)
    for service in services:
        stub.service(service)
    return stub.text()


class _Stub:
    def __init__(self, messages: Sequence[MessageSpec], *, has_services: bool) -> None:
        self._has_services = has_services
        self._own = set() if has_services else {message.full_name for message in messages}
        self._imported: set[str] = set()
        self._hidden: set[str] = set()
        self._arrays = False
        self._builtins = False
        self._lines: list[str] = []

    def message(self, spec: MessageSpec) -> None:
        """Add a message's class to the stub."""
        fields = [(python_name(field.name), field.type) for field in spec.fields]
        constants = [(python_name(constant.name), constant.type) for constant in spec.constants]
        # Inside the class, a field or a constant hides a type with the same name.
        self._hidden = {name for name, _ in fields} | {name for name, _ in constants}
        lines = [f"    {name}: {self._type(FieldType(type_))}" for name, type_ in constants]
        lines += [f"    {name}: {self._type(type_)}" for name, type_ in fields]
        if fields:
            arguments = "".join(f", {name}: {self._argument(type_)} = ..." for name, type_ in fields)
            lines.append(f"    def __init__(self{arguments}) -> None: ...")
        self._class(f"{spec.name}(_genpy.Message)", lines)

    def service(self, spec: ServiceSpec) -> None:
        """Add a service's class, which combines request and response, to the stub."""
        self._hidden = set()
        self._class(
            spec.name,
            [
                "    _type: _ClassVar[str]",
                "    _md5sum: _ClassVar[str]",
                f"    _request_class: _ClassVar[type[{spec.request.name}]]",
                f"    _response_class: _ClassVar[type[{spec.response.name}]]",
            ],
        )

    def text(self) -> str:
        """Return the complete stub's text."""
        return "\n".join(
            [
                *(["import builtins as _builtins"] if self._builtins else []),
                *(["from collections.abc import Collection as _Collection"] if self._arrays else []),
                *(["from typing import ClassVar as _ClassVar"] if self._has_services else []),
                "",
                "import genpy as _genpy",
                *(f"from {package} import msg as _{package}" for package in sorted(self._imported)),
                *self._lines,
                "",
            ]
        )

    def _class(self, head: str, lines: list[str]) -> None:
        self._lines += ["", f"class {head}:", *(lines or ["    ..."])]

    def _type(self, type_: FieldType) -> str:
        if type_.is_bytes:
            return self._builtin("bytes")
        one = self._one(type_)
        return f"{self._builtin('list')}[{one}]" if type_.is_array else one

    def _argument(self, type_: FieldType) -> str:
        """Return the type of a field's constructor argument."""
        if not type_.is_array:
            return self._one(type_)
        self._arrays = True
        return f"_Collection[{self._one(type_)}]"

    def _one(self, type_: FieldType) -> str:
        if type_.base in ("time", "duration"):
            return f"_genpy.{type_.base.capitalize()}"
        if type_.is_primitive:
            return self._builtin(_TYPES.get(type_.base, "int"))
        package, _, name = type_.base.partition("/")
        if type_.base in self._own and name not in self._hidden:
            return name
        self._imported.add(package)
        return f"_{package}.{name}"

    def _builtin(self, name: str) -> str:
        if name not in self._hidden:
            return name
        self._builtins = True
        return f"_builtins.{name}"
