"""Generate Python source from specs: one readable module per message or service.

A generated module imports only public names from ``genpy``, so that it also works with real ROS. The code for
``serialize`` and ``deserialize`` is generated in ``codec``.

Definitions may be untrusted: names are emitted only after ``validate`` has checked them, all other text through
``repr``. Every message used in the source is checked by :func:`_checked`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from minirospy.core.idl.codec import keeps_buffer, lazy_arrays, write_deserialize, write_serialize
from minirospy.core.idl.digest import Lookup, full_text, message_md5, service_md5
from minirospy.core.idl.source import Source, python_name
from minirospy.core.idl.spec import Field, FieldType, MessageSpec, ServiceSpec
from minirospy.core.idl.validate import check_spec, check_type_name, check_types

__all__ = ["ClassSource", "emit_class", "emit_message", "emit_package", "emit_service", "python_name"]

_PYTHON_TYPE = {
    "bool": "bool",
    "float32": "float",
    "float64": "float",
    "string": "str",
    "time": "genpy.Time",
    "duration": "genpy.Duration",
}

_NATIVE = [
    "# struct is faster in the machine's own order, where that is also the order of ROS.",
    '_NATIVE = "@" if sys.byteorder == "little" else "<"',
]
_HELPERS = {
    "_new": ["_new: Any = object.__new__"],
    "_Time": ["_Time = genpy.Time"],
    "_Duration": ["_Duration = genpy.Duration"],
    "_numbers": [
        "",
        "",
        "@lru_cache(maxsize=256)",
        "def _numbers(letter: str, count: int, order: str = _NATIVE) -> struct.Struct:",
        '    return struct.Struct(f"{order}{count}{letter}")',
    ],
    "_packed": [
        "",
        "",
        "def _packed(letter: str, values: Any) -> bytes:",
        '    """The length and the bytes of an array of numbers."""',
        '    if hasattr(values, "ravel"):',
        "        # One of numpy, of any shape.",
        "        values = values.ravel()",
        '        if values.dtype == f"<{letter}":',
        "            return _struct_I.pack(len(values)) + bytes(values.tobytes())",
        "        values = values.tolist()",
        "    # In the machine's own order a number that is too large for 32 bits would be written as infinity.",
        '    numbers = _numbers(letter, len(values), "<" if letter == "f" else _NATIVE)',
        "    return _struct_I.pack(len(values)) + numbers.pack(*values)",
    ],
    "_flat": [
        "",
        "",
        "def _flat(name: str, values: Any, count: int) -> Any:",
        '    """The numbers of an array of more dimensions, such as a 6x6 matrix of numpy, row by row."""',
        '    if getattr(values, "size", 0) == count:',
        "        return list(values.flat)",
        '    raise ValueError(f"{name} has {len(values)} values instead of {count}")',
    ],
    "_octets": [
        "",
        "",
        "def _octets(values: Any) -> bytes:",
        '    """The bytes of a uint8[]: a list of numbers, or what holds bytes, such as an image of numpy."""',
        "    if isinstance(values, (list, tuple)):",
        "        return bytes(values)",
        "    view = memoryview(values)",
        "    if view.itemsize != 1:",
        '        raise TypeError(f"a uint8[] holds bytes, not items of {view.itemsize} bytes")',
        "    return view.tobytes()",
    ],
    "_Arrays": [
        "",
        "",
        "class _Arrays(genpy.Message):",
        '    """Keeps arrays of numbers as the bytes that came, until one is read for the first time."""',
        "",
        '    __slots__ = ["_raw"]',
        "    _letters: dict[str, str] = {}",
        "    _raw: dict[str, bytes]",
        "",
        "    if not TYPE_CHECKING:",
        "",
        "        def __getattr__(self, name):",
        "            if name not in self._letters:",
        '                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")',
        "            raw, letter = self._raw[name], self._letters[name]",
        "            value = _numbers(letter, len(raw) // struct.calcsize(letter)).unpack(raw)",
        "            setattr(self, name, value)",
        "            return value",
    ],
}
"""Helper functions in a module: name -> lines, in the order in which they are emitted."""


def emit_message(spec: MessageSpec, lookup: Lookup) -> str:
    """Return a message's module. Raise DefinitionError if a name is not legal in Python."""
    check_types(spec, lookup)
    return _Module(_checked(lookup)).source([spec], None, f"{spec.full_name}.msg")


