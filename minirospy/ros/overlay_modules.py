"""Writes `overlay/`, the modules that programs import (`rospy`, `rosbag`, `RPi`, ...).

Each module re-exports names from the module of the same name in this package.

The names that `import rosgraph.masterapi` provides are in `ros/rosgraph/rosgraph/masterapi.py`; the module in `overlay/`
re-exports the names in `__all__`, and those that the module imports in the form `from x import y as y`. In real ROS, a star
import also brings names from other modules (`os`, `rospy`: passed_on.json); the module in `overlay/` finds these names when a
program first uses them. The build writes `overlay/` (hatch_build.py), and `python -m minirospy.ros.overlay_modules` writes it
again. This module reads the sources without importing them.
"""

from __future__ import annotations

import ast
import functools
import json
import os
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from minirospy.core.idl.own_packages import own_definitions
from minirospy.workspace.elsewhere import IMPORTED, SUBMODULES

__all__ = ["Origin", "exported", "listed", "modules", "overlay_files", "read_passed_on", "write_overlay"]

PACKAGE = Path(__file__).parents[1]
_PASSED_ON = PACKAGE / "ros" / "passed_on.json"  # written by tests/referee/compare_surface.py
_ALSO = {"RPi": PACKAGE / "board" / "pins"}
"""Folders of Python modules that do not belong to a ROS package, keyed by module."""
_NAMED_OTHERWISE = {
    "camera_info_manager_py": ("camera_info_manager",),
    "python_orocos_kdl": ("PyKDL",),
    "urdfdom_py": ("urdf_parser_py",),
}
"""ROS packages whose Python module is not named after the package."""
_LAZY = {"genpy"}
"""Packages that every message module imports: their submodules are imported when they are first used."""

_INTERNAL = {
    "PyKDL": "frames functions vectors",
    "actionlib": "aio client goal_id handle machine server simple_client simple_server spec states statuses waiting",
    "bondpy": "machine",
    "camera_calibration_parsers": "convert texts",
    "dynamic_reconfigure": "dynparam generated",
    "genpy": "run_time",
    "image_geometry": "rectification",
    "kdl_parser_py": "tree",
    "message_filters": "stamps",
    "rosauth": "authentication",
    "rosbag": "exceptions internals opening private readers records",
    "rospy": "live",
    "rostopic": "echo rates",
    "smach_ros": "callbacks pickled",
    "sound_play": "node players programs tones",
    "tf": "composed euler matrices vectors",
    "tf2_ros": "aio broadcasters client core interface listener messages server waiting",
    "topic_tools": "expressions",
    "urdf_parser_py": "joints links",
}
"""Modules that ROS's Python modules do not have. Do not add entries: put a new module next to the Python module's folder."""
_WITHOUT_STANDARD_LIBRARY = {
    *("PyKDL", "angles", "camera_calibration_parsers", "cv_bridge"),
    *("genmsg", "genpy", "image_geometry", "sensor_msgs"),
}
"""Packages that in real ROS import no XML, XML-RPC or logging handlers. Programs that use only messages start faster."""
_GENERATED = "generated from minirospy/"  # marks generated modules in their docstrings
_METADATA = "rospy-1.17.0.egg-info"  # programs query rospy's version through importlib.metadata
_METADATA_TEXT = "Metadata-Version: 1.1\nName: rospy\nVersion: 1.17.0\nSummary: rospy as minirospy has it\n"
_WIDTH = 118  # maximum line length in characters

_DEFINED = {"msg": ("msg", "action"), "srv": ("srv",)}
"""Maps each generated module to the folders that contain its definitions."""

_HOOKS = {"__getattr__", "__dir__"}
"""Module functions that look up names missing from the module (PEP 562)."""


class Origin(NamedTuple):
    """The source of an imported name: ``from module import name``, or ``import module`` if ``name`` is empty."""

    module: str
    name: str


class _Source(NamedTuple):
    """The names defined at a module's top level, read from its source."""

    public: tuple[str, ...] | None
    """``__all__``, or None if the module does not define it."""
    imported: dict[str, Origin]
    """Names bound by imports, including imports for type checkers only."""
    passed_on: frozenset[str]
    """Names that an import binds in the form ``x as x``, and the functions ``__getattr__`` and ``__dir__`` if the module has
    them.
    """


def write_overlay(folder: Path) -> list[str]:
    """Write the modules below a folder; return their paths relative to it.

    Remove modules from an earlier build that are no longer written.
    """
    from minirospy.core.idl.load import write_if_changed

    files = overlay_files()
    for name, text in files.items():
        write_if_changed(folder / name, text)
    for old in folder.rglob("*.py"):
        name = old.relative_to(folder).as_posix()
        if name not in files and _GENERATED in old.read_text(encoding="utf-8").partition("\n")[0]:
            old.unlink()
    return list(files)


