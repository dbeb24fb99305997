"""catkin_make, catkin, catkin_create_pkg, catkin_init_workspace: workspaces without CMake.

Source: http://wiki.ros.org/catkin/commands/catkin_make, https://catkin-tools.readthedocs.io/.
"""

from __future__ import annotations

import getpass
import shutil
import sys
from collections.abc import Collection, Sequence
from pathlib import Path

from minirospy.cli.command import Parser, run
from minirospy.cli.verbs import Family, Verb
from minirospy.errors import BuildError, NotFoundError, UsageError
from minirospy.workspace.build import Report, Workspace, build, find_workspace, read_plans, write_set_up
from minirospy.workspace.packages import Packages
from minirospy.workspace.plan import Plan

__all__ = ["catkin", "catkin_create_pkg", "catkin_init_workspace", "catkin_make"]

_TOP_LEVEL = """# The top of a catkin workspace, for those who build it with CMake.
cmake_minimum_required(VERSION 3.0.2)
project(Project)
find_package(catkin REQUIRED)
catkin_workspace()
"""


def catkin_make(argv: Sequence[str] | None = None) -> int:
    """catkin_make; its exit status."""
    return run("catkin_make", lambda: _catkin_make(list(sys.argv[1:] if argv is None else argv)))


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
    return Family("catkin", "catkin command", verbs).main(argv)


# --- catkin_make


def _catkin_make(words: list[str]) -> int:
    parser = Parser(
        "catkin_make",
        description="Build a workspace: generate its messages, and devel/setup.bash to source. "
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
    parser.add_argument("--build", default="build", help="the folder of notes (default: build)")
    parser.add_argument("--pkg", nargs="+", metavar="PKG", help="build these packages only")
    parser.add_argument(
        "--only-pkg-with-deps", nargs="+", metavar="PKG", help="these and what they depend on"
    )
    parser.add_argument("--force-cmake", action="store_true", help="make everything again")
    parser.add_argument("--no-color", action="store_true", help="accepted: output has no colours")
    parser.add_argument(
        "--use-ninja", "--use-gmake", "--use-nmake", action="store_true", help="accepted; there is no make"
    )
    parser.add_argument("-j", "--jobs", nargs="?", help="accepted: there is nothing to wait for")
    parser.add_argument("-l", "--load-average", nargs="?", help="accepted")
    parser.add_argument("--cmake-args", nargs="*", help="accepted; there is no CMake")
    parser.add_argument("--make-args", nargs="*", help="accepted; there is no make")
    options = parser.parse_args([word for word in words if not word.startswith(("-D", "-W", "-G"))])
    root = options.directory.resolve()
    if not root.is_dir():
        raise UsageError(f"there is no folder {options.directory}")
    workspace = Workspace.at(root, options.source, options.build)
    if not workspace.source.is_dir():
        raise BuildError(
            str(workspace.source),
            0,
            "The specified source space does not exist: "
            "run catkin_make in the folder above src, or `mkdir src` first",
        )
    if (root / "package.xml").is_file():
        raise BuildError(str(root), 0, "is a package, not a workspace: go to the folder above its src")
    for name, folder in (("Base path", root), *_spaces(workspace)):
        print(f"{name}: {folder}")
    _top_level(workspace)
    if "clean" in options.targets:
        _remove(workspace)
        return 0
    if options.force_cmake:
        shutil.rmtree(workspace.build / "minirospy", ignore_errors=True)
    known = {"all", "install", "run_tests", "test", "tests"}
    tests = [target for target in options.targets if target.startswith("run_tests_")]
    chosen = [*(options.pkg or []), *(target for target in options.targets if target not in {*known, *tests})]
    plans = _built(workspace, chosen, options.only_pkg_with_deps or ())
    if "install" in options.targets:
        _install(workspace, plans)
    if tests or {"run_tests", "test", "tests"} & set(options.targets):
        from minirospy.cli.catkin_tests import run_tests

        return run_tests(
            workspace, plans, [*chosen, *(target.removeprefix("run_tests_") for target in tests)]
        )
    return 0


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


def _built(workspace: Workspace, chosen: Collection[str], with_deps: Collection[str] = ()) -> list[Plan]:
    """Build what was chosen, or all; say so, a line a package."""
    plans = read_plans(workspace.source)
    names = {plan.name for plan in plans}
    for name in (*chosen, *with_deps):
        if name not in names:
            raise NotFoundError("package", name, names, f"the workspace is {workspace.root}")
    only = {*chosen, *_with_dependencies(plans, with_deps)}
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


def _build(argv: Sequence[str]) -> int:
    parser = _parser("build", "Build packages in a workspace.")
    parser.add_argument(
        "packages", nargs="*", default=[], help="these and what they depend on (default: all)"
    )
    parser.add_argument("--this", action="store_true", help="the package around the current folder")
    parser.add_argument("--no-deps", action="store_true", help="not what they depend on")
    for flag in ("-j", "--jobs", "-p", "--parallel-packages", "-l", "--load-average"):
        parser.add_argument(flag, nargs="?", help="accepted: there is nothing to wait for")
    for flag in (
        "-c",
        "--continue-on-failure",
        "-s",
        "--summarize",
        "-v",
        "--verbose",
        "-i",
        "--interleave-output",
        "--force-cmake",
        "--no-status",
        "--no-color",
        "--no-notify",
        "--pre-clean",
        "--limit-status-rate",
    ):
        parser.add_argument(flag, action="store_true", help="accepted")
    parser.add_argument("--cmake-args", nargs="*", help="accepted; there is no CMake")
    parser.add_argument("--catkin-make-args", nargs="*", help="accepted")
    options = parser.parse_args(argv)
    workspace = _workspace_of(options.workspace)
    if not workspace.source.is_dir():
        raise BuildError(str(workspace.source), 0, "the workspace has no folder src: `mkdir src`")
    (workspace.root / ".catkin_tools").mkdir(exist_ok=True)
    chosen = [*options.packages, *([_this_package()] if options.this else [])]
    if options.no_deps:
        _built(workspace, chosen)
    else:
        _built(workspace, (), chosen)
    print(f"[build] Done: source {workspace.devel / 'setup.bash'}")
    return 0


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
    parser = _parser("config", "Show where a workspace's folders are.")
    for flag in ("--init", "--install", "--no-install", "--merge-devel", "--link-devel", "--merge-install"):
        parser.add_argument(flag, action="store_true", help="accepted")
    parser.add_argument("--extend", help="accepted: what is sourced is what is extended")
    parser.add_argument("--cmake-args", nargs="*", help="accepted; there is no CMake")
    options = parser.parse_args(argv)
    workspace = _workspace_of(options.workspace)
    for name, folder in (("Workspace", workspace.root), *_spaces(workspace)):
        print(f"{name + ':':16} [{'exists' if folder.is_dir() else 'missing'}] {folder}")
    return 0


def _create_verb(argv: Sequence[str]) -> int:
    if argv[:1] != ["pkg"]:
        raise UsageError("`catkin create pkg NAME` is its form")
    _create("catkin create pkg", argv[1:], Path.cwd())
    return 0


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
    from minirospy.cli.catkin_tests import run_tests

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


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):
        return "user"