def emit_class(spec: MessageSpec, lookup: Lookup) -> ClassSource:
    """Return the source of a message's class; its globals must contain the classes of its fields.

    Raise DefinitionError if a name is not legal in Python.
    """
    check_types(spec, lookup)
    module = _Module(_checked(lookup), imports=False)
    source = module.source([spec], None, f"{spec.full_name}.msg")
    return ClassSource(source, module.classes)


def emit_service(spec: ServiceSpec, lookup: Lookup) -> str:
    """Return a service's module: request, response, and the class that combines them.

    Raise DefinitionError if a name is not legal in Python.
    """
    check_type_name(spec.full_name)
    for message in (spec.request, spec.response):
        check_types(message, lookup)
    return _Module(_checked(lookup)).source([spec.request, spec.response], spec, f"{spec.full_name}.srv")


def emit_package(package: str, kind: str, names: Sequence[str], parts: Sequence[str] = ("",)) -> str:
    """Return the ``__init__`` for a package's msg or srv folder. Module ``_Name`` has ``Name`` with each suffix in ``parts``.

    Each module is loaded when one of its names is first used. Raise DefinitionError if a name is not legal in Python.
    """
    for name in names:
        check_type_name(f"{package}/{name}")

    lines = [
        f'"""{package}.{kind}: generated from the definitions; each class is loaded when it is first used."""',
        "",
        "import importlib",
        "from typing import Any",
        "",
        # Use a compact format, because a wheel has hundreds of these.
        f"_NAMES = {' '.join(names)!r}.split()",
        f'_MODULES = {{name + part: "_" + name for name in _NAMES for part in {tuple(parts)!r}}}',
        "__all__ = sorted(_MODULES)",
        "",
        "",
        "def __getattr__(name: str) -> Any:",
        "    if name not in _MODULES:",
        '        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")',
        '    value = getattr(importlib.import_module(f"{__name__}.{_MODULES[name]}"), name)',
        "    globals()[name] = value",
        "    return value",
        "",
        "",
        "def __dir__() -> list[str]:",
        "    return __all__",
        "",
    ]
    return "\n".join(lines)


class ClassSource(NamedTuple):
    """The source of a class, and the classes that its globals must contain."""

    source: str
    classes: dict[str, str]  # ``pkg/Name`` -> the global name of that class in the source


def _checked(lookup: Lookup) -> Lookup:
    """Return ``lookup`` with :func:`check_spec` applied to its results, once per message."""
    seen: dict[str, MessageSpec] = {}

    def checked(name: str) -> MessageSpec:
        if name not in seen:
            check_type_name(name)
            spec = lookup(name)
            check_spec(spec)
            seen[name] = spec
        return seen[name]

    return checked


