"""catkin_make, catkin, catkin_create_pkg, catkin_init_workspace: workspaces without CMake.

catkin_make_isolated is catkin_make with folders of other names: packages that no compiler builds do not meet in CMake.
Source: http://wiki.ros.org/catkin/commands/catkin_make, https://catkin-tools.readthedocs.io/.
"""

from __future__ import annotations

import argparse
import getpass
import json
import re
import shlex
import shutil
import sys
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from minirospy.cli.command import INTERRUPTED, Parser, run, warn
from minirospy.cli.verbs import Family, Verb
from minirospy.errors import BuildError, NotFoundError, UsageError
from minirospy.workspace.build import Report, Workspace, build, find_workspace, read_plans, write_set_up
from minirospy.workspace.packages import Packages
from minirospy.workspace.plan import Plan

__all__ = ["catkin", "catkin_create_pkg", "catkin_init_workspace", "catkin_make", "catkin_make_isolated"]

_TOP_LEVEL = """# The top of a catkin workspace, for those who build it with CMake.
cmake_minimum_required(VERSION 3.0.2)
project(Project)
find_package(catkin REQUIRED)
catkin_workspace()
"""


def catkin_make(argv: Sequence[str] | None = None) -> int:
    """catkin_make; its exit status."""
    return run("catkin_make", lambda: _catkin_make("catkin_make", argv, ""), INTERRUPTED)


def catkin_make_isolated(argv: Sequence[str] | None = None) -> int:
    """catkin_make_isolated; its exit status."""
    name = "catkin_make_isolated"
    return run(name, lambda: _catkin_make(name, argv, "_isolated"), INTERRUPTED)


def catkin_init_workspace(argv: Sequence[str] | None = None) -> int:
    """catkin_init_workspace; its exit status."""

    def body() -> None:
        parser = Parser("catkin_init_workspace", description="Make a folder the source space of a workspace.")
        parser.add_argument(
            "folder", nargs="?", type=Path, default=Path(), help="default: the current folder"
        )
        options = parser.parse_args(argv)
        if not options.folder.is_dir():
            raise UsageError(f"there is no folder {options.folder}")
        file = options.folder.resolve() / "CMakeLists.txt"
        if file.exists():
            raise UsageError(f'File "{file}" already exists')
        file.write_text(_TOP_LEVEL, encoding="utf-8")
        print(f'Creating file "{file}"')

    return run("catkin_init_workspace", body)


def catkin_create_pkg(argv: Sequence[str] | None = None) -> int:
    """catkin_create_pkg; its exit status."""
    return run("catkin_create_pkg", lambda: _create("catkin_create_pkg", argv, Path.cwd()))


def catkin(argv: Sequence[str] | None = None) -> int:
    """catkin, the command of catkin_tools; its exit status."""
    verbs = (
        Verb("build", "Build packages in a workspace", _build),
        Verb("clean", "Delete what was built", _clean),
        Verb("config", "Show where a workspace's folders are", _config),
        Verb("create", "Create a package: catkin create pkg NAME", _create_verb),
        Verb("init", "Make a folder a workspace", _init),
        Verb("list", "List the packages of a workspace", _list),
        Verb("locate", "Print the folder of a workspace or a package", _locate),
        Verb("run_tests", "Run the tests of packages", _run_tests),
        Verb("test", "Run the tests of packages", _run_tests),
    )
    return Family("catkin", "catkin command", verbs, interrupted=INTERRUPTED).main(argv)


# --- catkin_make


_TESTS = {"run_tests", "test", "tests"}
_GENERATED = re.compile(r"_(generate_messages(_\w+)?|gencfg|gencpp|genpy)$")
_SETTINGS = ".catkin_tools/minirospy.json"
_LISTS = {"blacklist": "are not", "whitelist": "alone are"}


