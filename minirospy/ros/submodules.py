"""Submodules and other names that ROS's modules import for themselves: here each is imported when a program first uses it."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from types import ModuleType

__all__ = ["import_passed_on", "offer_standard_library", "on_first_use"]

_STANDARD_LIBRARY = {
    "email": (
        "charset",
        "encoders",
        "errors",
        "feedparser",
        "header",
        "iterators",
        "message",
        "parser",
        "utils",
    ),
    "http": ("client", "server"),
    "importlib": ("abc", "machinery", "util"),
    "logging": ("config", "handlers"),
    "urllib": ("parse",),
    "xml": ("dom", "etree", "parsers"),
    "xml.dom": ("NodeFilter", "minidom"),
    "xml.etree": ("ElementPath", "ElementTree"),
    "xml.parsers": ("expat",),
    "xmlrpc": ("client", "server"),
}
"""Packages of the standard library -> their submodules that real ROS imports, so that programs use them without an import."""

_LARGE = {"http", "logging"}
"""Packages that take longer to import than all the others: they get their submodules only if something has imported them."""


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


def offer_standard_library() -> None:
    """Let ``import rospy, xml`` suffice for ``xml.etree.ElementTree``, as with real ROS.

    The submodules are imported when they are first used: importing them in advance would take longer than ``import rospy``.
    """
    for package, names in _STANDARD_LIBRARY.items():
        if package in _LARGE and package not in sys.modules:
            continue
        attributes = vars(import_module(package))
        attributes.setdefault("__getattr__", on_first_use(package, *names))
