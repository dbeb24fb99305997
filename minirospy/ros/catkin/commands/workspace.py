"""Code shared by catkin_make and catkin: lists a workspace's folders; builds, installs and removes packages."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from minirospy.base.errors import NotFoundError
from minirospy.workspace.build import Report, Workspace, build, read_plans, write_set_up
from minirospy.workspace.download import download
from minirospy.workspace.packages import Packages
from minirospy.workspace.plan import Plan

__all__ = [
    "TEST_TARGETS",
    "build_packages",
    "cmake_variables",
    "install_packages",
    "remove_built",
    "spaces",
    "without_cmake",
]

TEST_TARGETS = {"run_tests", "test", "tests"}


def without_cmake(words: Sequence[str]) -> list[str]:
    """Remove CMake arguments from ``words``; :func:`cmake_variables` parses them."""
    return [word for word in words if not word.startswith(("-D", "-W", "-G"))]


def cmake_variables(words: Sequence[str]) -> dict[str, str]:
    """Return the variables set by ``-DNAME=VALUE`` and ``-DNAME:TYPE=VALUE``."""
    pairs = [word[2:].partition("=") for word in words if word.startswith("-D")]
    return {name.partition(":")[0]: value for name, equals, value in pairs if equals}


def spaces(workspace: Workspace) -> list[tuple[str, Path]]:
    """Return the names and paths of a workspace's folders."""
    return [
        ("Source space", workspace.source),
        ("Build space", workspace.build),
        ("Devel space", workspace.devel),
        ("Install space", workspace.install),
    ]


def build_packages(
    workspace: Workspace,
    chosen: Collection[str],
    with_deps: Collection[str] = (),
    variables: Mapping[str, str] = MappingProxyType({}),
) -> list[Plan]:
    """Build the chosen packages (default: all) and print a line for each. Return the plans for all packages."""
    white = [name for name in variables.get("CATKIN_WHITELIST_PACKAGES", "").split(";") if name]
    plans = read_plans(workspace.source, {**_places(workspace), **variables})
    names = {plan.name for plan in plans}
    for name in (*chosen, *with_deps, *white):
        if name not in names:
            known = {*names, "clean", "install", *TEST_TARGETS}
            raise NotFoundError("package", name, known, f"the workspace is {workspace.root}")
    only = {*chosen, *white, *_with_dependencies(plans, with_deps)}
    done = 0
    count = len(only or plans)

    def show(report: Report) -> None:
        nonlocal done
        done += 1
        what = report.made or ("nothing to generate" if not report.plan.definitions else "up to date")
        print(f"[{100 * done // count:3d}%] {report.plan.name}: {what}", flush=True)
        if report.plan.skipped:
            print(
                f"       {report.plan.name}: skipped, they need a C++ compiler: {', '.join(report.plan.skipped)}"
            )
        download(report.plan, (each for each in report.plan.downloads if not each.for_tests))
        if report.stand_ins:
            print(f"       {report.plan.name}: minirospy's own are used instead: {report.stand_ins}")
        for warning in report.warnings:
            print(f"WARNING: {warning}", file=sys.stderr)

    # Like catkin, write the setup files first, so that users can source the workspace even after a failed build.
    write_set_up(workspace.devel, (workspace.source,))
    build(workspace, plans, Packages(), only or None, show)
    if not plans:
        print(f"There are no packages in {workspace.source} yet")
    return plans


def _places(workspace: Workspace) -> dict[str, str]:
    """Return the CMake variables that hold the workspace's folders."""
    devel, build = workspace.devel.as_posix(), workspace.build.as_posix()
    return {"CATKIN_DEVEL_PREFIX": devel, "CMAKE_BINARY_DIR": build}


def _with_dependencies(plans: Sequence[Plan], names: Collection[str]) -> set[str]:
    by_name = {plan.name: plan for plan in plans}
    found: set[str] = set()
    waiting = list(names)
    while waiting:
        name = waiting.pop()
        if name in by_name and name not in found:
            found.add(name)
            waiting += by_name[name].manifest.depends()
    return found


def install_packages(workspace: Workspace, plans: Sequence[Plan]) -> None:
    """Install the built packages."""
    from minirospy.workspace.install import install

    for plan in plans:
        count = install(workspace, plan)
        print(f"-- Installed {plan.name}: {count} files")
    write_set_up(workspace.install, (workspace.install / "share",))


def remove_built(workspace: Workspace) -> None:
    """Delete the folders created by a build."""
    for folder in (workspace.build, workspace.devel, workspace.install):
        if folder.is_dir() and ((folder / ".catkin").is_file() or (folder / "minirospy").is_dir()):
            shutil.rmtree(folder)
            print(f"Removed {folder}")
