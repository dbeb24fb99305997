"""Submodules that ROS's packages import with themselves: here each is imported when a program first uses it."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from types import ModuleType

__all__ = ["on_first_use"]


def on_first_use(package: str, *names: str) -> Callable[[str], ModuleType]:
    """Return the ``__getattr__`` of ``package`` (PEP 562), which imports these submodules."""

    def find(name: str) -> ModuleType:
        if name in names:
            return import_module(f"{package}.{name}")
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return find
