"""Read the contents of a package's setup.py: Python packages, modules and scripts.

The file is executed, because it may compute its lists; the ``setup()`` that it calls only records its arguments. Neither
setuptools nor catkin_pkg is needed. Source: http://docs.ros.org/en/noetic/api/catkin/html/user_guide/setup_dot_py.html.
"""

from __future__ import annotations

import fnmatch
import importlib
import os
import sys
import traceback
import types
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import NamedTuple, TypeVar

from minirospy.base.errors import BuildError
from minirospy.workspace.manifest import VARIABLES, read_manifest

__all__ = ["PythonSetup", "read_python_setup"]


_Kind = TypeVar("_Kind")


class PythonSetup(NamedTuple):
    """The contents of a setup.py: top-level packages and modules, as dicts from name to path, and scripts.

    ``warnings`` has a line for each package whose folder is missing, which catkin ignores.
    """

    packages: dict[str, Path]
    modules: dict[str, Path]
    scripts: tuple[Path, ...]
    warnings: tuple[str, ...] = ()


def read_python_setup(folder: Path) -> PythonSetup:
    """Return the packages and scripts in ``folder``/setup.py. Raise BuildError, with the line, if running the file fails."""
    file = folder / "setup.py"
    given = _run(file)
    roots = _given(file, given, "package_dir", dict, "{'': 'src'}")
    names = [name for name in _names(file, given, "packages") if name and "." not in name]
    packages = {name: folder / roots.get(name, f"{roots.get('', '.')}/{name}") for name in names}
    modules = {
        name: folder / roots.get("", ".") / f"{name}.py"
        for name in _names(file, given, "py_modules")
        if "." not in name
    }
    scripts = tuple(folder / name for name in _names(file, given, "scripts"))
    for name, path in [*modules.items(), *((path.name, path) for path in scripts)]:
        if not path.exists():
            raise BuildError(str(file), 0, f"[{name}] is named, but {path} does not exist")

    missing = {name: path for name, path in packages.items() if not path.exists()}
    return PythonSetup(
        {name: path for name, path in packages.items() if name not in missing},
        modules,
        scripts,
        tuple(
            f"{file}: packages=[...] names [{name}], but folder {path} does not exist"
            for name, path in missing.items()
        ),
    )


def _given(file: Path, given: Mapping[str, object], name: str, kind: type[_Kind], form: str) -> _Kind:
    """Return the argument ``name`` of ``setup()``; if it is missing or None, return an empty ``kind``.

    Raise BuildError if its type is wrong.
    """
    value = given.get(name) or kind()
    if not isinstance(value, kind):
        raise BuildError(str(file), 0, f"{name} is {value!r}: {name}={form} is its form")
    return value


def _names(file: Path, given: Mapping[str, object], name: str) -> list[str]:
    value = given.get(name)
    if isinstance(value, (tuple, set)):
        value = sorted(value)
    return [str(each) for each in _given(file, {name: value}, name, list, "['a', 'b']")]


def _run(file: Path) -> Mapping[str, object]:
    """Run a setup.py; return the arguments that it passes to ``setup()``. Raise BuildError if it fails."""
    given: dict[str, object] = {}
    why = ""

    with _stand_ins(given, file.parent):
        try:
            code = compile(file.read_bytes(), str(file), "exec")
            exec(code, {"__name__": "__main__", "__file__": str(file)})
        except SystemExit as error:
            why = f": it ended with {error}" if error.code else ""
        except SyntaxError as error:
            raise BuildError(str(file), error.lineno or 0, f"not Python: {error.msg}") from error
        except Exception as error:
            lines = [
                frame.lineno
                for frame in traceback.extract_tb(error.__traceback__)
                if frame.filename == str(file)
            ]
            raise BuildError(
                str(file), (lines or [0])[-1] or 0, f"{type(error).__name__}: {error}"
            ) from error

    if not given:
        raise BuildError(str(file), 0, f"setup() was not called{why}")
    return given


