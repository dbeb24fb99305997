"""catkin_create_pkg and catkin_init_workspace: create the initial files of a package or workspace."""

from __future__ import annotations

import getpass
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from minirospy.base.errors import UsageError
from minirospy.command.command import warn
from minirospy.command.parser import Parser
from minirospy.command.verbs import Command

__all__ = [
    "CREATE",
    "INIT_WORKSPACE",
    "TOP_LEVEL",
    "catkin_create_pkg",
    "catkin_init_workspace",
    "create_package_here",
    "create_parser",
]

TOP_LEVEL = """# The top of a catkin workspace, for those who build it with CMake.
cmake_minimum_required(VERSION 3.0.2)
project(Project)
find_package(catkin REQUIRED)
catkin_workspace()
"""


def catkin_init_workspace(argv: Sequence[str] | None = None) -> int:
    """Run catkin_init_workspace; return its exit status."""
    return INIT_WORKSPACE.main(argv)


def catkin_create_pkg(argv: Sequence[str] | None = None) -> int:
    """Run catkin_create_pkg; return its exit status."""
    return CREATE.main(argv)


def _init_parser() -> Parser:
    parser = Parser("catkin_init_workspace", "Make a folder the source space of a workspace.")
    parser.add_argument(
        "folder",
        nargs="?",
        type=Path,
        default=Path(),
        help="default: the current folder",
        completer="folders",
    )
    return parser


def _init(folder: Path) -> None:
    if not folder.is_dir():
        raise UsageError(f"folder {folder} does not exist")
    file = folder.resolve() / "CMakeLists.txt"
    if file.exists():
        raise UsageError(f'File "{file}" already exists')
    file.write_text(TOP_LEVEL, encoding="utf-8")
    print(f'Creating file "{file}"')


def create_parser(command: str) -> Parser:
    """Return the parser for catkin_create_pkg, or for `catkin create pkg`."""
    parser = Parser(command, "Create a new catkin package in the current folder.")
    add = parser.add_argument

    add("name", help="its name: lower-case letters, digits, underscores", completer="nothing")
    add(
        "dependencies",
        nargs="*",
        default=[],
        help="packages that it needs, such as rospy std_msgs",
        completer="package_names",
    )

    add("--catkin-deps", nargs="+", default=[], help="more of them", completer="package_names")
    add("--meta", action="store_true", help="a metapackage: it only names others")
    add("-V", "--pkg_version", default="0.0.0", help="default: 0.0.0", completer="nothing")
    add("-D", "--description", default="", help="one or two sentences", completer="nothing")
    add("-l", "--license", action="append", help="BSD, MIT, ...", completer="nothing")
    add("-a", "--author", action="append", help='as in "Jane Doe <jane@example.com>"', completer="nothing")
    add("-m", "--maintainer", action="append", help="as --author", completer="nothing")

    parser.accept("-s", "--sys-deps", nargs="*", help="accepted: libraries for CMake")
    parser.accept("-b", "--boost-comps", nargs="*", help="accepted: parts of boost")
    parser.accept("--rosdistro", nargs=None, help="accepted")
    return parser


def create_package_here(
    name: str,
    dependencies: Sequence[str],
    catkin_deps: Sequence[str],
    meta: bool,
    pkg_version: str,
    description: str,
    license: Sequence[str] | None,
    author: Sequence[str] | None,
    maintainer: Sequence[str] | None,
) -> None:
    """Create a package in the current folder."""
    from minirospy.workspace.create import NewPackage, create_package
    from minirospy.workspace.manifest import naming_warning

    parent = Path.cwd()
    package = NewPackage(
        name,
        [*dependencies, *catkin_deps],
        pkg_version,
        description,
        license or (),
        author or (),
        maintainer or (),
        _user(),
        meta,
    )
    made = create_package(parent, package)
    if warning := naming_warning(name):
        warn(warning)
    if existing := _existing(name):
        warn(f"{name} exists already, in {existing}, and yours hides it: choose another name")
    for path in made:
        print(f"Created {'folder' if path.is_dir() else 'file'} {path.relative_to(parent).as_posix()}")

    print(f"Successfully created files in {parent / name}. Please adjust the values in package.xml.")
    if (parent / "src").is_dir() and (parent / "devel").is_dir():
        warn(f"catkin_make builds what is in {parent / 'src'} alone: `mv {name} src`")


def _existing(name: str) -> str:
    """Return the folder of the minirospy package or the file of the Python module with this name, or "" if there is neither."""
    import importlib.util

    from minirospy.workspace.packages import OF_THE_WORKSHOP, built_in_roots, package_name

    if name in OF_THE_WORKSHOP:
        return ""
    for root in built_in_roots():
        if package_name(root / name) == name:
            return str(root / name)
    # A package's messages form a Python package with the same name.
    spec = importlib.util.find_spec(name) if name.isidentifier() else None
    return str(spec.origin) if spec and spec.origin else ""


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):
        return "user"


CREATE = Command("catkin_create_pkg", partial(create_parser, "catkin_create_pkg"), create_package_here)
INIT_WORKSPACE = Command("catkin_init_workspace", _init_parser, _init)
