"""Find the controllers that packages export, and import their Python classes.

A package.xml exports a plugin file: `<export><controller_interface plugin="${prefix}/plugins.xml"/></export>`. The ``type`` of a
class in that file is a dotted Python path. Python packages may instead have entry points in the group
``controller_interface.controllers``. Source: http://wiki.ros.org/pluginlib.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Callable, Iterable, Iterator
from importlib import metadata
from pathlib import Path
from typing import NamedTuple

from minirospy import client as rospy
from minirospy.base.errors import ManifestError, MinirospyError
from minirospy.base.xml_text import XmlError, parse_xml
from minirospy.core.control.controller import Controller
from minirospy.core.control.manager import describe_error
from minirospy.workspace.manifest import read_manifest
from minirospy.workspace.packages import Packages

__all__ = ["Plugin", "PluginError", "find_plugins", "forget_modules"]

_OWN = Path(__file__).parents[1]

_GROUP = "controller_interface.controllers"
_BASES = {
    "controller_interface::ControllerBase",
    "controller_interface::Controller",
    "controller_interface.Controller",
    "",
}


class PluginError(MinirospyError):
    """Raised if a controller's class cannot be imported. The message is one line."""


class Plugin(NamedTuple):
    """A controller class that can be loaded. ``name`` is its type in parameters, ``origin`` the file that declares the class."""

    name: str
    python: str  # the class's dotted path, or its C++ name
    origin: str
    folder: Path | None = None  # the package's folder

    def load(self) -> type[Controller]:
        """Import the class. Raise PluginError if that fails."""
        if "::" in self.python:
            raise PluginError(
                f"{self.python} is written in C++ ({self.origin}): minirospy loads controllers that are written in Python"
            )
        # An entry point has a colon between the module and the class.
        module, _, name = self.python.partition(":") if ":" in self.python else self.python.rpartition(".")
        try:
            if self.folder:
                _find_module(module.partition(".")[0], self.folder)
            found: object = importlib.import_module(module)
            for part in name.split("."):
                found = getattr(found, part)
        except (Exception, SystemExit) as error:  # the user's module may raise any exception
            trace = error.__traceback__
            why = describe_error(error.with_traceback(trace and trace.tb_next))  # skip this frame
            raise PluginError(f"cannot import {self.python} ({self.origin}): {why}") from error
        if not (isinstance(found, type) and issubclass(found, Controller)):
            raise PluginError(
                f"{self.python} ({self.origin}) is not a subclass of controller_interface.Controller"
            )
        return found


def find_plugins(warn: Callable[[str], object] = lambda line: rospy.logwarn("%s", line)) -> dict[str, Plugin]:
    """Return the controllers that packages and entry points declare, by type.

    Call ``warn`` with a line for each file that cannot be read.
    """
    found: dict[str, Plugin] = {}
    for name, folder in sorted(Packages().folders().items()):
        try:
            for plugin in _of_package(name, folder):
                found.setdefault(plugin.name, plugin)
        except (ManifestError, XmlError, OSError) as error:
            warn(f"controllers of package [{name}] are ignored: {error}")
    for point in metadata.entry_points(group=_GROUP):
        found.setdefault(point.name, Plugin(point.name, point.value, f"entry point of {point.module}"))
    return found


def forget_modules(plugins: Iterable[Plugin]) -> None:
    """Make the next load of these controllers reimport their modules, except minirospy's."""
    folders = [
        each.folder.resolve() for each in plugins if each.folder and not each.folder.is_relative_to(_OWN)
    ]
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if file and any(Path(file).resolve().is_relative_to(folder) for folder in folders):
            del sys.modules[name]
    importlib.invalidate_caches()


def _of_package(name: str, folder: Path) -> Iterator[Plugin]:
    manifest = folder / "package.xml"
    if not manifest.exists() or b"controller_interface" not in manifest.read_bytes():
        return
    for export in read_manifest(manifest).exports:
        if export.tag == "controller_interface" and (path := export.attributes.get("plugin")):
            yield from _of_file(Path(path.replace("${prefix}", str(folder))), folder)


def _of_file(file: Path, folder: Path) -> Iterator[Plugin]:
    root = parse_xml(file.read_bytes())
    libraries = root.all("library") if root.tag == "class_libraries" else [root]
    for library in libraries:
        for each in library.all("class"):
            kind = each.attributes.get("type", "")
            if each.attributes.get("base_class_type", "") in _BASES and kind:
                yield Plugin(each.attributes.get("name") or kind, kind, f"{file}:{each.line}", folder)


def _find_module(module: str, folder: Path) -> None:
    """Make a module of an unbuilt or unsourced package importable from the package's folder or its subfolder ``src``."""
    spec = importlib.util.find_spec(module)
    if spec is None or spec.origin is None:  # a folder without code
        for place in (folder / "src", folder):
            if (place / module).is_dir() or (place / f"{module}.py").is_file():
                sys.path.append(str(place))
                importlib.invalidate_caches()
                return
