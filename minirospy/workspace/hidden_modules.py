"""User files that hide a ROS package or module from `import`, because they have the same name and are found first."""

from __future__ import annotations

from pathlib import Path

import minirospy

__all__ = ["hiding_files", "warning_of_hiding_file"]

_OVERLAY = Path(minirospy.__file__).parent / "overlay"


def hiding_files(folder: Path) -> list[Path]:
    """Return the Python files and packages in ``folder`` that hide one of minirospy's modules by their name, sorted.

    Python searches the program's folder, or the current folder, before all others.
    """
    if folder.is_relative_to(_OVERLAY):
        return []
    try:
        names = {each.name.removesuffix(".py") for each in _OVERLAY.iterdir()}
        files = [each for each in folder.glob("*.py") if each.stem in names]
        packages = [each.parent for each in folder.glob("*/__init__.py") if each.parent.name in names]
    except OSError:
        return []
    return sorted([*files, *packages])


def warning_of_hiding_file(program: Path) -> str:
    """Return a warning if a file beside a program hides one of minirospy's modules, otherwise ""."""
    if program.suffix != ".py":
        return ""
    for file in hiding_files(program.parent):
        return f"{file} hides the module {file.stem} from `import {file.stem}`: give it another name"
    return ""
