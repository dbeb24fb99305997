"""Write `overlay/`: the modules that programs import (`rospy`, `rosbag`, `RPi`, ...), from the modules of the same names here.

The names that `import rosgraph.masterapi` provides are in `ros/rosgraph/rosgraph/masterapi.py`; the module in `overlay/`
re-exports the names in `__all__`, and those that the module imports in the form `from x import y as y`. The build writes
`overlay/` (hatch_build.py), and `python -m minirospy.ros.overlay_modules` writes it again. This module reads the sources
without importing them.
"""

from __future__ import annotations

import ast
import functools
import os
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from minirospy.workspace.elsewhere import IMPORTED, SUBMODULES

__all__ = ["Origin", "exported", "modules", "overlay_files", "write_overlay"]

PACKAGE = Path(__file__).parents[1]
_ALSO = {"RPi": PACKAGE / "board" / "pins"}
"""Python modules of no ROS package -> the folder that has them."""
_NAMED_OTHERWISE = {
    "camera_info_manager_py": ("camera_info_manager",),
    "python_orocos_kdl": ("PyKDL",),
    "urdfdom_py": ("urdf_parser_py",),
}
"""ROS package -> the Python modules that have another name."""
_INTERNAL = {
    "PyKDL": "frames functions vectors",
    "actionlib": "aio client goal_id handle machine server simple_client simple_server spec states statuses waiting",
    "bondpy": "machine",
    "camera_calibration_parsers": "convert texts",
    "dynamic_reconfigure": "dynparam generated",
    "image_geometry": "rectification",
    "kdl_parser_py": "tree",
    "message_filters": "stamps",
    "rosauth": "authentication",
    "rosbag": "exceptions internals opening private readers records",
    "rospy": "live passing",
    "rostopic": "echo rates",
    "smach_ros": "callbacks pickled",
    "sound_play": "node players programs tones",
    "tf": "composed euler matrices vectors",
    "tf2_ros": "aio broadcasters client core interface listener messages server waiting",
    "topic_tools": "expressions",
    "urdf_parser_py": "joints links",
}
"""Python module -> its modules that ROS's does not have. Put a new one next to the folder of the module instead."""
_GENERATED = "generated from minirospy/"  # in the docstring of each module
_METADATA = "rospy-1.17.0.egg-info"  # programs ask importlib.metadata for rospy's version
_METADATA_TEXT = "Metadata-Version: 1.1\nName: rospy\nVersion: 1.17.0\nSummary: rospy as minirospy has it\n"
_WIDTH = 118  # characters in a line

_HOOKS = {"__getattr__", "__dir__"}
"""Functions by which a module answers for names that it does not have (PEP 562)."""


class Origin(NamedTuple):
    """The place a name is imported from: ``from module import name``, or ``import module`` if ``name`` is empty."""

    module: str
    name: str


class _Source(NamedTuple):
    """The names that a module's top level defines, read from its source."""

    public: tuple[str, ...] | None
    """``__all__``, or None if the module has none."""
    imported: dict[str, Origin]
    """Names that an import binds, including those in blocks for type checkers."""
    passed_on: frozenset[str]
    """Names that an import binds in the form ``x as x``, and a module's ``__getattr__`` and ``__dir__``."""


def write_overlay(folder: Path) -> list[str]:
    """Write the modules below a folder and return their paths in it.

    Remove modules from an earlier build that are not written.
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
    """Return the files in `overlay/`, except message modules: path -> text."""
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
    """Return the modules that programs import, and the file that defines each one's names: ``rosgraph.names`` -> its path."""
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
    """Yield a ROS package's Python modules: its folders that contain an ``__init__.py`` and are named as the module."""
    named = {package.name, *_NAMED_OTHERWISE.get(package.name, ())}
    for folder in package.iterdir():
        if folder.name in named and (folder / "__init__.py").exists():
            yield folder.name


def exported(source: Path) -> dict[str, Origin]:
    """Return the names that the module in `overlay/` re-exports: name -> where it is imported from."""
    read = _read(source)
    names = dict.fromkeys([*(read.public or ()), *sorted(read.passed_on)])
    return {name: _origin(Origin(_dotted(source), name)) for name in names}


def _origin(asked: Origin) -> Origin:
    """Follow a name through modules that only re-export it."""
    source = _source_of(asked.module)
    if source is None:
        return asked
    inner = _read(source).imported.get(asked.name)
    if inner is None:
        return asked
    module = _by_source().get(f"{inner.module}.{inner.name}")
    if module is not None:
        # If the name is a module that has the same name in the overlay, use the overlay's, so that `rosgraph.names`
        # is the module that `import rosgraph.names` returns.
        parent, _, name = module[0].rpartition(".")
        is_kept = asked.name == name or asked.module == inner.module
        return Origin(parent or name, name if parent else "") if is_kept else inner
    return _origin(inner)


def _text(name: str, source: Path) -> str:
    where = source.relative_to(PACKAGE).as_posix()
    lines = [f'"""{name}, provided by minirospy: {_GENERATED}{where}."""', ""]
    by_module: dict[str, list[str]] = {}
    for bound, (module, imported) in exported(source).items():
        if imported:
            by_module.setdefault(module, []).append(f"{imported} as {bound}")
        else:
            lines.append(f"import {module} as {bound}")
    for module, names in by_module.items():
        lines += [f"from {module} import (", *_wrapped(names), ")"]
    public = _read(source).public
    if public is not None:
        listed = [f'"{each}"' for each in sorted(public) if not each.startswith("_")]
        lines += ["", "__all__ = [", *_wrapped(listed), "]"]
    return "\n".join(lines).rstrip("\n") + "\n"


def _wrapped(words: Iterable[str]) -> list[str]:
    """Return indented lines of the words, each with a comma."""
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
    """Map each module that the overlay offers, by its dotted name here, to its name in the overlay and its file."""
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