class _Module:
    """Generates one module; without ``imports``, its globals must already contain the classes of its fields."""

    def __init__(self, lookup: Lookup, *, imports: bool = True) -> None:
        self._lookup = lookup
        self._imports = imports
        self._source = Source()

    @property
    def classes(self) -> dict[str, str]:
        """The classes of the fields: ``pkg/Name`` -> name in the module."""
        return dict(self._source.classes)

    def source(self, messages: list[MessageSpec], service: ServiceSpec | None, origin: str) -> str:
        for message in messages:
            self._message(message)
        if service:
            self._service(service)
        return "\n".join(
            [*self._head(origin, {message.full_name for message in messages}), *self._source.lines, ""]
        )

    def _head(self, origin: str, own: set[str]) -> list[str]:
        """Return the lines before the classes: imports, compiled structs, helpers."""
        helpers = self._source.helpers
        if "_packed" in helpers:
            self._source.struct("I")
        structs = dict(sorted(self._source.structs.items()))
        native = {letters for letters in structs if _is_even(letters)}
        if helpers & {"_packed", "_Arrays"}:
            helpers.add("_numbers")
        if native or "_numbers" in helpers:
            helpers.add("_NATIVE")
        lines = [
            f'"""Generated by minirospy from {origin}. Do not edit."""',
            "",
            "from __future__ import annotations",
            "",
            "import struct",
            *(["import sys"] if "_NATIVE" in helpers else []),
            *(["from functools import lru_cache"] if "_numbers" in helpers else []),
            f"from typing import {'TYPE_CHECKING, ' if '_Arrays' in helpers else ''}Any",
            "",
            "import genpy",
        ]

        for full_name, alias in sorted(self._source.classes.items()):
            package, name = full_name.split("/")
            if self._imports and full_name not in own:
                lines.append(f"from {package}.msg._{name} import {name} as {alias}")

        lines.append("")
        if "_NATIVE" in helpers:
            lines += _NATIVE
        for letters, alias in structs.items():
            form = f'f"{{_NATIVE}}{letters}"' if letters in native else f'"<{letters}"'
            lines.append(f"{alias} = struct.Struct({form})")

        for name, helper in _HELPERS.items():
            if name in helpers:
                lines += helper

        return lines

    def _message(self, spec: MessageSpec) -> None:
        line = self._source.line
        names = [python_name(field.name) for field in spec.fields]
        lazy = lazy_arrays(spec)
        base = self._source.use("_Arrays") if lazy else "genpy.Message"
        line()
        line()

        with self._source.block(f"class {spec.name}({base}):"):
            line(f'"""{spec.full_name}"""')
            line()
            line(f"_md5sum = {message_md5(spec, self._lookup)!r}")
            line(f"_type = {spec.full_name!r}")
            line(f"_has_header = {spec.has_header}")
            line(f"_full_text = {full_text(spec, self._lookup)!r}")
            line(f"_takes_memoryview = {keeps_buffer(spec, self._lookup)}")
            if lazy:
                line(f"_letters = {lazy!r}")
            for constant in spec.constants:
                line(f"{python_name(constant.name)} = {_constant(constant.value)}")
            line(f"__slots__ = {names!r}")
            line(f"_slot_types = {[str(field.type) for field in spec.fields]!r}")
            for name, field in zip(names, spec.fields, strict=True):
                line(f"{name}: {self._annotation(field.type)}")
            line()
            self._init(spec.fields, names)
            line()
            write_serialize(self._source, spec, self._lookup)
            line()
            write_deserialize(self._source, spec, self._lookup)

    def _service(self, spec: ServiceSpec) -> None:
        line = self._source.line
        line()
        line()
        with self._source.block(f"class {spec.name}:"):
            line(f'"""{spec.full_name}"""')
            line()
            line(f"_type = {spec.full_name!r}")
            line(f"_md5sum = {service_md5(spec, self._lookup)!r}")
            line(f"_request_class = {spec.request.name}")
            line(f"_response_class = {spec.response.name}")

    def _annotation(self, type_: FieldType) -> str:
        if type_.is_bytes:
            return "bytes"
        base = _PYTHON_TYPE.get(type_.base) or (
            "int" if type_.is_primitive else self._source.class_(type_.base)
        )
        return f"list[{base}]" if type_.is_array else base

    def _init(self, fields: tuple[Field, ...], names: list[str]) -> None:
        with self._source.block("def __init__(self, *args: Any, **kwds: Any) -> None:"):
            self._source.line('"""All fields in order, or some by name."""')
            with self._source.block("if args or kwds:"):
                self._source.line("super().__init__(*args, **kwds)")
                for name, field in zip(names, fields, strict=True):
                    with self._source.block(f"if self.{name} is None:"):
                        self._source.line(f"self.{name} = {self._default(field.type)}")
            if names:
                with self._source.block("else:"):
                    for name, field in zip(names, fields, strict=True):
                        self._source.line(f"self.{name} = {self._default(field.type)}")

    def _default(self, type_: FieldType) -> str:
        if type_.is_bytes:
            return f"bytes({type_.length})" if type_.length else 'b""'
        if not type_.is_primitive:
            one = self._source.class_(type_.base) + "()"
        elif type_.base in ("time", "duration"):
            one = _PYTHON_TYPE[type_.base] + "()"
        else:
            one = {"bool": "False", "float32": "0.0", "float64": "0.0", "string": '""'}.get(type_.base, "0")
        if not type_.is_array:
            return one
        if not type_.length:
            return "[]"
        if one.endswith(")"):
            return f"[{one} for _ in range({type_.length})]"
        return f"[{one}] * {type_.length}"


def _is_even(letters: str) -> bool:
    """Return whether ``struct`` adds no padding between these format characters, some of which are floats.

    Return False for 32-bit floats: in native byte order a value that is too large would become infinity and not raise
    OverflowError.
    """
    kinds = {letter for letter in letters if letter.isalpha()}
    return "d" in kinds and kinds <= set("dqQ")


def _constant(value: object) -> str:
    if isinstance(value, float) and not math.isfinite(value):
        return f"float({str(value)!r})"
    return repr(value)
