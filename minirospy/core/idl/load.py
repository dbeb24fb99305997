"""Find, compile and import message definitions and classes.

A catalogue reads ``<root>/<pkg>/{msg,srv,action}``; classes are imported from the generated modules, or created from
a full text at run time.
"""

from __future__ import annotations

import contextlib
import importlib.machinery
import importlib.util
import linecache
import os
import struct
import sys
import types
import weakref
import zlib
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from minirospy.base.errors import DefinitionError, NotFoundError
from minirospy.core.idl.spec import PRIMITIVES, ActionSpec, MessageSpec, ServiceSpec
from minirospy.core.idl.validate import MAX_TEXT, check_type_name, check_types, is_type_name

if TYPE_CHECKING:
    from minirospy.core.idl.emit import ClassSource
    from minirospy.core.idl.protocols import Message, ServiceClass

__all__ = [
    "Catalogue",
    "checked_text",
    "class_from_text",
    "classes_from_text",
    "compile_package",
    "get_message_class",
    "get_service_class",
    "message_class",
    "read_definition",
    "service_class",
    "specs_of_text",
    "top_module",
    "write_if_changed",
    "write_package",
]

_SEPARATOR = "=" * 80


class Catalogue:
    """The definitions in ``packages``, a dict from package name to folder. Specs are parsed on first use and cached.

    A package's definitions are the files in its folders msg, srv and action, or, if ``definitions`` contains the package,
    only the files listed there.
    """

    def __init__(
        self, packages: Mapping[str, Path], definitions: Mapping[str, Iterable[Path]] | None = None
    ) -> None:
        self.packages = packages
        # Keyed by package and kind: a package may have hundreds of definitions, which are looked up by name.
        self._definitions: dict[str, dict[str, dict[str, Path]]] = {}
        for package, files in (definitions or {}).items():
            kinds = self._definitions[package] = {"msg": {}, "srv": {}, "action": {}}
            for path in sorted(files):
                kinds[path.suffix[1:]][path.stem] = path
        self._specs: dict[str, MessageSpec] = {}

    @classmethod
    def below(cls, *roots: Path) -> Catalogue:
        """Return a catalogue of the packages in ``roots`` that have definitions; an earlier root hides later ones."""
        found: dict[str, Path] = {}
        for root in roots:
            for folder in sorted(root.iterdir()) if root.is_dir() else []:
                if any((folder / kind).is_dir() for kind in ("msg", "srv", "action")):
                    found.setdefault(folder.name, folder)
        return cls(found)

    def files(self, package: str, kind: str) -> Mapping[str, Path]:
        """Return a package's definitions of one kind (msg, srv, action), as a dict from name to file."""
        if package in self._definitions:
            return self._definitions[package][kind]
        return {path.stem: path for path in sorted((self.packages[package] / kind).glob(f"*.{kind}"))}

    def message(self, full_name: str) -> MessageSpec:
        """Return the spec of ``pkg/Name``.

        Raise NotFoundError if no file defines it, DefinitionError if its definition is invalid.
        """
        if full_name not in self._specs:
            self._specs[full_name] = self._parse_message(full_name)
        return self._specs[full_name]

    def messages(self, package: str) -> list[MessageSpec]:
        """Return all messages in a package, sorted by name, including those of its actions."""
        names = {*self.files(package, "msg")}
        for action in self.actions(package):
            names |= {message.name for message in action.messages}
        return [self.message(f"{package}/{name}") for name in sorted(names)]

    def services(self, package: str) -> list[ServiceSpec]:
        """Return all services in a package, as a dict keyed by name."""
        return [self.service(f"{package}/{name}") for name in self.files(package, "srv")]

    def service(self, full_name: str) -> ServiceSpec:
        """Return the spec of the service ``pkg/Name``.

        Raise KeyError if no file defines it, DefinitionError if its definition is invalid.
        """
        from minirospy.core.idl.parse import parse_service

        package, _, name = full_name.partition("/")
        path = self.files(package, "srv")[name]
        return parse_service(read_definition(path), package, name, str(path))

    def actions(self, package: str) -> list[ActionSpec]:
        """Return all actions in a package, as a dict keyed by name."""
        return [self.action(f"{package}/{name}") for name in self.files(package, "action")]

    def action(self, full_name: str) -> ActionSpec:
        """Return the spec of the action ``pkg/Name``.

        Raise KeyError if no file defines it, DefinitionError if its definition is invalid.
        """
        from minirospy.core.idl.parse import parse_action

        package, _, name = full_name.partition("/")
        path = self.files(package, "action")[name]
        action = parse_action(read_definition(path), package, name, str(path))
        for message in action.messages:
            self._specs.setdefault(message.full_name, message)
        return action

    def _parse_message(self, full_name: str) -> MessageSpec:
        from minirospy.core.idl.parse import parse_message

        package, _, name = full_name.partition("/")
        if package not in self.packages:
            raise NotFoundError("package", package, self.packages, f"it should define [{full_name}]")
        files = self.files(package, "msg")
        if name in files:
            return parse_message(read_definition(files[name]), package, name, str(files[name]))
        self.actions(package)
        if full_name in self._specs:
            return self._specs[full_name]
        if name in _OF_OTHER_LANGUAGES and name not in files:
            raise NotFoundError("message type", full_name, hint=f"did you mean {_OF_OTHER_LANGUAGES[name]}?")
        import difflib  # imported here, because only the error needs it

        near = difflib.get_close_matches(name, [*files, *PRIMITIVES], n=1, cutoff=0.7)
        if near and near[0] in PRIMITIVES:
            raise NotFoundError("message type", full_name, hint=f"did you mean {near[0]}?")
        elsewhere = [each for each in self._packages_with(name) if each != package]
        if elsewhere:
            hint = f"did you mean {' or '.join(f'{each}/{name}' for each in elsewhere[:3])}?"
            raise NotFoundError("message type", full_name, hint=hint)
        raise NotFoundError("message type", full_name, [f"{package}/{other}" for other in files])

    def _packages_with(self, name: str) -> list[str]:
        """Return the packages that define a message of this name, with ROS's own packages first."""
        from minirospy.core.idl.own_packages import COMPILED_AHEAD

        found = [package for package in self.packages if name in self.files(package, "msg")]
        return sorted(found, key=lambda package: (package not in COMPILED_AHEAD, package))


