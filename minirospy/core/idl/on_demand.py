"""Compile definitions to modules when they are first imported: a program uses only a few types from many packages.

Such a package has no ``msg/_Name.py``. Its ``msg/__init__.py`` calls :func:`load_package`; after that,
``import gazebo_msgs.msg._ModelState`` compiles that definition, and Python caches the result in ``__pycache__`` as for
any module. If that folder is not writable, each process compiles the module again.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Sequence
from functools import lru_cache
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from minirospy.core.idl.own_packages import own_definitions

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

    from minirospy.core.idl.load import Catalogue

__all__ = ["load_package"]


def load_package(
    module: str, fingerprint: int, names: str
) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    """Make the modules in ``pkg.msg`` or ``pkg.srv`` importable.

    Return the package's ``__getattr__``, ``__dir__`` and ``__all__``. ``names``: its messages or services, separated by
    spaces. ``fingerprint`` changes if the source of any of its modules changes.
    """
    if _FINDER not in sys.meta_path:
        sys.meta_path.append(_FINDER)
    package, _, kind = module.rpartition(".")
    _FINDER.packages[package] = fingerprint
    parts = ("", "Request", "Response") if kind == "srv" else ("",)
    modules = {name + part: f"{module}._{name}" for name in names.split() for part in parts}

    inner = {path.rpartition(".")[2] for path in modules.values()}

    def load(name: str) -> object:
        if name not in modules:
            if name in inner:
                return importlib.import_module(f"{module}.{name}")
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        value: object = getattr(importlib.import_module(modules[name]), name)
        setattr(sys.modules[module], name, value)
        return value

    all_names = sorted(modules)
    return load, lambda: all_names, all_names


class _Finder:
    """The last finder in ``sys.meta_path``, so that modules that exist as files are found first."""

    def __init__(self) -> None:
        self.packages: dict[str, int] = {}

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the spec of ``pkg.msg._Name`` or ``pkg.srv._Name`` if the package defines it."""
        package, _, rest = fullname.partition(".")
        kind, _, module = rest.partition(".")
        if package not in self.packages or not path or not module.startswith("_"):
            return None
        if not _defines(package, kind, module[1:]):
            return None
        file = str(Path(path[0], f"{module}.py"))
        loader = _Loader(fullname, file, self.packages[package])
        return spec_from_file_location(fullname, file, loader=loader)


class _Loader(SourceFileLoader):
    """Compiles the source generated from a definition; leaves the rest, such as caching, to SourceFileLoader."""

    def __init__(self, fullname: str, path: str, fingerprint: int) -> None:
        super().__init__(fullname, path)
        self._fingerprint = fingerprint

    def path_stats(self, path: str | bytes) -> dict[str, int]:
        """Return the values that Python compares with a cached module's header.

        The size of the source is unknown at this point.
        """
        return {"mtime": self._fingerprint, "size": 0}

    def set_data(self, path: str, data: ReadableBuffer, *, _mode: int = 0o666) -> None:
        """Write a module's cache, with the size from :meth:`path_stats` in its header (PEP 552)."""
        cached = bytes(data)
        super().set_data(path, cached[:12] + bytes(4) + cached[16:], _mode=_mode)

    def get_data(self, path: str | bytes) -> bytes:
        """Return the contents of ``path``: the module's source or its cached bytecode."""
        if path != self.path:
            return super().get_data(str(path))
        package, kind, module = self.name.split(".")
        return _source(package, kind, module[1:]).encode()


def _defines(package: str, kind: str, name: str) -> bool:
    folder = own_definitions() / package
    if kind == "srv":
        return (folder / "srv" / f"{name}.srv").is_file()
    return kind == "msg" and (
        (folder / "msg" / f"{name}.msg").is_file() or name in _of_actions(_catalogue(), package)
    )


def _of_actions(catalogue: Catalogue, package: str) -> set[str]:
    return {message.name for action in catalogue.actions(package) for message in action.messages}


@lru_cache(maxsize=1)
def _catalogue() -> Catalogue:
    from minirospy.core.idl.load import Catalogue

    return Catalogue.below(own_definitions())


def _source(package: str, kind: str, name: str) -> str:
    from minirospy.core.idl.emit import emit_message, emit_service

    catalogue = _catalogue()
    if kind == "msg":
        return emit_message(catalogue.message(f"{package}/{name}"), catalogue.message)
    return emit_service(catalogue.service(f"{package}/{name}"), catalogue.message)


_FINDER = _Finder()
