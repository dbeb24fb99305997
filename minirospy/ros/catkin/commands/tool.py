"""catkin, the command of catkin_tools: build workspaces without CMake.

Source: https://catkin-tools.readthedocs.io/.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from minirospy.base.errors import BuildError, NotFoundError, UsageError
from minirospy.command.command import INTERRUPTED
from minirospy.command.parser import Parser
from minirospy.command.verbs import Family, Verb
from minirospy.ros.catkin.commands.create import create_package_here, create_parser
from minirospy.ros.catkin.commands.workspace import (
    build_packages,
    cmake_variables,
    install_packages,
    remove_built,
    spaces,
    without_cmake,
)
from minirospy.workspace.build import Workspace, find_workspace, read_plans

__all__ = ["CATKIN", "catkin"]

_SETTINGS = ".catkin_tools/minirospy.json"
_LISTS = {"blacklist": "are not", "whitelist": "alone are"}
_ACCEPTED = """
    -c --continue-on-failure -s --summarize --no-summarize -v --verbose -i --interleave-output --force-cmake --no-status
    --no-color --no-notify --pre-clean --limit-status-rate --unbuilt --env-cache --no-env-cache --jobserver --no-jobserver
""".split()  # noqa: SIM905
"""Options of `catkin build` that only affect compilation; accepted for compatibility."""


def catkin(argv: Sequence[str] | None = None) -> int:
    """Run catkin; return its exit status."""
    return CATKIN.main(argv)


class _Settings(NamedTuple):
    """The settings that `catkin config` saves for `catkin build`; None means not set."""

    install: bool | None = None
    blacklist: Sequence[str] | None = None
    whitelist: Sequence[str] | None = None
    cmake_args: Sequence[str] | None = None

    @classmethod
    def read(cls, workspace: Workspace) -> _Settings:
        """Return a workspace's settings; empty settings if the file is missing or invalid."""
        try:
            found = json.loads((workspace.root / _SETTINGS).read_bytes())
        except (OSError, ValueError):
            return cls()
        if not isinstance(found, dict):
            return cls()
        return cls(**{name: found[name] for name in cls._fields if name in found})

    def updated(self, new: _Settings) -> _Settings:
        """Return a copy of these settings, overridden by those in ``new``."""
        return _Settings(
            self.install if new.install is None else new.install,
            self.blacklist if new.blacklist is None else new.blacklist,
            self.whitelist if new.whitelist is None else new.whitelist,
            self.cmake_args if new.cmake_args is None else new.cmake_args,
        )

    def write(self, workspace: Workspace) -> None:
        """Save the settings in the workspace."""
        given = {name: value for name, value in self._asdict().items() if value is not None}
        (workspace.root / ".catkin_tools").mkdir(exist_ok=True)
        (workspace.root / _SETTINGS).write_text(json.dumps(given, indent=1), encoding="utf-8")

    def variables(self) -> dict[str, str]:
        """Return the settings as CMake variables."""
        return {
            **cmake_variables(self.cmake_args or ()),
            "CATKIN_WHITELIST_PACKAGES": ";".join(self.whitelist or ()),
            "CATKIN_BLACKLIST_PACKAGES": ";".join(self.blacklist or ()),
        }


class _CatkinParser(Parser):
    """A verb's parser. Removes CMake arguments, and returns those starting with -D as the argument ``cmake_words``."""

    def __init__(self, verb: str, description: str, *, takes_cmake_words: bool = False) -> None:
        super().__init__(f"catkin {verb}", description)
        self._takes_cmake_words = takes_cmake_words
        self.add_argument(
            "-w",
            "--workspace",
            type=Path,
            help="the workspace (default: the one around this folder)",
            completer="folders",
        )

    def parse(self, words: Sequence[str]) -> dict[str, object]:
        """Parse the arguments to a dict keyed by name. Raise CommandLineError if an argument is invalid."""
        if not self._takes_cmake_words:
            return super().parse(words)
        options = super().parse(without_cmake(words))
        return {**options, "cmake_words": [word for word in words if word.startswith("-D")]}


def _workspace_of(folder: Path | None) -> Workspace:
    start = folder or Path.cwd()
    if not start.is_dir():
        raise UsageError(f"folder {start} does not exist")
    return Workspace.at(find_workspace(start))


def _this_package() -> str:
    from minirospy.workspace.manifest import read_manifest

    here = Path.cwd()
    for folder in (here, *here.parents):
        if (folder / "package.xml").is_file():
            return read_manifest(folder).name
    raise UsageError("--this: the current folder is not in a package")


