"""What a package asks of its build: package.xml and CMakeLists.txt in, a :class:`Plan` out.

Of CMake only the macros are read that matter to packages of Python. What needs a compiler is named in
``Plan.skipped``. Source: http://wiki.ros.org/catkin/CMakeLists.txt,
http://docs.ros.org/en/noetic/api/catkin/html/howto/format2/index.html.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Collection
from pathlib import Path
from typing import NamedTuple

from minirospy.errors import BuildError
from minirospy.workspace.cmake import Command, keyword_arguments, parse_cmake
from minirospy.workspace.manifest import Kind, Manifest, read_manifest

__all__ = ["DIST_PACKAGES", "Install", "Plan", "Test", "read_plan"]

DIST_PACKAGES = "lib/python3/dist-packages"
"""Where Python packages lie below a devel or install folder, as ROS on Debian and Ubuntu has it."""

_FOLDERS = {"add_message_files": "msg", "add_service_files": "srv", "add_action_files": "action"}
_COMPILED = {
    "add_executable": "program",
    "add_library": "library",
    "catkin_add_gtest": "test",
    "add_rostest_gtest": "test",
}
_TESTS = {
    "catkin_add_nosetests": "pytest",
    "catkin_add_pytests": "pytest",
    "add_rostest": "rostest",
    "roslaunch_add_file_check": "roslaunch-check",
}
_TEST_WORDS = frozenset(
    [
        "ARGS",
        "DEPENDENCIES",
        "IGNORE_UNSET_ARGS",
        "OPTIONS",
        "TIMEOUT",
        "USE_TEST_DEPENDENCIES",
        "WORKING_DIRECTORY",
    ]
)
_WORDS = frozenset(
    ["REQUIRED", "QUIET", "COMPONENTS", "OPTIONAL_COMPONENTS", "EXACT", "MODULE", "CONFIG", "NO_MODULE"]
)
_PACKAGE_WORDS = frozenset(
    [
        "INCLUDE_DIRS",
        "LIBRARIES",
        "CATKIN_DEPENDS",
        "DEPENDS",
        "CFG_EXTRAS",
        "EXPORTED_TARGETS",
        "SKIP_CMAKE_CONFIG_GENERATION",
    ]
)
_INSTALL_WORDS = frozenset(
    ["PROGRAMS", "FILES", "DIRECTORY", "TARGETS", "DESTINATION", "RUNTIME", "LIBRARY", "ARCHIVE", "RENAME",
     "PATTERN", "FILES_MATCHING", "EXCLUDE", "REGEX", "PERMISSIONS", "COMPONENT", "OPTIONAL",
     "USE_SOURCE_PERMISSIONS", "FILE_PERMISSIONS", "DIRECTORY_PERMISSIONS", "CONFIGURATIONS", "EXPORT"]
)  # fmt: skip


class Install(NamedTuple):
    """Files for the install folder: sources below the package; ``destination`` below the install folder.

    A source that is a folder is copied with its name, or with ``contents`` only what is in it.
    ``patterns`` choose files (none: all), ``excluded`` leave some out. ``program``: made executable.
    """

    sources: tuple[str, ...]
    destination: str
    line: int
    program: bool = False
    patterns: tuple[str, ...] = ()
    excluded: tuple[str, ...] = ()
    rename: str = ""


class Test(NamedTuple):
    """A test: a file or folder below the package, what runs it, with what arguments and where."""

    path: str
    kind: str
    line: int
    arguments: tuple[str, ...] = ()
    folder: str = ""


class Plan(NamedTuple):
    """A package's part in the build.

    ``definitions`` are the .msg, .srv and .action files; ``message_depends`` the packages whose messages they may
    contain; ``needs`` the packages found by find_package, with the lines; ``skipped`` the targets that need a
    compiler; ``has_setup``: setup.py names Python packages; ``left_out``: definitions that no macro names.
    """

    name: str
    folder: Path
    manifest: Manifest
    definitions: tuple[Path, ...]
    message_depends: tuple[str, ...]
    needs: tuple[tuple[str, int], ...]
    has_setup: bool
    left_out: tuple[Path, ...]
    skipped: tuple[str, ...]
    installs: tuple[Install, ...]
    tests: tuple[Test, ...]

    @property
    def cmake_lists(self) -> Path:
        """The package's CMakeLists.txt."""
        return self.folder / "CMakeLists.txt"


def read_plan(folder: Path) -> Plan:
    """The plan of the package in ``folder``. Raises ManifestError, DefinitionError, BuildError."""
    manifest = read_manifest(folder)
    file = folder / "CMakeLists.txt"
    try:
        text = file.read_text(encoding="utf-8", errors="replace")
    except OSError:
        raise BuildError(str(file), 0, f"package [{manifest.name}] has no CMakeLists.txt") from None
    commands = parse_cmake(text, str(file), _variables(folder, manifest.name))
    return _Collector(folder, file, manifest).read(commands)


