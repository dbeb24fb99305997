"""catkin_make: build workspaces without CMake.

catkin_make_isolated differs from catkin_make only in its folder names: without CMake, packages cannot conflict.
Source: http://wiki.ros.org/catkin/commands/catkin_make.
"""

from __future__ import annotations

import re
import shlex
import shutil
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from minirospy.base.errors import BuildError, UsageError
from minirospy.command.command import INTERRUPTED
from minirospy.command.parser import Parser
from minirospy.command.verbs import Command
from minirospy.ros.catkin.commands.create import TOP_LEVEL
from minirospy.ros.catkin.commands.workspace import (
    TEST_TARGETS,
    build_packages,
    cmake_variables,
    install_packages,
    remove_built,
    spaces,
    without_cmake,
)
from minirospy.workspace.build import Workspace

__all__ = ["MAKE", "MAKE_ISOLATED", "catkin_make", "catkin_make_isolated"]

_GENERATED = re.compile(r"_(generate_messages(_\w+)?|gencfg|gencpp|genpy)$")


def catkin_make(argv: Sequence[str] | None = None) -> int:
    """Run catkin_make; return its exit status."""
    return MAKE.main(argv)


def catkin_make_isolated(argv: Sequence[str] | None = None) -> int:
    """Run catkin_make_isolated; return its exit status."""
    return MAKE_ISOLATED.main(argv)


class _MakeParser(Parser):
    """A parser that removes CMake arguments and returns the variables they set as the argument ``variables``."""

    def parse(self, words: Sequence[str]) -> dict[str, object]:
        """Parse the arguments to a dict keyed by name. Raise CommandLineError if an argument is invalid."""
        return {**super().parse(without_cmake(words)), "variables": cmake_variables(words)}


def _parser(command: str, suffix: str) -> Parser:
    parser = _MakeParser(
        command,
        f"Build a workspace: generate its messages, and devel{suffix}/setup.bash to source. "
        "Run it in the folder above src.",
    )

    add = parser.add_argument
    add(
        "targets",
        nargs="*",
        default=[],
        help="install, run_tests, test, clean, or a package; none: build everything",
        completer="build_targets",
    )
    add(
        "-C",
        "--directory",
        type=Path,
        default=Path(),
        help="the workspace (default: here)",
        completer="folders",
    )

    add("--source", default="src", help="the folder of packages (default: src)", completer="folders")
    for option, name in (("--build", "build"), ("--devel", "devel"), ("--install-space", "install")):
        add(
            option,
            default=name + suffix,
            help=f"the folder {name}{suffix} by another name",
            completer="folders",
        )

    add("--install", action="store_true", help="install what was built")
    add("--pkg", nargs="+", metavar="PKG", help="build these packages only", completer="package_names")
    add(
        "--only-pkg-with-deps",
        nargs="+",
        metavar="PKG",
        help="these and what they depend on",
        completer="package_names",
    )
    add("--force-cmake", action="store_true", help="make everything again")

    for flags in (("--no-color",), ("--merge",), ("-v", "--verbose"), ("-k", "--keep-going")):
        parser.accept(*flags, help="accepted for compatibility, without effect")
    parser.accept("--override-build-tool-check", help="accepted")
    parser.accept("--use-ninja", "--use-gmake", "--use-nmake", help="accepted; make is not used")
    parser.accept("-j", "--jobs", nargs="?", help="accepted: there is nothing to wait for")
    parser.accept("-l", "--load-average", nargs="?", help="accepted")
    parser.accept(
        "--cmake-args", nargs="*", help="-DNAME=VALUE: what CMakeLists.txt sees as ${NAME}; also without this"
    )
    for option in ("--make-args", "--catkin-make-args"):
        parser.accept(option, nargs="*", help="accepted; make is not used")
    return parser


def _catkin_make(
    command: str,
    suffix: str,
    *,
    targets: Sequence[str],
    directory: Path,
    source: str,
    build: str,
    devel: str,
    install_space: str,
    install: bool,
    pkg: Sequence[str] | None,
    only_pkg_with_deps: Sequence[str] | None,
    force_cmake: bool,
    variables: dict[str, str],
) -> int:
    """Build a workspace whose folder names end in ``suffix``."""
    root = directory.resolve()
    if not root.is_dir():
        raise UsageError(f"folder {directory} does not exist")
    workspace = Workspace(
        root,
        root / source,
        root / build,
        root / variables.get("CATKIN_DEVEL_PREFIX", devel),
        root / variables.pop("CMAKE_INSTALL_PREFIX", install_space),
    )
    _check_folders(command, workspace)
    for name, folder in (("Base path", root), *spaces(workspace)):
        print(f"{name}: {folder}")
    if not suffix:
        _mark_top_level(workspace)

    if "clean" in targets:
        remove_built(workspace)
        return 0
    if force_cmake:
        shutil.rmtree(workspace.build / "minirospy", ignore_errors=True)

    tests = [target for target in targets if target.startswith("run_tests_")]
    others = {"all", "install", *TEST_TARGETS, *tests}
    # Words with "=", such as VERBOSE=1, set make variables. A target that generates messages stands for its whole package.
    named = [_GENERATED.sub("", word) for word in targets if word not in others and "=" not in word]
    chosen = [*(pkg or []), *named]
    plans = build_packages(workspace, chosen, only_pkg_with_deps or (), variables)
    if "install" in targets or install:
        install_packages(workspace, plans)

    if tests or TEST_TARGETS & set(targets):
        from minirospy.ros.catkin.commands.run_tests import run_tests

        tested = [*chosen, *(target.removeprefix("run_tests_") for target in tests)]
        return run_tests(workspace, plans, tested)
    return 0


def _check_folders(command: str, workspace: Workspace) -> None:
    """Raise BuildError if the folder is not a workspace."""
    if not workspace.source.is_dir():
        raise BuildError(
            str(workspace.source),
            0,
            f"The specified source space does not exist: {_where_to_build(command, workspace)}",
        )
    if (workspace.root / "package.xml").is_file():
        raise BuildError(
            str(workspace.root), 0, "is a package, not a workspace: go to the folder above its src"
        )


def _where_to_build(command: str, workspace: Workspace) -> str:
    """Return advice on where to build if the workspace has no folder src.

    Usually, the current folder is src or devel itself.
    """
    for above in workspace.root.parents:
        source = above / workspace.source.name
        if workspace.root.is_relative_to(source) or (
            source.is_dir() and (above / ".catkin_workspace").is_file()
        ):
            return f"`cd {shlex.quote(str(above))}` first, the workspace's folder"
    return f"run {command} in the folder above src, or `mkdir src` first"


def _mark_top_level(workspace: Workspace) -> None:
    """Write the files that mark a folder as a workspace, for minirospy and for catkin."""
    marker = workspace.root / ".catkin_workspace"
    if not marker.exists() and not (workspace.root / ".catkin_tools").exists():
        marker.write_text("# This file marks the top of a catkin workspace\n", encoding="utf-8")
    file = workspace.source / "CMakeLists.txt"
    if not file.exists() and not file.is_symlink():
        file.write_text(TOP_LEVEL, encoding="utf-8")
        print(f'Creating file "{file}"')


MAKE = Command(
    "catkin_make", partial(_parser, "catkin_make", ""), partial(_catkin_make, "catkin_make", ""), INTERRUPTED
)
MAKE_ISOLATED = Command(
    "catkin_make_isolated",
    partial(_parser, "catkin_make_isolated", "_isolated"),
    partial(_catkin_make, "catkin_make_isolated", "_isolated"),
    INTERRUPTED,
)