def _build_parser() -> Parser:
    parser = _CatkinParser("build", "Build packages in a workspace.", takes_cmake_words=True)
    _add_packages(parser, "these and what they depend on (default: all)")
    parser.add_argument("--no-deps", action="store_true", help="not what they depend on")
    parser.add_argument("-n", "--dry-run", action="store_true", help="only list what would be built")
    for flags in (
        ("-j", "--jobs"),
        ("-p", "--parallel-packages"),
        ("-l", "--load-average"),
        ("--mem-limit",),
    ):
        parser.accept(*flags, nargs="?", help="accepted: there is nothing to wait for")
    parser.accept("--start-with", nargs="?", help="accepted", completer="package_names")
    for flag in _ACCEPTED:
        parser.accept(flag, help="accepted")
    parser.accept("--cmake-args", nargs="*", help="-DNAME=VALUE: what CMakeLists.txt sees as ${NAME}")
    for flag in ("--make-args", "--catkin-make-args"):
        parser.accept(flag, nargs="*", help="accepted; make is not used")
    return parser


def _build(
    workspace: Path | None,
    packages: Sequence[str],
    this: bool,
    no_deps: bool,
    dry_run: bool,
    cmake_words: Sequence[str],
) -> int:
    place = _workspace_of(workspace)
    if not place.source.is_dir():
        raise BuildError(str(place.source), 0, "the workspace has no folder src: `mkdir src`")
    (place.root / ".catkin_tools").mkdir(exist_ok=True)
    settings = _Settings.read(place)
    variables = {**settings.variables(), **cmake_variables(cmake_words)}

    chosen = [*packages, *([_this_package()] if this else [])]
    if dry_run:
        for plan in read_plans(place.source, variables):
            print(f"- {plan.name}")
        return 0

    alone, with_deps = (chosen, []) if no_deps else ([], chosen)
    plans = build_packages(place, alone, with_deps, variables)
    if settings.install:
        install_packages(place, plans)
    print(f"[build] Done: source {(place.install if settings.install else place.devel) / 'setup.bash'}")
    return 0


def _clean_parser() -> Parser:
    parser = _CatkinParser("clean", "Delete the folders build, devel and install.")
    parser.add_argument("-y", "--yes", action="store_true", help="do not ask")
    parser.add_argument("--deinit", action="store_true", help="delete the folder .catkin_tools too")
    return parser


def _clean(workspace: Path | None, yes: bool, deinit: bool) -> int:
    place = _workspace_of(workspace)
    if not yes:
        question = f"Delete build, devel and install of {place.root}? [y/N] "
        answer = input(question) if sys.stdin.isatty() else ""
        if answer.strip().lower() not in ("y", "yes"):
            print("Nothing was deleted (`catkin clean -y` does not ask)")
            return 1

    remove_built(place)
    if deinit:
        shutil.rmtree(place.root / ".catkin_tools", ignore_errors=True)
    return 0


def _config_parser() -> Parser:
    parser = _CatkinParser(
        "config",
        "Show where a workspace's folders are; set what `catkin build` does.",
        takes_cmake_words=True,
    )

    add = parser.add_argument
    add("--install", action=argparse.BooleanOptionalAction, help="build also installs")
    for name, alias in (("blacklist", "skiplist"), ("whitelist", "buildlist")):
        add(
            f"--{name}",
            f"--{alias}",
            nargs="+",
            metavar="PKG",
            help=f"packages that {_LISTS[name]} built",
            completer="package_names",
        )
        add(
            f"--no-{name}",
            f"--no-{alias}",
            dest=name,
            action="store_const",
            const=[],
            help=f"no {name}",
        )

    add(
        "--cmake-args",
        nargs="*",
        help="-DNAME=VALUE: what CMakeLists.txt sees as ${NAME}",
        completer="nothing",
    )
    add(
        "--no-cmake-args",
        dest="cmake_args",
        action="store_const",
        const=[],
        help="nothing of the kind",
    )

    for flag in ("--init", "--merge-devel", "--link-devel", "--merge-install"):
        parser.accept(flag, help="accepted")
    parser.accept("--extend", nargs=None, help="accepted: what is sourced is what is extended")
    return parser


