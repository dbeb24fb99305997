"""Modules that ROS's modules import: here each is imported when a program first uses it.

Programs use `rospy.core.rosgraph`, and tests replace `rospy.client.time`.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from types import ModuleType

__all__ = ["modules_on_first_use", "on_first_use"]


def on_first_use(package: str, *names: str) -> Callable[[str], ModuleType]:
    """Return the ``__getattr__`` of ``package`` (PEP 562), which imports these submodules."""

    def find(name: str) -> ModuleType:
        if name in names:
            return import_module(f"{package}.{name}")
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return find


def modules_on_first_use(module: str, names: str) -> Callable[[str], ModuleType]:
    """Return the ``__getattr__`` of ``module``, which imports the modules that ROS's module of that name imports.

    ``names`` are separated by spaces. ``xmlrpcclient=xmlrpc.client`` is the module xmlrpc.client as ``xmlrpcclient``.
    """
    paths = {name: path or name for name, _, path in (each.partition("=") for each in names.split())}

    def find(name: str) -> ModuleType:
        if name in paths:
            return import_module(paths[name])
        raise AttributeError(f"module {module!r} has no attribute {name!r}")

    return find
