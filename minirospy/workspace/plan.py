"""Plan the build of a package from its package.xml and CMakeLists.txt, as a :class:`Plan`.

Only the CMake commands that matter to Python packages are evaluated. Targets that need a compiler are listed in
``Plan.skipped``. Source: http://wiki.ros.org/catkin/CMakeLists.txt,
http://docs.ros.org/en/noetic/api/catkin/html/howto/format2/index.html.
"""

from __future__ import annotations

import fnmatch
import os
import re
import sys
from collections.abc import Callable, Collection, Mapping
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from minirospy.base.errors import BuildError, ManifestError
from minirospy.base.suggestions import did_you_mean
from minirospy.workspace.cmake import keyword_arguments
from minirospy.workspace.cmake_run import Command, run_cmake
from minirospy.workspace.manifest import PACKAGE_NAME, VARIABLES, Kind, Manifest, read_manifest
from minirospy.workspace.packages import DIST_PACKAGES

__all__ = ["Download", "Install", "Plan", "Test", "read_plan"]

_FOLDERS = {"add_message_files": "msg", "add_service_files": "srv", "add_action_files": "action"}
_COMPILED = ("add_executable", "add_library", "catkin_add_gtest", "add_rostest_gtest")
_DOWNLOADS = ("catkin_download", "catkin_download_test_data")
_TESTS = {
    "catkin_add_nosetests": "pytest",
    "catkin_add_pytests": "pytest",
    "add_rostest": "rostest",
    "roslaunch_add_file_check": "roslaunch-check",
}


def _keywords(text: str) -> frozenset[str]:
    return frozenset(text.split())


_FILES_WORDS = _keywords("FILES DIRECTORY NOINSTALL BASE_DIR")
_TEST_WORDS = _keywords(
    "ARGS DEPENDENCIES IGNORE_UNSET_ARGS OPTIONS TIMEOUT USE_TEST_DEPENDENCIES WORKING_DIRECTORY"
)
_DOWNLOAD_WORDS = _keywords("DESTINATION FILENAME MD5 REQUIRED EXCLUDE_FROM_ALL")
_WORDS = _keywords("REQUIRED QUIET COMPONENTS OPTIONAL_COMPONENTS EXACT MODULE CONFIG NO_MODULE")
_PACKAGE_WORDS = _keywords(
    "INCLUDE_DIRS LIBRARIES CATKIN_DEPENDS DEPENDS CFG_EXTRAS EXPORTED_TARGETS SKIP_CMAKE_CONFIG_GENERATION"
)
_INSTALL_WORDS = _keywords(
    """
    PROGRAMS FILES DIRECTORY TARGETS DESTINATION RUNTIME LIBRARY ARCHIVE RENAME PATTERN FILES_MATCHING EXCLUDE REGEX
    PERMISSIONS COMPONENT OPTIONAL USE_SOURCE_PERMISSIONS FILE_PERMISSIONS DIRECTORY_PERMISSIONS CONFIGURATIONS EXPORT
    """
)
_TYPE_NAME = re.compile(r"[a-zA-Z][a-zA-Z0-9_]*$", re.ASCII)
_SYSTEMS = {"Windows": ("WIN32", "MSVC"), "Darwin": ("UNIX", "APPLE"), "Linux": ("UNIX",)}
_BEFORE = {
    "generate_messages": ("catkin_package",),
    "catkin_python_setup": ("generate_messages", "generate_dynamic_reconfigure_options"),
    "generate_dynamic_reconfigure_options": ("catkin_package",),
}
"""Commands that catkin requires before certain other commands. The order has no effect here."""
_GENERATORS = {"message_generation", "genmsg", "actionlib_msgs"}
"""Packages that define CMake's message macros. CMake must find one of them before the macros are used."""
_CMAKE_VERSION = "3.25.1"  # CMake version that CMakeLists.txt files see


class Install(NamedTuple):
    """Files to install. ``sources`` are paths in the package's folder; ``destination`` is a path in the install folder.

    For a folder with a trailing slash, its contents are copied; otherwise the folder itself. ``chosen`` and
    ``excluded`` are regular expressions for paths to include (none: all) and to exclude. ``program``: make the files
    executable; ``python``: the files are scripts that devel refers to; ``optional``: the files may be missing.
    """

    command: Command
    sources: tuple[str, ...]
    destination: str
    program: bool = False
    python: bool = False
    optional: bool = False
    chosen: tuple[str, ...] = ()
    excluded: tuple[str, ...] = ()
    rename: str = ""

    def check(self, folder: Path) -> None:
        """Raise BuildError if a source does not exist below ``folder``."""
        for name in self.sources:
            source = folder / name
            if not source.exists() and not self.optional:
                near = did_you_mean(
                    source.name, os.listdir(source.parent) if source.parent.is_dir() else (), 1
                )
                raise _error(self.command, f"{self.command.name}: [{name}] does not exist{near}")