_OF_OTHER_LANGUAGES = {
    "int": "int32",
    "long": "int64",
    "short": "int16",
    "unsigned": "uint32",
    "uint": "uint32",
    "float": "float32 or float64",
    "double": "float64",
    "str": "string",
    "boolean": "bool",
}  # dict from the name of a type in C++ or Python to the ROS type


def read_definition(path: Path) -> str:
    """Read a definition file. Raise DefinitionError if that fails."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise DefinitionError(str(path), 1, f"cannot be read: {error}") from error


def compile_package(catalogue: Catalogue, package: str) -> dict[str, str]:
    """Compile a package's definitions to Python; return a dict from file path in the package (``msg/_Bool.py``) to source text.

    The result includes stubs with the types of fields and constructors, and the empty ``py.typed``, which makes mypy use
    them (PEP 561). Raise DefinitionError if a definition is invalid, NotFoundError if one uses a type that does not exist.
    """
    from minirospy.core.idl.emit import emit_message, emit_package, emit_service
    from minirospy.core.idl.stubs import emit_stub

    messages, services = catalogue.messages(package), catalogue.services(package)
    sources = {"py.typed": ""}
    for message in messages:
        sources[f"msg/_{message.name}.py"] = emit_message(message, catalogue.message)
    for service in services:
        sources[f"srv/_{service.name}.py"] = emit_service(service, catalogue.message)
    if messages:
        sources["msg/__init__.py"] = emit_package(package, "msg", [each.name for each in messages])
        sources["msg/__init__.pyi"] = emit_stub(messages)
    if services:
        sources["srv/__init__.py"] = emit_package(
            package, "srv", [each.name for each in services], ("", "Request", "Response")
        )
        parts = [message for service in services for message in (service.request, service.response)]
        sources["srv/__init__.pyi"] = emit_stub(parts, services)
    return sources


def write_package(catalogue: Catalogue, package: str, root: Path, *, on_demand: bool = False) -> list[Path]:
    """Compile a package's definitions into ``root``/<package>/{msg,srv}; return the files that were written.

    With ``on_demand`` only the ``__init__`` modules and the stubs are written, and each message's module is compiled when it
    is first imported. Files whose text would not change are not written. Raise the same exceptions as
    :func:`compile_package`.
    """
    sources = compile_package(catalogue, package)
    if on_demand:
        sources = _on_demand(sources)
        for kind in ("msg", "srv"):
            # Remove modules that an earlier build has precompiled.
            for stale in (root / package / kind).glob("_[!_]*.py"):
                stale.unlink()
    folder = root / package
    if _is_generated(folder / "__init__.py"):
        sources["__init__.py"] = top_module(package, sources)
    return [path for name, source in sources.items() if write_if_changed(path := folder / name, source)]


def top_module(package: str, files: Iterable[str]) -> str:
    """Return the text of a package's ``__init__.py``; ``files`` are its other files, such as ``msg/__init__.py``."""
    from minirospy.core.idl.emit import emit_top

    return emit_top(package, [kind for kind in ("msg", "srv") if f"{kind}/__init__.py" in files])


def _is_generated(file: Path) -> bool:
    """Return whether a build may write the file: it does not exist, or an earlier build has generated it."""
    from minirospy.core.idl.emit import GENERATED

    return not file.exists() or GENERATED in file.read_text(encoding="utf-8").partition("\n")[0]