def _catkin_make(command: str, argv: Sequence[str] | None, suffix: str) -> int:
    """catkin_make, with folders whose names end in ``suffix``."""
    words = list(sys.argv[1:] if argv is None else argv)
    options = _make_parser(command, suffix).parse_args(_without_cmake(words))
    variables = _variables(words)
    root = options.directory.resolve()
    if not root.is_dir():
        raise UsageError(f"there is no folder {options.directory}")
    workspace = Workspace(
        root,
        root / options.source,
        root / options.build,
        root / variables.get("CATKIN_DEVEL_PREFIX", options.devel),
        root / variables.pop("CMAKE_INSTALL_PREFIX", options.install_space),
    )
    if not workspace.source.is_dir():
        raise BuildError(
            str(workspace.source),
            0,
            f"The specified source space does not exist: {_where_to_build(command, workspace)}",
        )
    if (root / "package.xml").is_file():
        raise BuildError(str(root), 0, "is a package, not a workspace: go to the folder above its src")
    for name, folder in (("Base path", root), *_spaces(workspace)):
        print(f"{name}: {folder}")
    if not suffix:
        _top_level(workspace)
    if "clean" in options.targets:
        _remove(workspace)
        return 0
    if options.force_cmake:
        shutil.rmtree(workspace.build / "minirospy", ignore_errors=True)
    tests = [target for target in options.targets if target.startswith("run_tests_")]
    others = {"all", "install", *_TESTS, *tests}
    # VERBOSE=1 is a variable of make; what generates messages is all of a package.
    targets = [_GENERATED.sub("", word) for word in options.targets if word not in others and "=" not in word]
    chosen = [*(options.pkg or []), *targets]
    plans = _built(workspace, chosen, options.only_pkg_with_deps or (), variables)
    if "install" in options.targets or options.install:
        _install(workspace, plans)
    if tests or _TESTS & set(options.targets):
        from minirospy.cli.catkin.run_tests import run_tests

        return run_tests(
            workspace, plans, [*chosen, *(target.removeprefix("run_tests_") for target in tests)]
        )
    return 0


def _where_to_build(command: str, workspace: Workspace) -> str:
    """What to do where there is no folder src: most often one stands in it, or in devel."""
    for above in workspace.root.parents:
        source = above / workspace.source.name
        if workspace.root.is_relative_to(source) or (
            source.is_dir() and (above / ".catkin_workspace").is_file()
        ):
            return f"`cd {shlex.quote(str(above))}` first, the workspace's folder"
    return f"run {command} in the folder above src, or `mkdir src` first"


def _make_parser(command: str, suffix: str) -> Parser:
    parser = Parser(
        command,
        description=f"Build a workspace: generate its messages, and devel{suffix}/setup.bash to source. "
        "Run it in the folder above src.",
    )
    parser.add_argument(
        "targets",
        nargs="*",
        default=[],
        help="install, run_tests, test, clean, or a package; none: build everything",
    )
    parser.add_argument("-C", "--directory", type=Path, default=Path(), help="the workspace (default: here)")
    parser.add_argument("--source", default="src", help="the folder of packages (default: src)")
    for option, name in (("--build", "build"), ("--devel", "devel"), ("--install-space", "install")):
        parser.add_argument(option, default=name + suffix, help=f"the folder {name}{suffix} by another name")
    parser.add_argument("--install", action="store_true", help="install what was built")
    parser.add_argument("--pkg", nargs="+", metavar="PKG", help="build these packages only")
    parser.add_argument(
        "--only-pkg-with-deps", nargs="+", metavar="PKG", help="these and what they depend on"
    )
    parser.add_argument("--force-cmake", action="store_true", help="make everything again")
    for flags in (("--no-color",), ("--merge",), ("-v", "--verbose"), ("-k", "--keep-going")):
        parser.add_argument(*flags, action="store_true", help="accepted: it is so anyway")
    parser.add_argument("--override-build-tool-check", action="store_true", help="accepted")
    parser.add_argument(
        "--use-ninja", "--use-gmake", "--use-nmake", action="store_true", help="accepted; there is no make"
    )
    parser.add_argument("-j", "--jobs", nargs="?", help="accepted: there is nothing to wait for")
    parser.add_argument("-l", "--load-average", nargs="?", help="accepted")
    parser.add_argument(
        "--cmake-args", nargs="*", help="-DNAME=VALUE: what CMakeLists.txt sees as ${NAME}; also without this"
    )
    for option in ("--make-args", "--catkin-make-args"):
        parser.add_argument(option, nargs="*", help="accepted; there is no make")
    return parser