class Test(NamedTuple):
    """A test: a file or folder in the package, and its runner, arguments and working folder."""

    path: str
    kind: str
    line: int
    arguments: tuple[str, ...] = ()
    folder: str = ""


class Download(NamedTuple):
    """A file to download.

    ``md5`` is "" if the content is not checked. ``required``: a failed download is an error. ``for_tests``: only tests
    need the file.
    """

    url: str
    path: Path
    md5: str
    required: bool
    for_tests: bool
    line: int


class Plan(NamedTuple):
    """The plan for building one package.

    ``definitions`` are the .msg, .srv and .action files; ``message_depends`` the packages whose messages these may
    contain; ``needs`` the packages in find_package(), with their lines; ``skipped`` the targets that need a compiler;
    ``has_setup``: setup.py names Python packages; ``not_installed``: definitions that are not installed; ``options``: the
    .cfg files of dynamic_reconfigure; ``compiled``: the file names of the skipped targets, without ``lib`` and extensions.
    """

    name: str
    folder: Path
    manifest: Manifest
    definitions: tuple[Path, ...]
    message_depends: tuple[str, ...]
    needs: tuple[tuple[str, int], ...]
    has_setup: bool
    not_installed: frozenset[Path]
    skipped: tuple[str, ...]
    installs: tuple[Install, ...]
    tests: tuple[Test, ...]
    warnings: tuple[str, ...]
    options: tuple[Path, ...] = ()
    compiled: tuple[str, ...] = ()
    downloads: tuple[Download, ...] = ()

    @property
    def cmake_lists(self) -> Path:
        """Return the path of the package's CMakeLists.txt."""
        return self.folder / "CMakeLists.txt"


def read_plan(folder: Path, variables: Mapping[str, str] | None = None) -> Plan:
    """Return the plan for the package in ``folder``. ``variables`` are those given by ``catkin_make -DNAME=VALUE``.

    Raise ManifestError if package.xml is invalid, or BuildError if CMakeLists.txt is invalid.
    """
    manifest = read_manifest(folder)
    if not PACKAGE_NAME.match(manifest.name):
        # Reject the name, because it becomes part of the names of folders and modules.
        problem = next(problem for problem in manifest.problems if "is not a package name" in problem.text)
        raise ManifestError(str(manifest.path), *problem)

    file = folder / "CMakeLists.txt"
    known = {**_variables(folder, manifest.name), **(variables or {})}
    if "CMAKE_BINARY_DIR" in known:
        place = f"{known['CMAKE_BINARY_DIR']}/{manifest.name}"
        known |= dict.fromkeys(("PROJECT_BINARY_DIR", "CMAKE_CURRENT_BINARY_DIR"), place)
    collector = _Collector(folder, manifest, known.get("PROJECT_BINARY_DIR", "."))
    if manifest.build_type != "catkin":
        collector.warn(manifest.path, 1, f"left out: it is built by [{manifest.build_type}], not by catkin")
        return collector.plan()
    for problem in manifest.problems:
        collector.warn(manifest.path, *problem)

    if not file.is_file():
        collector.warn(
            manifest.path,
            1,
            f"package [{manifest.name}] is left out: it has no CMakeLists.txt, of which `catkin_create_pkg` writes an example",
        )
        return collector.plan()

    try:
        for command in run_cmake(file, known, collector.commands):
            collector.read(command)
    except RecursionError:
        raise BuildError(str(file), 1, "is nested too deeply") from None

    collector.check()
    return collector.plan()