def _on_demand(sources: dict[str, str]) -> dict[str, str]:
    """Return the files of a package whose modules are compiled on import."""
    modules = [text for name, text in sources.items() if _is_module(name)]
    fingerprint = zlib.crc32("".join(modules).encode())
    kept = {name: text for name, text in sources.items() if not _is_module(name)}
    for name, text in kept.items():
        if name.endswith("__init__.py"):
            # Write a call to load_package() instead of the code from emit_package, which each such file would repeat.
            names = " ".join(sorted(_module_name(each) for each in sources if _is_in(each, name)))
            kept[name] = (
                f"{text.partition('import importlib')[0]}from minirospy.core.idl.on_demand import load_package\n\n"
                f"__getattr__, __dir__, __all__ = load_package(__name__, {fingerprint}, {names!r})\n"
            )
    return kept


def _is_in(module: str, init: str) -> bool:
    return _is_module(module) and module.partition("/")[0] == init.partition("/")[0]


def _module_name(name: str) -> str:
    """Return ``Name`` for ``msg/_Name.py``."""
    return name.partition("/_")[2].removesuffix(".py")


def _is_module(name: str) -> bool:
    return name.endswith(".py") and not name.endswith("__init__.py")


def write_if_changed(path: Path, text: str) -> bool:
    """Write a file unless it already has this text; return whether it was written.

    The new modification time is at least a second later than the old one, because Python recognizes an outdated
    compiled module by the source's size and its time in seconds.
    """
    data = text.encode()
    earliest = 0
    with contextlib.suppress(OSError):
        if path.read_bytes() == data:
            return False
        earliest = int(path.stat().st_mtime) + 1
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    if path.stat().st_mtime < earliest:
        os.utime(path, (earliest, earliest))
    return True


def get_message_class(name: str) -> type[Message] | None:
    """Return the class of ``pkg/Name``, or None if no module defines it."""
    found: type[Message] | None = _imported(name, "msg")
    return found


def get_service_class(name: str) -> ServiceClass | None:
    """Return the class of the service ``pkg/Name``, or None if no module defines it."""
    found: ServiceClass | None = _imported(name, "srv")
    return found


def message_class(name: str) -> type[Message]:
    """Return the class of ``pkg/Name``. If there is none, raise NotFoundError, which lists similar names."""
    found = get_message_class(name)
    if found is None:
        raise NotFoundError("message type", name, _known("msg"), "types are written package/Type")
    return found


def service_class(name: str) -> ServiceClass:
    """Return the class of the service ``pkg/Name``. If there is none, raise NotFoundError, which lists similar names."""
    found = get_service_class(name)
    if found is None:
        raise NotFoundError("service type", name, _known("srv"), "types are written package/Type")
    return found


def specs_of_text(full_name: str, text: str) -> dict[str, MessageSpec]:
    """Return the specs in a full text: the message's own, and those of all types that it uses.

    Raise DefinitionError if the text is invalid.
    """
    from minirospy.core.idl.parse import parse_message

    if len(text) > MAX_TEXT:
        raise DefinitionError(full_name, 1, f"its definition has more than {MAX_TEXT} characters")
    specs: dict[str, MessageSpec] = {}
    # The separator starts with a newline, so do not append one to a string that lacks a trailing newline.
    for number, part in enumerate(text.split(f"\n{_SEPARATOR}\n")):
        name, body = full_name, part
        if number:
            head, _, body = part.partition("\n")
            name = head.removeprefix("MSG:").strip()
        check_type_name(name, full_name)
        package, _, short = name.partition("/")
        specs.setdefault(name, parse_message(body, package, short))
    return specs


def checked_text(full_name: str, text: str) -> tuple[dict[str, MessageSpec], str]:
    """Return the specs used by the message in a full text, dependencies first, and the message's md5sum.

    Does not create a class. Raise DefinitionError if the text is invalid.
    """
    from minirospy.core.idl.digest import message_md5

    specs = specs_of_text(full_name, text)

    def lookup(name: str) -> MessageSpec:
        if name not in specs:
            raise DefinitionError(full_name, 1, f"the full text lacks [{name}]")
        return specs[name]

    needed = {name: specs[name] for name in check_types(specs[full_name], lookup)}
    return needed, message_md5(specs[full_name], lookup)


def class_from_text(full_name: str, text: str) -> type[Message]:
    """Create a message class for a type that is not installed, from the full text that a publisher sends.

    Raise DefinitionError if the text is invalid.
    """
    return classes_from_text(full_name, text)[full_name]


