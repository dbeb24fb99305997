"""`catkin_make install`: copy the files that a package needs at run time to the install folder."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

from minirospy.base.errors import BuildError
from minirospy.workspace.build import Workspace, stand_in_files
from minirospy.workspace.packages import DIST_PACKAGES
from minirospy.workspace.plan import Install, Plan
from minirospy.workspace.python_setup import read_python_setup
from minirospy.workspace.stand_ins import find_stand_ins

__all__ = ["install"]

_SHEBANG = re.compile(rb"^#!\s*\S*/(?:env\s+)?python[\d.]*\s*$")


def install(workspace: Workspace, plan: Plan) -> int:
    """Copy the files that a package installs; return their number.

    Raise BuildError if a folder exists where a file belongs.
    """
    copies = dict(_copies(workspace, plan))
    for target, (source, program) in copies.items():
        if target.is_symlink() or target.is_dir():
            raise BuildError(str(target), 0, "is where a file is to be installed")
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, target)
        if program:
            target.chmod(target.stat().st_mode | 0o111)
    return len(copies)


def _copies(workspace: Workspace, plan: Plan) -> Iterator[tuple[Path, tuple[Path, bool]]]:
    """Yield (target, (source, whether to make the target executable)) for each file to install."""
    share = workspace.install / "share" / plan.name
    modules = workspace.install / DIST_PACKAGES
    yield share / "package.xml", (plan.folder / "package.xml", False)
    for path in plan.definitions:
        if path in plan.not_installed:
            continue
        yield share / path.suffix[1:] / path.name, (path, False)

    built = workspace.devel / DIST_PACKAGES / plan.name
    if plan.definitions or plan.options:
        for path in _files(built):
            yield modules / plan.name / path.relative_to(built), (path, False)

    if plan.has_setup:
        setup = read_python_setup(plan.folder)
        for name, folder in setup.packages.items():
            for path in _files(folder):
                yield modules / name / path.relative_to(folder), (path, False)
        for name, path in setup.modules.items():
            yield modules / f"{name}.py", (path, False)
        for path in setup.scripts:
            yield workspace.install / "bin" / path.name, (path, True)

    stand_ins = find_stand_ins(plan)
    for path in stand_in_files(plan, stand_ins, workspace.devel):
        yield workspace.install / path.relative_to(workspace.devel), (path, path.name in stand_ins.programs)

    for rule in plan.installs:
        yield from _rule(workspace, plan, rule)


def _rule(workspace: Workspace, plan: Plan, rule: Install) -> Iterator[tuple[Path, tuple[Path, bool]]]:
    rule = rule._replace(sources=tuple(name for name in rule.sources if not _is_compiled(workspace, name)))
    rule.check(plan.folder)
    place = workspace.install / rule.destination
    for name in rule.sources:
        source = plan.folder / name
        if source.is_file():
            yield place / (rule.rename or source.name), (source, rule.program)
            continue
        # As in CMake, a trailing slash means the contents of a folder, no slash means the folder itself.
        target = place if name.endswith("/") else place / source.name
        for path in _files(source):
            below = path.relative_to(source)
            # A pattern may exclude a file by its own name or by the name of a folder above it.
            parents = [f"/{each.as_posix()}" for each in (below, *below.parents)]
            left_out = any(re.search(pattern, parent) for pattern in rule.excluded for parent in parents)
            if not left_out and (not rule.chosen or any(re.search(each, parents[0]) for each in rule.chosen)):
                yield target / below, (path, _is_script(path))


def _is_compiled(workspace: Workspace, name: str) -> bool:
    """Return whether a missing file is one that CMake or a compiler would generate.

    ``name`` is then a generator expression, or a file that is missing in the build or devel folder.
    """
    made = Path(name)
    folders = (workspace.build, workspace.devel)
    return name.startswith("$<") or (not made.exists() and any(map(made.is_relative_to, folders)))


def _files(folder: Path) -> Iterator[Path]:
    for path in sorted(folder.rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts:
            yield path


def _is_script(path: Path) -> bool:
    if os.access(path, os.X_OK):
        return True
    with path.open("rb") as file:
        return bool(_SHEBANG.match(file.readline(200)))