class _Collector:
    """Builds a plan from commands, one after the other."""

    def __init__(self, folder: Path, manifest: Manifest, build_folder: str) -> None:
        self._folder = folder
        self._manifest = manifest
        self._build_folder = build_folder

        self._definitions: dict[Path, Command] = {}
        self._not_installed: set[Path] = set()
        self._message_depends: list[str] | None = None
        self._needs: list[tuple[str, int]] = []
        self._seen: set[str] = set()
        self._has_setup = False
        self._skipped: list[str] = []
        self._properties: dict[str, dict[str, str]] = {}
        self._installs: list[Install] = []
        self._tests: list[Test] = []
        self._warnings: list[str] = []
        self._option_files: list[Path] = []
        self._downloads: list[Download] = []

        self._readers: dict[str, Callable[[Command], None]] = {
            "project": self._project,
            "find_package": self._find_package,
            "generate_messages": self._generate,
            "catkin_python_setup": self._python_setup,
            "catkin_package": self._catkin_package,
            "catkin_install_python": self._install_python,
            "install": self._install,
            "generate_dynamic_reconfigure_options": self._options,
            **dict.fromkeys(_FOLDERS, self._add_files),
            **dict.fromkeys(_DOWNLOADS, self._download),
            **dict.fromkeys(_COMPILED, self._compiled),
            "set_target_properties": self._target_properties,
            **dict.fromkeys(_TESTS, self._test),
        }

    @property
    def commands(self) -> Collection[str]:
        """Return the names of the commands that :meth:`read` evaluates."""
        return self._readers.keys()

    def read(self, command: Command) -> None:
        """Add a command's effect to the plan. Raise BuildError if the command is invalid."""
        reader = self._readers.get(command.name)
        if reader is None:
            return
        reader(command)
        self._seen.add(command.name)
        for later in _BEFORE.get(command.name, ()):
            if later in self._seen:
                self._refused(command, f"{command.name}() must be called before {later}()")

    def _refused(self, command: Command, text: str) -> None:
        """Warn about an error that catkin would report, but which does not affect this build."""
        self.warn(command.file, command.line, f"real catkin refuses this: {text}")

    def warn(self, file: Path, line: int, text: str) -> None:
        """Record a warning."""
        self._warnings.append(f"{file}:{line}: {text}")

    def check(self) -> None:
        """Warn about definitions that no macro names, malformed .srv files, and a missing generate_messages()."""
        for macro, kind in _FOLDERS.items():
            for path in sorted((self._folder / kind).glob(f"*.{kind}")):
                if path not in self._definitions:
                    self._warnings.append(f"{path} is not built: no {macro}() names it")
        from minirospy.core.idl.load import read_definition

        for path in self._definitions:
            count = f"\n{read_definition(path)}".count("\n---")
            if path.suffix == ".srv" and count != 1:
                self.warn(path, 1, f"{count} lines of '---' instead of 1: write request --- response")
        if self._definitions and self._message_depends is None:
            first = next(iter(self._definitions.values()))
            text = (
                "generate_messages() is missing: messages, services and actions are added, but not generated"
            )
            self.warn(first.file, first.line, text)
            # As in catkin, generate no classes, and continue.
            self._definitions.clear()

    def plan(self) -> Plan:
        """Return the plan that all commands together define."""
        return Plan(
            name=self._manifest.name,
            folder=self._folder,
            manifest=self._manifest,
            definitions=tuple(self._definitions),
            message_depends=tuple(self._message_depends or ()),
            needs=tuple(self._needs),
            has_setup=self._has_setup,
            not_installed=frozenset(self._not_installed),
            skipped=tuple(self._skipped),
            installs=tuple(self._installs),
            tests=tuple(self._tests),
            warnings=tuple(self._warnings),
            options=tuple(self._option_files),
            compiled=tuple(map(self._file_name, self._skipped)),
            downloads=tuple(self._downloads),
        )

    def _path(self, command: Command, name: str) -> str:
        """Return the path in a command's argument, relative to the package's folder."""
        if command.folder == self._folder:
            return name
        path = Path(os.path.relpath(command.folder / name, self._folder)).as_posix()
        return f"{path}/" if name.endswith("/") else path

    def _project(self, command: Command) -> None:
        # Skip the commands of subfolders, which may belong to other projects.
        if command.folder == self._folder and command.arguments[:1] != (self._manifest.name,):
            raise _error(
                command,
                f"project({' '.join(command.arguments[:1])}), but package.xml names the package [{self._manifest.name}]",
            )

    def _find_package(self, command: Command) -> None:
        if command.arguments[:1] != ("catkin",):
            return
        given = keyword_arguments(command.arguments[1:], _WORDS)
        names = [*given.get("COMPONENTS", []), *given.get("REQUIRED", [])]
        self._needs += [(name, command.line) for name in names if not name[0].isdigit()]

    def _add_files(self, command: Command) -> None:
        if self._message_depends is not None:
            raise _error(command, f"{command.name}() must be called before generate_messages()")

        kind = _FOLDERS[command.name]
        given = keyword_arguments(command.arguments, _FILES_WORDS)
        place = next(iter(given.get("DIRECTORY", [])), kind)
        folder = command.folder / place
        there = {path.name: path for path in sorted(folder.glob(f"*.{kind}")) if path.is_file()}
        names = [*given[""], *given.get("FILES", [])]

        if given[""]:
            self._refused(command, f"FILES must come before {given[''][0]}")
        if not _GENERATORS & {name for name, _ in self._needs}:
            self._refused(
                command,
                "find_package(catkin REQUIRED COMPONENTS message_generation) must be called before it",
            )

        if not names and "FILES" not in given:
            names = list(there)
        if not folder.is_dir() and (names or "FILES" not in given):
            raise _error(command, f"{command.name}: folder [{place}] does not exist")

        for name in names:
            path = folder / name
            if path.suffix != f".{kind}":
                comma = f": CMake separates names by blanks, write {name.strip(',')}" if "," in name else ""
                raise _error(command, f"{command.name}: [{name}] does not end in .{kind}{comma}")
            if not path.is_file():
                hint = did_you_mean(name, there, 1)
                raise _error(command, f"{command.name}: [{name}] does not exist in folder [{place}]{hint}")
            if not _TYPE_NAME.match(path.stem):
                raise _error(
                    command,
                    f"{command.name}: [{name}] is not the name of a type: letters, digits, underscores, a letter first",
                )

            self._definitions[path] = command
            if "NOINSTALL" in given:
                self._not_installed.add(path)

    def _generate(self, command: Command) -> None:
        if self._message_depends is not None:
            self._refused(command, "generate_messages() must be called once")
        given = keyword_arguments(command.arguments, frozenset(["DEPENDENCIES", "LANGS"]))
        # genmsg accepts the package's own name here, although it has no effect.
        names = given.get("DEPENDENCIES", [])
        self._message_depends = [name for name in names if name != self._manifest.name]
        if not self._definitions:
            self.warn(
                command.file,
                command.line,
                "generate_messages(): nothing to generate; add_message_files() and so on must be called before it",
            )

    def _options(self, command: Command) -> None:
        for name in command.arguments:
            file = command.folder / name
            if not file.is_file():
                near = did_you_mean(file.name, (each.name for each in file.parent.glob("*.cfg")), 1)
                raise _error(command, f"{command.name}: [{name}] does not exist{near}")
            self._option_files.append(file)

    def _catkin_package(self, command: Command) -> None:
        """Check that package.xml has run dependencies for CATKIN_DEPENDS, and build dependencies for those in find_package()."""
        if "catkin" not in self._manifest.depends(Kind.BUILDTOOL):
            self._refused(command, "package.xml must say <buildtool_depend>catkin</buildtool_depend>")

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
            raise _error(
                command,
                f"catkin_package(CATKIN_DEPENDS {name}), but package.xml does not name it: "
                f"add <{missing}>{name}</{missing}> there",
            )

    def _python_setup(self, command: Command) -> None:
        if not (self._folder / "setup.py").is_file():
            raise _error(command, "catkin_python_setup() needs a setup.py in the folder of this file")
        self._has_setup = True

    def _compiled(self, command: Command) -> None:
        if command.arguments and "IMPORTED" not in command.arguments and "INTERFACE" not in command.arguments:
            self._skipped.append(command.arguments[0])

    def _target_properties(self, command: Command) -> None:
        given = keyword_arguments(command.arguments, frozenset(["PROPERTIES"]))
        words = given.get("PROPERTIES", [])
        for target in given[""]:
            self._properties.setdefault(target, {}).update(zip(words[::2], words[1::2], strict=False))

    def _file_name(self, target: str) -> str:
        """Return the file name of a compiled target, without extensions and the default prefix ``lib``."""
        properties = self._properties.get(target, {})
        return properties.get("PREFIX", "") + properties.get("OUTPUT_NAME", target)

    def _test(self, command: Command) -> None:
        if command.arguments:
            given = keyword_arguments(command.arguments[1:], _TEST_WORDS)
            flags = ["-i"] if "IGNORE_UNSET_ARGS" in given else []
            arguments = (*flags, *given.get("ARGS", ()))
            folder = next(iter(given.get("WORKING_DIRECTORY", ())), "")
            path = self._path(command, command.arguments[0])
            self._tests.append(Test(path, _TESTS[command.name], command.line, arguments, folder))

    def _download(self, command: Command) -> None:
        given = keyword_arguments(command.arguments, _DOWNLOAD_WORDS)
        if len(given[""]) != 2:
            raise _error(command, f"{command.name}(TARGET URL ...) is its form")
        url = given[""][1]
        folder = "".join(given.get("DESTINATION", [])) or self._build_folder
        name = "".join(given.get("FILENAME", [])) or url.rpartition("/")[2]
        for_tests = command.name.endswith("_test_data") or "EXCLUDE_FROM_ALL" in given
        self._downloads.append(
            Download(
                url,
                command.folder / folder / name,
                "".join(given.get("MD5", [])),
                "REQUIRED" in given,
                for_tests,
                command.line,
            )
        )

    def _install_python(self, command: Command) -> None:
        given = keyword_arguments(command.arguments, frozenset(["PROGRAMS", "DESTINATION", "OPTIONAL"]))
        programs, place = given.get("PROGRAMS", []), given.get("DESTINATION", [])
        if "PROGRAMS" not in command.arguments[:1] or len(place) != 1:
            raise _error(command, "catkin_install_python(PROGRAMS file ... DESTINATION folder) is its form")
        rule = self._rule(command, programs, place[0])._replace(program=True, python=True)
        rule.check(self._folder)
        self._installs.append(rule)

    def _install(self, command: Command) -> None:
        given = keyword_arguments(command.arguments, _INSTALL_WORDS)
        place = given.get("DESTINATION", [])
        kind = next((kind for kind in ("PROGRAMS", "FILES", "DIRECTORY") if kind in command.arguments), None)
        if kind is None or not place:
            # TARGETS, CODE, SCRIPT and EXPORT only concern compiled targets.
            return
        chosen, excluded = _patterns(command.arguments)
        self._installs.append(
            self._rule(command, given[kind], place[0])._replace(
                program=kind == "PROGRAMS",
                chosen=chosen,
                excluded=excluded,
                rename=next(iter(given.get("RENAME", [])), ""),
            )
        )

    def _rule(self, command: Command, names: list[str], place: str) -> Install:
        sources = tuple(self._path(command, name) for name in names)
        return Install(command, sources, place, optional="OPTIONAL" in command.arguments)