def _without_cmake(words: Sequence[str]) -> list[str]:
    """Words without those that are meant for CMake: what these set is read by :func:`_variables`."""
    return [word for word in words if not word.startswith(("-D", "-W", "-G"))]


def _variables(words: Sequence[str]) -> dict[str, str]:
    """What ``-DNAME=VALUE`` and ``-DNAME:TYPE=VALUE`` set."""
    pairs = [word[2:].partition("=") for word in words if word.startswith("-D")]
    return {name.partition(":")[0]: value for name, equals, value in pairs if equals}


def _spaces(workspace: Workspace) -> list[tuple[str, Path]]:
    return [
        ("Source space", workspace.source),
        ("Build space", workspace.build),
        ("Devel space", workspace.devel),
        ("Install space", workspace.install),
    ]


def _top_level(workspace: Workspace) -> None:
    """What marks a folder as a workspace, for us and for real catkin."""
    marker = workspace.root / ".catkin_workspace"
    if not marker.exists() and not (workspace.root / ".catkin_tools").exists():
        marker.write_text("# This file marks the top of a catkin workspace\n", encoding="utf-8")
    file = workspace.source / "CMakeLists.txt"
    if not file.exists() and not file.is_symlink():
        file.write_text(_TOP_LEVEL, encoding="utf-8")
        print(f'Creating file "{file}"')


def _built(
    workspace: Workspace,
    chosen: Collection[str],
    with_deps: Collection[str] = (),
    variables: Mapping[str, str] = MappingProxyType({}),
) -> list[Plan]:
    """Build what was chosen, or all; say so, a line a package."""
    white = [name for name in variables.get("CATKIN_WHITELIST_PACKAGES", "").split(";") if name]
    plans = read_plans(workspace.source, variables)
    names = {plan.name for plan in plans}
    for name in (*chosen, *with_deps, *white):
        if name not in names:
            known = {*names, "clean", "install", *_TESTS}
            raise NotFoundError("package", name, known, f"the workspace is {workspace.root}")
    only = {*chosen, *white, *_with_dependencies(plans, with_deps)}
    done = 0
    count = len(only or plans)

    def say(report: Report) -> None:
        nonlocal done
        done += 1
        what = report.made or ("nothing to generate" if not report.plan.definitions else "up to date")
        print(f"[{100 * done // count:3d}%] {report.plan.name}: {what}", flush=True)
        if report.plan.skipped:
            print(
                f"       {report.plan.name}: skipped, they need a C++ compiler: {', '.join(report.plan.skipped)}"
            )
        for warning in report.warnings:
            print(f"WARNING: {warning}", file=sys.stderr)

    build(workspace, plans, Packages(), only or None, say)
    write_set_up(workspace.devel, (workspace.source,))
    if not plans:
        print(f"There are no packages in {workspace.source} yet")
    return plans


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


def _install(workspace: Workspace, plans: Sequence[Plan]) -> None:
    from minirospy.workspace.install import install

    for plan in plans:
        count = install(workspace, plan)
        print(f"-- Installed {plan.name}: {count} files")
    write_set_up(workspace.install, (workspace.install / "share",))