class _StandIn(types.ModuleType):
    """A module that has every attribute. Attributes that were not set are empty classes."""

    def __getattr__(self, name: str) -> type:
        if name.startswith("__"):
            raise AttributeError(name)
        return type(name, (), {})


class _Finder(MetaPathFinder, Loader):
    """Provides stand-ins for the build tools that a setup.py may import."""

    def __init__(self, contents: Mapping[str, Mapping[str, object]]) -> None:
        self._contents = contents

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        return ModuleSpec(name, self, is_package=True) if name.split(".", maxsplit=1)[0] in _TOOLS else None

    def create_module(self, spec: ModuleSpec) -> types.ModuleType:
        return _StandIn(spec.name)

    def exec_module(self, module: types.ModuleType) -> None:
        module.__dict__.update(self._contents.get(module.__name__, {}))
        for name in self._contents:
            parent, _, child = name.rpartition(".")
            if parent == module.__name__:
                # Without this, `from catkin_pkg import python_setup` would import an empty class.
                setattr(module, child, importlib.import_module(name))


_TOOLS = {"catkin_pkg", "distutils", "setuptools"}


@contextmanager
def _stand_ins(given: dict[str, object], folder: Path) -> Iterator[None]:
    """Replace modules that a setup.py imports, so that ``setup`` records its arguments. Work in ``folder``.

    As in a script, modules in the file's folder can be imported; they are unloaded afterwards.
    """

    def setup(**arguments: object) -> None:
        given.update({"name": None, **arguments})

    def generate_distutils_setup(package_xml_path: str = "", **arguments: object) -> dict[str, object]:
        return {**_metadata(folder), **arguments}

    def find_packages(
        where: str = ".", exclude: Iterable[str] = (), include: Iterable[str] = ("*",)
    ) -> list[str]:
        found = []
        for path in sorted((folder / where).rglob("__init__.py")):
            name = ".".join(path.parent.relative_to(folder / where).parts)
            chosen = any(fnmatch.fnmatchcase(name, each) for each in include)
            if name and chosen and not any(fnmatch.fnmatchcase(name, each) for each in exclude):
                found.append(name)
        return found

    finder = _Finder(
        {
            "catkin_pkg.python_setup": {"generate_distutils_setup": generate_distutils_setup},
            "distutils.core": {"setup": setup},
            "setuptools": {
                "setup": setup,
                "find_packages": find_packages,
                "find_namespace_packages": find_packages,
            },
        }
    )
    before, path_before, modules_before = os.getcwd(), sys.path[:], sys.modules.copy()
    unset = VARIABLES.keys() - os.environ.keys()
    for name in modules_before:
        if name.split(".")[0] in _TOOLS:
            del sys.modules[name]
    sys.meta_path.insert(0, finder)
    sys.path.insert(0, str(folder))
    os.chdir(folder)
    # Set variables that catkin's build sets, because they are unset if no setup.bash has been sourced.
    os.environ.update({name: VARIABLES[name] for name in unset})
    try:
        yield
    finally:
        for name in unset:
            os.environ.pop(name, None)
        os.chdir(before)
        sys.path[:] = path_before
        sys.meta_path.remove(finder)
        for name in sys.modules.keys() - modules_before.keys():
            file = getattr(sys.modules[name], "__file__", None)
            if name.split(".")[0] in _TOOLS or (file and Path(file).is_relative_to(folder)):
                del sys.modules[name]
        sys.modules.update(modules_before)


def _metadata(folder: Path) -> dict[str, str]:
    """Return the metadata in a package's package.xml, keyed by the names of ``setup()``'s arguments."""
    manifest = read_manifest(folder)
    return {
        "name": manifest.name,
        "version": manifest.version,
        "description": manifest.description,
        "license": ", ".join(manifest.licenses),
        "maintainer": ", ".join(person.name for person in manifest.maintainers),
        "author": ", ".join(person.name for person in manifest.authors),
    }
