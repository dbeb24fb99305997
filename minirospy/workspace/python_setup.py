"""What a package's setup.py names: Python packages, modules and scripts.

The file is run, with a ``setup()`` that only listens: so it may compute what it likes, and needs neither setuptools
nor catkin_pkg. Source: http://docs.ros.org/en/noetic/api/catkin/html/user_guide/setup_dot_py.html.
"""

from __future__ import annotations

import os
import sys
import traceback
import types
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from minirospy.errors import BuildError

__all__ = ["PythonSetup", "read_python_setup"]


class PythonSetup(NamedTuple):
    """Names -> where they lie: top-level packages (folders), modules (files); scripts (files)."""

    packages: dict[str, Path]
    modules: dict[str, Path]
    scripts: tuple[Path, ...]


def read_python_setup(folder: Path) -> PythonSetup:
    """What ``folder``/setup.py names. Raises BuildError with its line."""
    file = folder / "setup.py"
    given = _run(file)
    roots: dict[str, str] = given.get("package_dir") or {}
    names = [name for name in given.get("packages") or [] if "." not in name]
    packages = {name: folder / roots.get(name, f"{roots.get('', '.')}/{name}") for name in names}
    modules = {
        name: folder / roots.get("", ".") / f"{name}.py"
        for name in given.get("py_modules") or []
        if "." not in name
    }
    scripts = tuple(folder / name for name in given.get("scripts") or [])
    for name, path in [*packages.items(), *modules.items(), *((path.name, path) for path in scripts)]:
        if not path.exists():
            raise BuildError(str(file), 0, f"[{name}] is named, but there is no {path}")
    return PythonSetup(packages, modules, scripts)


def _run(file: Path) -> dict[str, Any]:
    """Run a setup.py; the arguments of its ``setup()``."""
    given: dict[str, Any] = {}
    with _stand_ins(given, file.parent):
        try:
            code = compile(file.read_bytes(), str(file), "exec")
            exec(code, {"__name__": "__main__", "__file__": str(file)})
        except SystemExit:
            pass
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
    return given


@contextmanager
def _stand_ins(given: dict[str, Any], folder: Path) -> Iterator[None]:
    """Modules that a setup.py imports, with a ``setup`` that notes its arguments; the folder is the current one."""

    def setup(**arguments: Any) -> None:
        given.update(arguments)

    def generate_distutils_setup(package_xml_path: str = "", **arguments: Any) -> dict[str, Any]:
        return arguments

    def find_packages(where: str = ".", exclude: Any = (), include: Any = ("*",)) -> list[str]:
        found = []
        for path in sorted((folder / where).rglob("__init__.py")):
            parts = path.parent.relative_to(folder / where).parts
            if parts:
                found.append(".".join(parts))
        return found

    contents: dict[str, dict[str, Any]] = {
        "catkin_pkg": {},
        "catkin_pkg.python_setup": {"generate_distutils_setup": generate_distutils_setup},
        "distutils": {},
        "distutils.core": {"setup": setup},
        "setuptools": {
            "setup": setup,
            "find_packages": find_packages,
            "find_namespace_packages": find_packages,
        },
    }
    kept = {name: sys.modules.get(name) for name in contents}
    before = os.getcwd()
    for name, names in contents.items():
        module = types.ModuleType(name)
        module.__dict__.update(names)
        sys.modules[name] = module
    sys.modules["catkin_pkg"].__dict__["python_setup"] = sys.modules["catkin_pkg.python_setup"]
    sys.modules["distutils"].__dict__["core"] = sys.modules["distutils.core"]
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)
        for name, module_before in kept.items():
            if module_before is None:
                del sys.modules[name]
            else:
                sys.modules[name] = module_before