def overlay_files() -> dict[str, str]:
    """Return the contents of the files in `overlay/`, except message modules, keyed by path."""
    files = {_METADATA: _METADATA_TEXT}
    for name, source in modules().items():
        path = name.replace(".", "/")
        files[f"{path}/__init__.py" if source.name == "__init__.py" else f"{path}.py"] = _text(name, source)
        files[f"{name.partition('.')[0]}/py.typed"] = ""
    for name in sorted(IMPORTED):
        files[f"{name}/__init__.py"] = _text_of_missing(name)
    for name in SUBMODULES:
        files[f"{name.replace('.', '/')}.py"] = _text_of_missing(name)
    return files


@functools.cache
def modules() -> dict[str, Path]:
    """Map each module, such as ``rosgraph.names``, to the file that defines its names."""
    roots = dict(_ALSO)
    for folder in sorted((PACKAGE / "ros").iterdir()):
        if folder.is_dir():
            roots |= dict.fromkeys(_python_modules(folder), folder)

    found = {}
    for top, folder in roots.items():
        internal = set(_INTERNAL.get(top, "").split())
        for path in sorted((folder / top).rglob("*.py")):
            parts = path.relative_to(folder).with_suffix("").parts
            if parts[1] not in internal:
                found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def _python_modules(package: Path) -> Iterator[str]:
    """Yield a ROS package's Python modules: folders that have a valid module name and contain an ``__init__.py``."""
    named = {package.name, *_NAMED_OTHERWISE.get(package.name, ())}
    for folder in package.iterdir():
        if folder.name in named and (folder / "__init__.py").exists():
            yield folder.name


def exported(source: Path) -> dict[str, Origin]:
    """Return the names that the module in `overlay/` re-exports, each with the module that provides it."""
    read = _read(source)
    names = dict.fromkeys([*(read.public or ()), *sorted(read.passed_on)])
    return {name: _origin(Origin(_dotted(source), name)) for name in names}


def _origin(asked: Origin) -> Origin:
    """Return the origin of a name, following modules that only re-export it."""
    source = _source_of(asked.module)
    if source is None:
        return asked
    inner = _read(source).imported.get(asked.name)
    if inner is None:
        return asked
    module = _by_source().get(f"{inner.module}.{inner.name}")
    if module is not None:
        # The name is a module that the overlay contains, too: use the overlay's module, so that the attribute
        # `rosgraph.names` is the module that `import rosgraph.names` returns.
        parent, _, name = module[0].rpartition(".")
        is_kept = asked.name == name or asked.module == inner.module
        return Origin(parent or name, name if parent else "") if is_kept else inner
    return _origin(inner)


def _text(name: str, source: Path) -> str:
    where = source.relative_to(PACKAGE).as_posix()
    lines = [f'"""{name}, provided by minirospy: {_GENERATED}{where}."""', ""]
    by_module: dict[str, list[str]] = {}
    names_here = exported(source)
    public = _read(source).public
    passed_on = _passed_on(name, listed(source))
    is_package = source.name == "__init__.py" and name not in _ALSO
    later = {**(_submodules(name) if is_package else {}), **passed_on}
    assert not (later and "__getattr__" in names_here), f"{where}: overlay/ needs a __getattr__ of its own"
    typed = [bound for bound, origin in names_here.items() if name in _LAZY and origin == Origin(name, bound)]
    for bound in typed:
        del names_here[bound]
    for bound, (module, imported) in names_here.items():
        if imported:
            by_module.setdefault(module, []).append(f"{imported} as {bound}")
        else:
            lines.append(f"import {module} as {bound}")
    for module, names in by_module.items():
        lines += [f"from {module} import (", *_wrapped(names), ")"]
    if public is not None:
        lines += ["", "__all__ = [", *_wrapped(f'"{each}"' for each in listed(source)), "]"]
    if is_package and "." not in name and name not in _WITHOUT_STANDARD_LIBRARY:
        lines += [
            *([""] if lines[-1] else []),
            "from minirospy.ros.submodules import offer_standard_library as _offer_standard_library",
            "",
            "_offer_standard_library()",
        ]
    later = {each: place for each, place in later.items() if each not in names_here}
    if later or passed_on:
        starred = [
            f"__all__ {'=' if public is None else '+='} [",
            *_wrapped(f'"{each}"' for each in passed_on),
            "]",
        ]
        lines += _text_of_later(name, later, starred if passed_on else [], typed)
    return "\n".join(lines).rstrip("\n") + "\n"


def listed(source: Path) -> list[str]:
    """Return the public names in a module file's ``__all__``."""
    return sorted(name for name in _read(source).public or () if not name.startswith("_"))


def _passed_on(module: str, own: Iterable[str]) -> dict[str, str]:
    """Return a dict from the names that the module gets by star imports to their sources: `MODULE` or `MODULE:NAME`."""
    found = {}
    for place, names in read_passed_on().get(module, {}).items():
        for each in names.split():
            name, _, there = each.partition("=")
            found[name] = ":".join(filter(None, (place, there or name)))
    return {name: found[name] for name in sorted(found.keys() - set(own))}