def _remove(workspace: Workspace) -> None:
    for folder in (workspace.build, workspace.devel, workspace.install):
        if folder.is_dir() and ((folder / ".catkin").is_file() or (folder / "minirospy").is_dir()):
            shutil.rmtree(folder)
            print(f"Removed {folder}")


# --- catkin


def _workspace_of(options_workspace: Path | None) -> Workspace:
    start = options_workspace or Path.cwd()
    if not start.is_dir():
        raise UsageError(f"there is no folder {start}")
    return Workspace.at(find_workspace(start))


def _parser(verb: str, description: str) -> Parser:
    parser = Parser(f"catkin {verb}", description=description)
    parser.add_argument(
        "-w", "--workspace", type=Path, help="the workspace (default: the one around this folder)"
    )
    return parser


def _this_package() -> str:
    from minirospy.workspace.manifest import read_manifest

    here = Path.cwd()
    for folder in (here, *here.parents):
        if (folder / "package.xml").is_file():
            return read_manifest(folder).name
    raise UsageError("--this: the current folder is not in a package")


_ACCEPTED = """
    -c --continue-on-failure -s --summarize --no-summarize -v --verbose -i --interleave-output --force-cmake --no-status
    --no-color --no-notify --pre-clean --limit-status-rate --unbuilt --env-cache --no-env-cache --jobserver --no-jobserver
""".split()  # noqa: SIM905
"""Options of `catkin build` that change nothing where nothing is compiled."""


def _build(argv: Sequence[str]) -> int:
    parser = _parser("build", "Build packages in a workspace.")
    parser.add_argument(
        "packages", nargs="*", default=[], help="these and what they depend on (default: all)"
    )
    parser.add_argument("--this", action="store_true", help="the package around the current folder")
    parser.add_argument("--no-deps", action="store_true", help="not what they depend on")
    parser.add_argument("-n", "--dry-run", action="store_true", help="only list what would be built")
    for flags in (
        ("-j", "--jobs"),
        ("-p", "--parallel-packages"),
        ("-l", "--load-average"),
        ("--mem-limit",),
        ("--start-with",),
    ):
        parser.add_argument(*flags, nargs="?", help="accepted: there is nothing to wait for")
    for flag in _ACCEPTED:
        parser.add_argument(flag, action="store_true", help="accepted")
    parser.add_argument("--cmake-args", nargs="*", help="-DNAME=VALUE: what CMakeLists.txt sees as ${NAME}")
    for flag in ("--make-args", "--catkin-make-args"):
        parser.add_argument(flag, nargs="*", help="accepted; there is no make")
    options = parser.parse_args(_without_cmake(argv))
    workspace = _workspace_of(options.workspace)
    if not workspace.source.is_dir():
        raise BuildError(str(workspace.source), 0, "the workspace has no folder src: `mkdir src`")
    (workspace.root / ".catkin_tools").mkdir(exist_ok=True)
    settings = _settings(workspace)
    variables = {
        **_variables([*settings.get("cmake_args", []), *argv]),
        **{
            f"CATKIN_{name.upper()}_PACKAGES": ";".join(settings.get(name, []))
            for name in ("whitelist", "blacklist")
        },
    }
    chosen = [*options.packages, *([_this_package()] if options.this else [])]
    if options.dry_run:
        for plan in read_plans(workspace.source, variables):
            print(f"- {plan.name}")
        return 0
    alone, with_deps = (chosen, []) if options.no_deps else ([], chosen)
    plans = _built(workspace, alone, with_deps, variables)
    if settings.get("install"):
        _install(workspace, plans)
    print(
        f"[build] Done: source {(workspace.install if settings.get('install') else workspace.devel) / 'setup.bash'}"
    )
    return 0