class _Collector:
    """Gathers a plan, command by command."""

    def __init__(self, folder: Path, file: Path, manifest: Manifest) -> None:
        self._folder = folder
        self._file = file
        self._manifest = manifest
        self._definitions: dict[Path, int] = {}
        self._message_depends: list[str] | None = None
        self._needs: list[tuple[str, int]] = []
        self._has_setup = False
        self._skipped: list[str] = []
        self._installs: list[Install] = []
        self._tests: list[Test] = []
        self._readers: dict[str, Callable[[Command], None]] = {
            "project": self._project,
            "find_package": self._find_package,
            "generate_messages": self._generate,
            "catkin_python_setup": self._python_setup,
            "catkin_package": self._catkin_package,
            "catkin_install_python": self._install_python,
            "install": self._install,
            **dict.fromkeys(_FOLDERS, self._add_files),
            **dict.fromkeys(_COMPILED, self._compiled),
            **dict.fromkeys(_TESTS, self._test),
        }

    def read(self, commands: list[Command]) -> Plan:
        for command in commands:
            reader = self._readers.get(command.name)
            if reader:
                reader(command)
        if self._definitions and self._message_depends is None:
            raise self._error(
                next(iter(self._definitions.values())),
                "generate_messages() is missing: messages, services and actions are added, but not generated",
            )
        return Plan(
            name=self._manifest.name,
            folder=self._folder,
            manifest=self._manifest,
            definitions=tuple(self._definitions),
            message_depends=tuple(self._message_depends or ()),
            needs=tuple(self._needs),
            has_setup=self._has_setup,
            left_out=tuple(
                path
                for kind in _FOLDERS.values()
                for path in sorted((self._folder / kind).glob(f"*.{kind}"))
                if path not in self._definitions
            ),
            skipped=tuple(self._skipped),
            installs=tuple(self._installs),
            tests=tuple(self._tests),
        )

    def _error(self, line: int, text: str) -> BuildError:
        return BuildError(str(self._file), line, text)

    def _project(self, command: Command) -> None:
        if command.arguments and command.arguments[0] != self._manifest.name:
            raise self._error(
                command.line,
                f"project({command.arguments[0]}), but package.xml names the package [{self._manifest.name}]",
            )

    def _find_package(self, command: Command) -> None:
        if command.arguments[:1] != ("catkin",):
            return
        given = keyword_arguments(command.arguments[1:], _WORDS)
        names = [*given.get("COMPONENTS", []), *given.get("REQUIRED", [])]
        self._needs += [(name, command.line) for name in names if not name[0].isdigit()]

    def _add_files(self, command: Command) -> None:
        if self._message_depends is not None:
            raise self._error(command.line, f"{command.name}() must stand before generate_messages()")
        kind = _FOLDERS[command.name]
        given = keyword_arguments(
            command.arguments, frozenset(["FILES", "DIRECTORY", "NOINSTALL", "BASE_DIR"])
        )
        folder = self._folder / next(iter(given.get("DIRECTORY", [])), kind)
        if not folder.is_dir():
            raise self._error(
                command.line,
                f"{command.name}: there is no folder [{folder.relative_to(self._folder).as_posix()}]",
            )
        there = {path.name: path for path in sorted(folder.glob(f"*.{kind}"))}
        for name in given.get("FILES", []) + given[""] or list(there):
            path = folder / name
            if path.suffix != f".{kind}":
                raise self._error(command.line, f"{command.name}: [{name}] does not end in .{kind}")
            if not path.is_file():
                near = difflib.get_close_matches(name, there, n=1)
                hint = f"; did you mean {near[0]}?" if near else ""
                place = folder.relative_to(self._folder).as_posix()
                raise self._error(
                    command.line, f"{command.name}: there is no [{name}] in folder [{place}]{hint}"
                )
            self._definitions[path] = command.line

    def _generate(self, command: Command) -> None:
        given = keyword_arguments(command.arguments, frozenset(["DEPENDENCIES", "LANGS"]))
        self._message_depends = given.get("DEPENDENCIES", [])
        if not self._definitions:
            raise self._error(
                command.line,
                "generate_messages(): nothing to generate; add_message_files() and so on stand before it",
            )

    def _catkin_package(self, command: Command) -> None:
        """What is passed on to other packages must be named in package.xml, for the build and for the run."""
        given = keyword_arguments(command.arguments, _PACKAGE_WORDS)
        found = {name for name, _ in self._needs}
        building = self._manifest.depends(Kind.BUILD, Kind.BUILDTOOL)
        running = self._manifest.depends(Kind.EXEC, Kind.BUILD_EXPORT)
        for name in given.get("CATKIN_DEPENDS", []):
            if name in found and name not in building:
                missing = "depend" if name not in running else "build_depend"
            elif name not in running:
                missing = "exec_depend"
            else:
                continue
            raise self._error(
                command.line,
                f"catkin_package(CATKIN_DEPENDS {name}), but package.xml does not name it: "
                f"add <{missing}>{name}</{missing}> there",
            )

    def _python_setup(self, command: Command) -> None:
        if not (self._folder / "setup.py").is_file():
            raise self._error(command.line, "catkin_python_setup() needs a setup.py beside this file")
        self._has_setup = True

    def _compiled(self, command: Command) -> None:
        if command.arguments and "IMPORTED" not in command.arguments and "INTERFACE" not in command.arguments:
            self._skipped.append(command.arguments[0])

    def _test(self, command: Command) -> None:
        if command.arguments:
            given = keyword_arguments(command.arguments[1:], _TEST_WORDS)
            flags = ["-i"] if "IGNORE_UNSET_ARGS" in given else []
            arguments = (*flags, *given.get("ARGS", ()))
            folder = next(iter(given.get("WORKING_DIRECTORY", ())), "")
            self._tests.append(
                Test(command.arguments[0], _TESTS[command.name], command.line, arguments, folder)
            )

    def _install_python(self, command: Command) -> None:
        given = keyword_arguments(command.arguments, frozenset(["PROGRAMS", "DESTINATION", "OPTIONAL"]))
        programs, place = given.get("PROGRAMS", []), given.get("DESTINATION", [])
        if not programs or len(place) != 1:
            raise self._error(
                command.line, "catkin_install_python(PROGRAMS file ... DESTINATION folder) is its form"
            )
        for name in programs:
            self._check_source(name, command)
        self._installs.append(Install(tuple(programs), place[0], command.line, program=True))

    def _install(self, command: Command) -> None:
        given = keyword_arguments(command.arguments, _INSTALL_WORDS)
        place = given.get("DESTINATION", [])
        kind = next((kind for kind in ("PROGRAMS", "FILES", "DIRECTORY") if kind in command.arguments), None)
        if kind is None or not place:
            # TARGETS, CODE, SCRIPT, EXPORT: what a compiler makes.
            return
        patterns, excluded = _patterns(command.arguments)
        for name in given[kind]:
            self._check_source(name, command)
        self._installs.append(
            Install(
                tuple(given[kind]),
                place[0],
                command.line,
                kind == "PROGRAMS" or "USE_SOURCE_PERMISSIONS" in command.arguments,
                patterns,
                excluded,
                next(iter(given.get("RENAME", [])), ""),
            )
        )

    def _check_source(self, name: str, command: Command) -> None:
        if not (self._folder / name).exists() and "OPTIONAL" not in command.arguments:
            parent = (self._folder / name).parent
            near = difflib.get_close_matches(Path(name).name, _names(parent), n=1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise self._error(command.line, f"{command.name}: there is no [{name}]{hint}")


def _names(folder: Path) -> Collection[str]:
    return [path.name for path in folder.iterdir()] if folder.is_dir() else []


def _patterns(arguments: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """What ``PATTERN x`` chooses, and what ``PATTERN x EXCLUDE`` leaves out."""
    chosen: list[str] = []
    excluded: list[str] = []
    for index, word in enumerate(arguments[:-1]):
        if word == "PATTERN":
            following = arguments[index + 2 : index + 3]
            (excluded if following == ("EXCLUDE",) else chosen).append(arguments[index + 1])
    return tuple(chosen) if "FILES_MATCHING" in arguments else (), tuple(excluded)


def _variables(folder: Path, name: str) -> dict[str, str]:
    """What catkin and CMake set before a package's file is read. Destinations are below the install folder."""
    source = folder.as_posix()
    places = {"BIN": "lib", "ETC": "etc", "INCLUDE": "include", "SHARE": "share"}
    package = {f"CATKIN_PACKAGE_{kind}_DESTINATION": f"{place}/{name}" for kind, place in places.items()}
    everywhere = {f"CATKIN_GLOBAL_{kind}_DESTINATION": place for kind, place in places.items()}
    return {
        **package,
        **everywhere,
        "CATKIN_PACKAGE_LIB_DESTINATION": "lib",
        "CATKIN_GLOBAL_LIB_DESTINATION": "lib",
        "CATKIN_GLOBAL_BIN_DESTINATION": "bin",
        "CATKIN_GLOBAL_LIBEXEC_DESTINATION": "lib",
        "CATKIN_PACKAGE_PYTHON_DESTINATION": f"{DIST_PACKAGES}/{name}",
        "CATKIN_GLOBAL_PYTHON_DESTINATION": DIST_PACKAGES,
        "CMAKE_CURRENT_SOURCE_DIR": source,
        "CMAKE_CURRENT_LIST_DIR": source,
        "PROJECT_SOURCE_DIR": source,
        "CMAKE_INSTALL_PREFIX": ".",
        "PROJECT_NAME": name,
    }
