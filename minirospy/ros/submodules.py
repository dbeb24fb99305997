"""Imports submodules and other names that ROS's own modules would import, each on first use."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from types import ModuleType

__all__ = ["import_passed_on", "offer_standard_library"]

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
"""Standard library submodules that real ROS imports, so programs use them without importing them."""

_LARGE = {"http", "logging"}
"""Packages that are slow to import: offer their submodules only if the program has already imported the package."""


def import_passed_on(namespace: dict[str, object], name: str, place: str) -> object:
    """Import ``place`` (`MODULE` or `MODULE:NAME`), store it as ``name`` in ``namespace``, and return it."""
    module, _, inner = place.partition(":")
    found: object = import_module(module)
    if inner:
        found = getattr(found, inner)
    return namespace.setdefault(name, found)


def offer_standard_library() -> None:
    """Let programs use ``xml.etree.ElementTree`` after ``import rospy, xml``, as in real ROS.

    The submodules are imported when they are first used: importing them in advance would take longer than ``import rospy``.
    """
    for package, names in _STANDARD_LIBRARY.items():
        if package in _LARGE and package not in sys.modules:
            continue
        attributes = vars(import_module(package))
        attributes.setdefault("__getattr__", _on_first_use(package, *names))


def _on_first_use(package: str, *names: str) -> Callable[[str], ModuleType]:
    """Return a module ``__getattr__`` (PEP 562) for ``package`` that imports the submodules ``names`` on first use."""

    def find(name: str) -> ModuleType:
        if name in names:
            return import_module(f"{package}.{name}")
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return find