def _error(command: Command, text: str) -> BuildError:
    return BuildError(str(command.file), command.line, text)


def _patterns(arguments: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the patterns (``PATTERN x``, ``REGEX x``) of files to include, and those marked with ``EXCLUDE``."""
    chosen: list[str] = []
    excluded: list[str] = []
    for index, (kind, text) in enumerate(pairwise(arguments)):
        if kind in ("PATTERN", "REGEX"):
            leaves_out = arguments[index + 2 : index + 3] == ("EXCLUDE",)
            pattern = text if kind == "REGEX" else "/" + fnmatch.translate(text)
            (excluded if leaves_out else chosen).append(pattern)
    return tuple(chosen) if "FILES_MATCHING" in arguments else (), tuple(excluded)


def _variables(folder: Path, name: str) -> dict[str, str]:
    """Return the variables predefined by catkin and CMake. Destinations are relative to the install folder."""
    source = folder.as_posix()

    places = {"BIN": "lib", "ETC": "etc", "INCLUDE": "include", "SHARE": "share"}
    package = {f"CATKIN_PACKAGE_{kind}_DESTINATION": f"{place}/{name}" for kind, place in places.items()}
    everywhere = {f"CATKIN_GLOBAL_{kind}_DESTINATION": place for kind, place in places.items()}

    system = {"win32": "Windows", "darwin": "Darwin"}.get(sys.platform, "Linux")

    return {
        **{f"ENV{{{key}}}": value for key, value in {**VARIABLES, **os.environ}.items()},
        **package,
        **everywhere,
        **dict.fromkeys(_SYSTEMS[system], "1"),
        "CATKIN_PACKAGE_LIB_DESTINATION": "lib",
        "CATKIN_GLOBAL_LIB_DESTINATION": "lib",
        "CATKIN_GLOBAL_BIN_DESTINATION": "bin",
        "CATKIN_GLOBAL_LIBEXEC_DESTINATION": "lib",
        "CATKIN_PACKAGE_PYTHON_DESTINATION": f"{DIST_PACKAGES}/{name}",
        "CATKIN_GLOBAL_PYTHON_DESTINATION": DIST_PACKAGES,
        "CATKIN_ENABLE_TESTING": "ON",
        "CMAKE_CURRENT_SOURCE_DIR": source,
        "CMAKE_CURRENT_LIST_DIR": source,
        "CMAKE_SYSTEM_NAME": system,
        "CMAKE_VERSION": _CMAKE_VERSION,
        "PROJECT_SOURCE_DIR": source,
        "CMAKE_INSTALL_PREFIX": ".",
        "PROJECT_NAME": name,
    }