@lru_cache(maxsize=256)
def classes_from_text(full_name: str, text: str) -> Mapping[str, type[Message]]:
    """Return a dict from name to class for a full text's message and all types that it uses.

    Raise DefinitionError if the text is invalid.
    """
    from minirospy.core.idl.emit import emit_class

    specs, _ = checked_text(full_name, text)
    made: dict[str, type[Message]] = {}
    for name, spec in specs.items():
        made[name] = _run(emit_class(spec, specs.__getitem__), name, made)
    # Pass the text on unchanged, even if minirospy would have generated a different one.
    made[full_name]._full_text = text
    return types.MappingProxyType(made)


def _run(emitted: ClassSource, name: str, made: Mapping[str, type[Message]]) -> type[Message]:
    """Execute the source of a class; its fields use ``made``, the classes created so far."""
    file = f"<generated {name}>"
    module = types.ModuleType(f"minirospy_generated.{name.replace('/', '.')}")
    for type_, alias in emitted.classes.items():
        module.__dict__[alias] = made[type_]
    source = emitted.source
    linecache.cache[file] = (len(source), None, source.splitlines(keepends=True), file)
    # `validate` has checked the names, and `repr` quotes all other text, so text from a peer is never executed.
    try:
        exec(compile(source, file, "exec"), module.__dict__)
    except (SyntaxError, RecursionError, MemoryError, OverflowError, struct.error) as error:
        # Python has limits of its own, for example on the nested loops that nested arrays generate.
        raise DefinitionError(name, 1, f"Python cannot make a class of it: {error}") from error
    found: type[Message] = module.__dict__[name.partition("/")[2]]
    # Use genpy's naming: programs that read bags look for names such as `_sensor_msgs__Image`.
    found.__name__ = found.__qualname__ = f"_{name.replace('/', '__')}"
    found.__reduce__ = _reduced  # type: ignore[assignment, method-assign]
    _running[id(found)] = found
    # Remove the source when the class is removed, because a publisher may send any number of definitions.
    weakref.finalize(found, linecache.cache.pop, file, None).atexit = False
    return found


# Classes created at run time, keyed by id, so that unpickling a message finds its class
_running: weakref.WeakValueDictionary[int, type[Message]] = weakref.WeakValueDictionary()


def _reduced(message: Any) -> tuple[Any, ...]:
    """Return the data that pickle and copy need to recreate a message whose class is in no module.

    The data contains the class's full text.
    """
    kind = type(message)
    return _unpickled, (id(kind), kind._type, kind._full_text), message.__getstate__()


def _unpickled(key: int, type_: str, text: str) -> Message:
    """Return a new message whose class was created at run time. In another process, recreate the class."""
    found = _running.get(key)
    if found is None or (found._type, found._full_text) != (type_, text):
        found = class_from_text(type_, text)
    return found.__new__(found)


def _imported(name: str, kind: str) -> Any:
    """Return the class ``pkg/Name`` from an installed package, or None if there is none.

    The name may come from a peer, and importing a module executes it. Therefore only a package with a folder (or module)
    ``msg`` or ``srv`` is imported, never another module that happens to have this name.
    """
    if name == "Header" and kind == "msg":
        name = "std_msgs/Header"
    if not is_type_name(name):
        return None
    package, _, short = name.partition("/")
    if not _has_definitions(package, kind):
        return None

    try:
        module = importlib.import_module(f"{package}.{kind}")
    except ModuleNotFoundError as error:
        if error.name and not f"{package}.{kind}".startswith(error.name):
            raise
        return None

    found = getattr(module, short, None)
    return found if hasattr(found, "_md5sum") and hasattr(found, "_type") else None


def _has_definitions(package: str, kind: str) -> bool:
    """Return whether a package contains a module of generated classes, without importing the package or the module."""
    if f"{package}.{kind}" in sys.modules:
        return True
    try:
        found = importlib.util.find_spec(package)
    except (ImportError, ValueError):
        # A module added to sys.modules by hand has no spec; find_spec then raises ValueError.
        found = None
    if found is None:
        return package in sys.modules
    if found.submodule_search_locations is None:
        return False
    # An imported package may extend over several entries in sys.path (pkgutil.extend_path).
    folders = [*found.submodule_search_locations, *(os.path.join(entry, package) for entry in sys.path)]
    return importlib.machinery.PathFinder.find_spec(f"{package}.{kind}", folders) is not None


def _known(kind: str) -> set[str]:
    """Return the types in minirospy's own packages, and in all packages on sys.path that have generated modules."""
    from minirospy.core.idl.own_packages import own_definitions

    files = [(path.parent.parent, path.stem) for path in own_definitions().glob(f"*/{kind}/*.{kind}")]
    for entry in sys.path:
        modules = Path(entry or ".").glob(f"*/{kind}/_*.py")
        files += [(path.parent.parent, path.stem[1:]) for path in modules if path.stem != "__init__"]
    return {f"{folder.name}/{name}" for folder, name in files}