def _settings(workspace: Workspace) -> dict[str, Any]:
    """What `catkin config` keeps for `catkin build`."""
    try:
        found = json.loads((workspace.root / _SETTINGS).read_bytes())
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _clean(argv: Sequence[str]) -> int:
    parser = _parser("clean", "Delete the folders build, devel and install.")
    parser.add_argument("-y", "--yes", action="store_true", help="do not ask")
    parser.add_argument("--deinit", action="store_true", help="delete the folder .catkin_tools too")
    options = parser.parse_args(argv)
    workspace = _workspace_of(options.workspace)
    if not options.yes:
        answer = (
            input(f"Delete build, devel and install of {workspace.root}? [y/N] ")
            if sys.stdin.isatty()
            else ""
        )
        if answer.strip().lower() not in ("y", "yes"):
            print("Nothing was deleted (`catkin clean -y` does not ask)")
            return 1
    _remove(workspace)
    if options.deinit:
        shutil.rmtree(workspace.root / ".catkin_tools", ignore_errors=True)
    return 0


def _config(argv: Sequence[str]) -> int:
    parser = _parser("config", "Show where a workspace's folders are; set what `catkin build` does.")
    parser.add_argument("--install", action=argparse.BooleanOptionalAction, help="build also installs")
    for name, alias in (("blacklist", "skiplist"), ("whitelist", "buildlist")):
        parser.add_argument(
            f"--{name}", f"--{alias}", nargs="+", metavar="PKG", help=f"packages that {_LISTS[name]} built"
        )
        parser.add_argument(
            f"--no-{name}", f"--no-{alias}", dest=name, action="store_const", const=[], help=f"no {name}"
        )
    parser.add_argument("--cmake-args", nargs="*", help="-DNAME=VALUE: what CMakeLists.txt sees as ${NAME}")
    parser.add_argument(
        "--no-cmake-args", dest="cmake_args", action="store_const", const=[], help="nothing of the kind"
    )
    for flag in ("--init", "--merge-devel", "--link-devel", "--merge-install"):
        parser.add_argument(flag, action="store_true", help="accepted")
    parser.add_argument("--extend", help="accepted: what is sourced is what is extended")
    options = parser.parse_args(_without_cmake(argv))
    workspace = _workspace_of(options.workspace)
    if options.cmake_args is not None:
        options.cmake_args = [word for word in argv if word.startswith("-D")]
    names = ("install", "blacklist", "whitelist", "cmake_args")
    given = {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    settings = {**_settings(workspace), **given}
    if given:
        (workspace.root / ".catkin_tools").mkdir(exist_ok=True)
        (workspace.root / _SETTINGS).write_text(json.dumps(settings, indent=1), encoding="utf-8")
    for name, folder in (("Workspace", workspace.root), *_spaces(workspace)):
        print(f"{name + ':':16} [{'exists' if folder.is_dir() else 'missing'}] {folder}")
    for name in names:
        value = settings.get(name)
        shown = " ".join(value) if isinstance(value, list) else value and "yes"
        print(f"{name.replace('_', ' ').capitalize() + ':':16} {shown or 'none'}")
    return 0


def _create_verb(argv: Sequence[str]) -> int:
    package = Verb("pkg", "Create a package", lambda words: _create("catkin create pkg", words, Path.cwd()))
    return Family("catkin create", "", (package,)).main(argv)


def _init(argv: Sequence[str]) -> int:
    parser = _parser("init", "Make a folder a workspace.")
    parser.add_argument("--reset", action="store_true", help="accepted")
    options = parser.parse_args(argv)
    root = (options.workspace or Path.cwd()).resolve()
    (root / ".catkin_tools").mkdir(parents=True, exist_ok=True)
    print(f"Initialized catkin workspace in {root}")
    return 0


def _list(argv: Sequence[str]) -> int:
    parser = _parser("list", "List the packages of a workspace.")
    parser.add_argument("-u", "--unformatted", action="store_true", help="without the sign before each")
    options = parser.parse_args(argv)
    for plan in sorted(read_plans(_workspace_of(options.workspace).source), key=lambda plan: plan.name):
        print(plan.name if options.unformatted else f"- {plan.name}")
    return 0


def _locate(argv: Sequence[str]) -> int:
    parser = _parser("locate", "Print the folder of a workspace or a package.")
    parser.add_argument("package", nargs="?", help="a package of the workspace")
    for flag in ("-s", "--src", "-b", "--build", "-d", "--devel", "-i", "--install"):
        parser.add_argument(flag, action="store_true", help="one of the workspace's folders")
    options = parser.parse_args(argv)
    workspace = _workspace_of(options.workspace)
    for chosen, folder in zip(("src", "build", "devel", "install"), _spaces(workspace), strict=True):
        if getattr(options, chosen) or getattr(options, chosen[0]):
            print(folder[1])
            return 0
    if options.package is None:
        print(workspace.root)
        return 0
    plans = {plan.name: plan for plan in read_plans(workspace.source)}
    if options.package not in plans:
        raise NotFoundError("package", options.package, plans)
    print(plans[options.package].folder)
    return 0


def _run_tests(argv: Sequence[str]) -> int:
    from minirospy.cli.catkin.run_tests import run_tests

    parser = _parser("test", "Build, and run the tests of packages.")
    parser.add_argument("packages", nargs="*", default=[], help="default: all")
    parser.add_argument("--this", action="store_true", help="the package around the current folder")
    for flag in ("-j", "--jobs", "-p", "--parallel-packages"):
        parser.add_argument(flag, nargs="?", help="accepted: one test runs after the other")
    for flag in ("-c", "--continue-on-failure", "-v", "--verbose", "-i", "--interleave-output", "--no-deps"):
        parser.add_argument(flag, action="store_true", help="accepted")
    options = parser.parse_args(argv)
    workspace = _workspace_of(options.workspace)
    chosen = [*options.packages, *([_this_package()] if options.this else [])]
    return run_tests(workspace, _built(workspace, ()), chosen)


# --- catkin_create_pkg


def _create(command: str, argv: Sequence[str] | None, parent: Path) -> None:
    from minirospy.workspace.create import NewPackage, create_package

    parser = Parser(command, description="Create a new catkin package in the current folder.")
    parser.add_argument("name", help="its name: lower-case letters, digits, underscores")
    parser.add_argument(
        "dependencies", nargs="*", default=[], help="packages that it needs, such as rospy std_msgs"
    )
    parser.add_argument("--catkin-deps", nargs="+", default=[], help="more of them")
    parser.add_argument("--meta", action="store_true", help="a metapackage: it only names others")
    parser.add_argument("-V", "--pkg_version", default="0.0.0", help="default: 0.0.0")
    parser.add_argument("-D", "--description", default="", help="one or two sentences")
    parser.add_argument("-l", "--license", action="append", help="BSD, MIT, ...")
    parser.add_argument("-a", "--author", action="append", help='as in "Jane Doe <jane@example.com>"')
    parser.add_argument("-m", "--maintainer", action="append", help="as --author")
    parser.add_argument("-s", "--sys-deps", nargs="*", help="accepted: libraries for CMake")
    parser.add_argument("-b", "--boost-comps", nargs="*", help="accepted: parts of boost")
    parser.add_argument("--rosdistro", help="accepted")
    options = parser.parse_args(argv)
    package = NewPackage(
        options.name,
        [*options.dependencies, *options.catkin_deps],
        options.pkg_version,
        options.description,
        options.license or (),
        options.author or (),
        options.maintainer or (),
        _user(),
        options.meta,
    )
    for path in create_package(parent, package):
        print(f"Created {'folder' if path.is_dir() else 'file'} {path.relative_to(parent).as_posix()}")
    print(f"Successfully created files in {parent / options.name}. Please adjust the values in package.xml.")
    if (parent / "src").is_dir() and (parent / "devel").is_dir():
        warn(f"catkin_make builds what is in {parent / 'src'} alone: `mv {options.name} src`")


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):
        return "user"
