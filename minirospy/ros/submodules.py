"""Submodules and other names that ROS's modules import for themselves: here each is imported when a program first uses it."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from types import ModuleType

__all__ = ["import_passed_on", "on_first_use"]


def on_first_use(package: str, *names: str) -> Callable[[str], ModuleType]:
    """Return the ``__getattr__`` of ``package`` (PEP 562), which imports these submodules."""

    def find(name: str) -> ModuleType:
        if name in names:
            return import_module(f"{package}.{name}")
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return find


def import_passed_on(namespace: dict[str, object], name: str, place: str) -> object:
    """Return what ``place``, `MODULE` or `MODULE:NAME`, means, and keep it in a module's ``namespace`` as ``name``."""
    module, _, inner = place.partition(":")
    found: object = import_module(module)
    if inner:
        found = getattr(found, inner)
    return namespace.setdefault(name, found)