@functools.cache
def read_passed_on() -> dict[str, dict[str, str]]:
    """Return the names that star imports provide in real ROS, where modules have no ``__all__``.

    The result maps modules to the modules that define the names ("" if the names are modules themselves), and these to the
    names, separated by spaces: NAME, or NAME=NAME_THERE.
    """
    table: dict[str, dict[str, str]] = json.loads(_PASSED_ON.read_text(encoding="utf-8"))
    return table


def _submodules(package: str) -> dict[str, str]:
    """Map the names of a package's submodules to their full names."""
    depth = package.count(".") + 1
    names = [
        each.rpartition(".")[2]
        for each in modules()
        if each.startswith(f"{package}.") and each.count(".") == depth
    ]
    definitions = own_definitions() / package
    names += [kind for kind, of in _DEFINED.items() if any((definitions / each).is_dir() for each in of)]
    return {name: f"{package}.{name}" for name in sorted(names)}


def _text_of_later(module: str, names: dict[str, str], starred: list[str], typed: list[str]) -> list[str]:
    """Return source lines that import these names on first use. Type checkers and editors see only the submodules ``typed``."""
    shown = [f"    from {module} import {', '.join(f'{each} as {each}' for each in typed)}", ""]
    return [
        "",
        "import typing as _typing",
        "",
        *(["if _typing.TYPE_CHECKING:", *shown] if typed else []),
        "if not _typing.TYPE_CHECKING:",
        "    from minirospy.ros.submodules import import_passed_on as _import_passed_on",
        "",
        "    _LATER = {",
        *(f"    {line}" for line in _wrapped(f'"{name}": "{place}"' for name, place in names.items())),
        "    }",
        *(f"    {line}" for line in starred),
        "",
        "    def __getattr__(name):",
        "        if name in _LATER:",
        "            return _import_passed_on(globals(), name, _LATER[name])",
        f"        raise AttributeError(f\"module '{module}' has no attribute {{name!r}}\")",
    ]


def _wrapped(words: Iterable[str]) -> list[str]:
    """Join the words with commas, wrapped and indented."""
    lines: list[str] = []
    for word in words:
        if lines and len(lines[-1]) + len(word) + 2 <= _WIDTH:
            lines[-1] += f" {word},"
        else:
            lines.append(f"    {word},")
    return lines


def _text_of_missing(name: str) -> str:
    parent = name.replace(".", "_")
    return (
        f'"""{name}, which minirospy does not have: {_GENERATED}workspace/elsewhere.py."""\n\n'
        f"from minirospy.ros.elsewhere import {parent} as {name.rpartition('.')[2]}\n"
    )


def _dotted(source: Path) -> str:
    parts = source.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@functools.cache
def _by_source() -> dict[str, tuple[str, Path]]:
    """Map each module's dotted name in this package to its name in the overlay and its file."""
    return {_dotted(source): (name, source) for name, source in modules().items()}


def _source_of(module: str) -> Path | None:
    found = _by_source().get(module)
    return found and found[1]


@functools.cache
def _read(source: Path) -> _Source:
    public: tuple[str, ...] | None = None
    imported: dict[str, Origin] = {}
    passed_on: set[str] = set()
    statements = list(ast.parse(source.read_text(encoding="utf-8")).body)
    while statements:
        statement = statements.pop(0)
        if isinstance(statement, ast.If) and ast.unparse(statement.test) == "TYPE_CHECKING":
            statements = statement.body + statements
        elif isinstance(statement, ast.ImportFrom):
            for alias in statement.names:
                bound = alias.asname or alias.name
                imported[bound] = Origin(statement.module or "", alias.name)
                if alias.asname == alias.name or bound in _HOOKS:
                    passed_on.add(bound)
        elif isinstance(statement, ast.Import):
            for alias in statement.names:
                if "." not in alias.name or alias.asname:
                    imported[alias.asname or alias.name] = Origin(alias.name, "")
                if alias.asname == alias.name:
                    passed_on.add(alias.name)
        elif isinstance(statement, ast.FunctionDef) and statement.name in _HOOKS:
            passed_on.add(statement.name)
        elif isinstance(statement, (ast.Assign, ast.AnnAssign)):
            targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
            names = {ast.unparse(target) for target in targets}
            passed_on |= names & _HOOKS
            if "__all__" in names and statement.value is not None:
                public = tuple(ast.literal_eval(statement.value))
    return _Source(public, imported, frozenset(passed_on))


if __name__ == "__main__":
    write_overlay(PACKAGE / "overlay")
    sys.stdout.write(f"{os.path.relpath(PACKAGE / 'overlay')}: {len(modules())} modules\n")