def _config(
    workspace: Path | None,
    install: bool | None,
    blacklist: Sequence[str] | None,
    whitelist: Sequence[str] | None,
    cmake_args: Sequence[str] | None,
    cmake_words: Sequence[str],
) -> int:
    place = _workspace_of(workspace)
    words = None if cmake_args is None else cmake_words
    asked = _Settings(install, blacklist, whitelist, words)
    kept = _Settings.read(place)
    settings = kept.updated(asked)
    if asked != _Settings():
        settings.write(place)

    for name, folder in (("Workspace", place.root), *spaces(place)):
        print(f"{name + ':':16} [{'exists' if folder.is_dir() else 'missing'}] {folder}")
    for name, value in settings._asdict().items():
        shown = " ".join(value) if isinstance(value, list) else value and "yes"
        print(f"{name.replace('_', ' ').capitalize() + ':':16} {shown or 'none'}")
    return 0


def _init_parser() -> Parser:
    parser = _CatkinParser("init", "Make a folder a workspace.")
    parser.accept("--reset", help="accepted")
    return parser


def _init(workspace: Path | None) -> None:
    root = (workspace or Path.cwd()).resolve()
    (root / ".catkin_tools").mkdir(parents=True, exist_ok=True)
    print(f"Initialized catkin workspace in {root}")


def _list_parser() -> Parser:
    parser = _CatkinParser("list", "List the packages of a workspace.")
    parser.add_argument("-u", "--unformatted", action="store_true", help="without the sign before each")
    return parser


def _list(workspace: Path | None, unformatted: bool) -> None:
    for plan in sorted(read_plans(_workspace_of(workspace).source), key=lambda plan: plan.name):
        print(plan.name if unformatted else f"- {plan.name}")


def _locate_parser() -> Parser:
    parser = _CatkinParser("locate", "Print the folder of a workspace or a package.")
    parser.add_argument("package", nargs="?", help="a package of the workspace", completer="package_names")
    for name in ("src", "build", "devel", "install"):
        parser.add_argument(
            f"-{name[0]}", f"--{name}", action="store_true", help=f"the workspace's folder {name}"
        )
    return parser


def _locate(
    workspace: Path | None, package: str | None, src: bool, build: bool, devel: bool, install: bool
) -> None:
    place = _workspace_of(workspace)
    for chosen, (_, folder) in zip((src, build, devel, install), spaces(place), strict=True):
        if chosen:
            print(folder)
            return
    if package is None:
        print(place.root)
        return

    plans = {plan.name: plan for plan in read_plans(place.source)}
    if package not in plans:
        raise NotFoundError("package", package, plans)
    print(plans[package].folder)


def _tests_parser() -> Parser:
    parser = _CatkinParser("test", "Build, and run the tests of packages.")
    _add_packages(parser, "default: all")
    for flag in ("-j", "--jobs", "-p", "--parallel-packages"):
        parser.accept(flag, nargs="?", help="accepted: one test runs after the other")
    for flag in ("-c", "--continue-on-failure", "-v", "--verbose", "-i", "--interleave-output", "--no-deps"):
        parser.accept(flag, help="accepted")
    return parser


def _run_tests(workspace: Path | None, packages: Sequence[str], this: bool) -> int:
    from minirospy.ros.catkin.commands.run_tests import run_tests

    place = _workspace_of(workspace)
    chosen = [*packages, *([_this_package()] if this else [])]
    return run_tests(place, build_packages(place, ()), chosen)


def _add_packages(parser: Parser, help: str) -> None:
    parser.add_argument("packages", nargs="*", default=[], help=help, completer="package_names")
    parser.add_argument("--this", action="store_true", help="the package around the current folder")


CATKIN = Family(
    "catkin",
    "catkin command",
    (
        Verb("build", "Build packages in a workspace", _build_parser, _build),
        Verb("clean", "Delete what was built", _clean_parser, _clean),
        Verb("config", "Show where a workspace's folders are", _config_parser, _config),
        Family(
            "catkin create",
            "",
            (
                Verb(
                    "pkg",
                    "Create a package",
                    partial(create_parser, "catkin create pkg"),
                    create_package_here,
                ),
            ),
            summary="Create a package: catkin create pkg NAME",
        ),
        Verb("init", "Make a folder a workspace", _init_parser, _init),
        Verb("list", "List the packages of a workspace", _list_parser, _list),
        Verb("locate", "Print the folder of a workspace or a package", _locate_parser, _locate),
        Verb("run_tests", "Run the tests of packages", _tests_parser, _run_tests),
        Verb("test", "Run the tests of packages", _tests_parser, _run_tests),
    ),
    interrupted=INTERRUPTED,
)
