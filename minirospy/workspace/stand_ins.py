"""Replace a workspace package's compiled parts with programs and modules of minirospy's package of the same name.

A package in a workspace hides minirospy's package with the same name. If the package's CMakeLists.txt compiles a program or
a Python module that minirospy has, the build writes a file to devel that runs minirospy's program or module.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from minirospy.workspace.packages import Packages, built_in_roots, package_name
from minirospy.workspace.plan import Plan

__all__ = ["StandIns", "find_stand_ins"]

_OVERLAY = Path(__file__).parents[1] / "overlay"


class StandIns(NamedTuple):
    """minirospy's programs and modules that replace a package's compiled ones.

    ``programs`` is keyed by program name; ``modules`` is keyed by dotted name, and includes the enclosing packages.
    """

    programs: dict[str, Path]
    modules: dict[str, Path]

    def names(self) -> str:
        """Return the names for display, or "" if there are none. Omit the enclosing packages, which are not replaced."""
        inner = [name for name, path in self.modules.items() if path.name != "__init__.py"]
        return ", ".join([*self.programs, *inner])


def find_stand_ins(plan: Plan) -> StandIns:
    """Return the programs and modules that replace the skipped targets of a package."""
    if not plan.compiled:
        return StandIns({}, {})
    return StandIns(dict(_programs(plan)), dict(_modules(plan)))


def _programs(plan: Plan) -> Iterator[tuple[str, Path]]:
    folder = next((root / plan.name for root in built_in_roots() if package_name(root / plan.name)), None)
    if folder is None or folder == plan.folder:
        return
    packages = Packages.below(folder)
    there = set(packages.executables(plan.name))
    for name in plan.compiled:
        if name in there:
            *_, program = packages.find_executable(plan.name, name)
            # Use only files in minirospy's folder, because a sourced workspace contains the stub from the previous build.
            if Path(program).is_relative_to(folder):
                yield name, Path(program)


def _modules(plan: Plan) -> Iterator[tuple[str, Path]]:
    """Yield the modules that replace extension modules, each after its enclosing packages (without the top-level package)."""
    top = _OVERLAY / plan.name
    for path in sorted(top.rglob("*.py")):
        if path.stem in plan.compiled and path.parent.name != "__pycache__":
            for package in reversed([each for each in path.parents if top in each.parents]):
                yield _dotted(package), package / "__init__.py"
            yield _dotted(path.with_suffix("")), path


def _dotted(path: Path) -> str:
    return ".".join(path.relative_to(_OVERLAY).parts)
