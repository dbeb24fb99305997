"""Find the folders of ROS packages, and their programs.

ROS_PACKAGE_PATH is searched before minirospy's own packages, so that a workspace's package hides the built-in package of
the same name. Source: http://wiki.ros.org/ROS/EnvironmentVariables (ROS_PACKAGE_PATH), http://wiki.ros.org/rosrun.
"""

from __future__ import annotations

import os
import re
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from minirospy.base.environment import DEFAULT_MASTER_PORT, Environment
from minirospy.base.errors import MinirospyError, NotFoundError

__all__ = [
    "DIST_PACKAGES",
    "OF_THE_WORKSHOP",
    "ROSBUILD_MANIFEST",
    "CrawlTime",
    "NotExecutableError",
    "Packages",
    "built_in_roots",
    "crawl",
    "crawl_times",
    "is_python",
    "package_name",
    "why_ros_refuses",
    "with_prefix",
]

DIST_PACKAGES = "lib/python3/dist-packages"
"""The folder for Python packages in a devel or install folder, as in ROS on Debian and Ubuntu."""

_MANIFEST = "package.xml"
ROSBUILD_MANIFEST = "manifest.xml"  # manifest of packages for rosbuild, the predecessor of catkin
_IGNORE = {"CATKIN_IGNORE", "COLCON_IGNORE", "AMENT_IGNORE"}
_NO_SUBFOLDERS = "rospack_nosubdirs"
_NAME = re.compile(rb"<name>\s*([^<\s]+)\s*</name>")
_PYTHON_LINE = re.compile(rb"^#!.*\bpython[\d.]*\b")
_RUNS_PYTHON = re.compile(r"(i?python|pypy)[0-9.]*|coverage[0-9.]*|kernprof|i?pdb3?|pudb3?")
_ANY_MASTER = f"http://localhost:{DEFAULT_MASTER_PORT}"
_OURS = Path(__file__).parents[1]
OF_THE_WORKSHOP = frozenset(
    ["rpi_msgs", "rpi_feros", "rpi_feros_bringup"]
)  # packages that participants of the workshop write themselves
_SHOWN = 12  # maximum number of programs listed in an error, about one line


class NotExecutableError(MinirospyError):
    """Raised if a file with the program's name exists, but is neither Python nor executable."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.path = path

    def __str__(self) -> str:
        return f"{self.path} is not executable: chmod +x {self.path}"


class Packages:
    """The packages that are visible in an environment, as found through ROS_PACKAGE_PATH.

    A package's name is taken from its package.xml. A package for rosbuild has the name of its folder.
    """

    def __init__(self, environment: Environment | None = None) -> None:
        # Packages depend on neither ROS_MASTER_URI nor the host name, so do not look these up.
        environment = environment or Environment.read(host="localhost", master_uri=_ANY_MASTER)
        self.roots = (*environment.package_path, *built_in_roots())
        self._crawls: dict[Path, list[Path]] = {}

    @classmethod
    def below(cls, *roots: Path) -> Packages:
        """Return only the packages below the folders ``roots``."""
        packages = cls.__new__(cls)
        packages.roots = roots
        packages._crawls = {}
        return packages

    def find(self, name: str) -> Path:
        """Return a package's folder. If it does not exist, raise NotFoundError, which lists similar names."""
        for root in self.roots:
            # Try the folder with the package's name first, which avoids a search.
            if package_name(root / name) == name:
                return root / name
            for folder in self._crawled(root):
                if package_name(folder) == name:
                    return folder
        hint = "ROS_PACKAGE_PATH names the folders that are searched"
        if self.roots == built_in_roots():
            hint = "no workspace is known in this terminal: `source WORKSPACE/devel/setup.bash`"
        from minirospy.workspace.elsewhere import advice

        if known := advice(name):
            raise NotFoundError("package", name, hint=known)
        raise NotFoundError("package", name, self.folders(), hint)

    def names(self) -> list[str]:
        """Return the names of all packages, sorted."""
        return sorted(self.folders())

    def folders(self) -> dict[str, Path]:
        """Return the folders of all packages, keyed by name."""
        return {name: folders[0] for name, folders in self.copies().items()}

    def copies(self) -> dict[str, list[Path]]:
        """Return all folders of each package, keyed by name. The first one is used."""
        found: dict[str, dict[Path, None]] = {}
        for root in self.roots:
            for folder in self._crawled(root):
                found.setdefault(package_name(folder) or folder.name, {})[folder] = None
        return {name: list(folders) for name, folders in found.items()}

    def executables(self, package: str) -> list[str]:
        """Return the names that `rosrun package` accepts, sorted."""
        folder = self.find(package)
        return sorted({path.name for path in _files(folder) if _is_program(path)})

    def find_executable(self, package: str, name: str) -> list[str]:
        """Return the command that runs a program in a package; if several have this name, the first one.

        Python programs run in this interpreter, not in the one that ``env`` finds. Raise NotFoundError, with similar
        names, if there is none, or NotExecutableError if the file cannot be run.
        """
        return self.find_executables(package, name)[0]

    def find_executables(self, package: str, name: str) -> list[list[str]]:
        """Return the commands for a program, given its name or path. The package may have several files with this name.

        Raise the same exceptions as :meth:`find_executable`.
        """
        folder = self.find(package)
        candidates = (
            [folder / name.lstrip("/")]
            if "/" in name
            else [path for path in _files(folder) if path.name == name]
        )
        candidates = [path for path in candidates if path.is_file()]
        runnable = [path for path in candidates if is_python(path) or os.access(path, os.X_OK)]
        if runnable:
            # Ignore copies of scripts that a build has put into devel.
            own = [path for path in runnable if path.is_relative_to(folder)] or runnable
            return [[sys.executable, str(path)] if is_python(path) else [str(path)] for path in own]
        if candidates:
            raise NotExecutableError(candidates[0])
        known = self.executables(package)
        has = ", ".join(known[:_SHOWN]) + (" ..." if known[_SHOWN:] else "") if known else "no programs"
        hidden = self.hidden_hint(package, name, folder)
        if is_compiled_program(folder, name):
            hint = "it is a C++ program, which catkin_make skips: run it on a machine with real ROS 1, over the same master"
            raise NotFoundError("executable", name, hint=hint)
        raise NotFoundError("executable", name, known, f"package [{package}] in {folder} has {has}{hidden}")

    def find_resource(self, package: str, name: str) -> Path:
        """Find a file in a package, such as a launch file, given its name or its path in the package.

        Raise NotFoundError if there is none.
        """
        folder = self.find(package)
        if (folder / name).is_file():
            return folder / name
        for path in _files(folder):
            if path.name == name:
                return path
        kinds = {Path(name).suffix} - {""} or {".launch", ".test"}
        same_kind = [path.name for path in _files(folder) if path.suffix in kinds]
        hint = f"package [{package}] is in {folder}{self.hidden_hint(package, name, folder)}"
        raise NotFoundError("file", name, same_kind, hint)

    def hidden_hint(self, package: str, name: str, found: Path) -> str:
        """Return a hint if another folder with this package, hidden by ``found``, has the file ``name``, otherwise ""."""
        for folder in self.copies().get(package, ()):
            if folder != found and any(path.name == name for path in _files(folder)):
                return f"; the package of that name in {folder}, which this one hides, has it"
        return ""

    def _crawled(self, root: Path) -> list[Path]:
        if root not in self._crawls:
            self._crawls[root] = list(crawl(root, rosbuild=True))
        return self._crawls[root]


class CrawlTime(NamedTuple):
    """The time in seconds that searching a folder and its subfolders takes, and whether the folder contains a package."""

    folder: Path
    seconds: float
    has_package: bool


def crawl_times(root: Path) -> list[CrawlTime]:
    """Measure how long searching a folder and each of its subfolders takes, excluding packages."""
    found: list[CrawlTime] = []

    def visit(folder: Path) -> bool:
        if (folder / _MANIFEST).is_file():
            return True
        started = time.perf_counter()
        entries = _entries(folder)
        if any(entry.name == ROSBUILD_MANIFEST for entry in entries):
            return True
        has_package = False
        for below in _subfolders(entries):
            has_package |= visit(below)
        found.append(CrawlTime(folder, time.perf_counter() - started, has_package))
        return has_package

    visit(root)
    return found


def built_in_roots() -> tuple[Path, ...]:
    """Return the folders that contain minirospy's own packages.

    In a checkout, the folders are next to the Python package, else in its ``share``.
    """
    share = _OURS / "share"
    base = share if share.is_dir() else _OURS.parent
    return (base / "msgs", base / "rpi_feros", base / "launch", _OURS / "ros")


def crawl(root: Path, *, rosbuild: bool = False) -> Iterator[Path]:
    """Yield the folders of packages at or below ``root``. Like rospack, skip hidden folders, and folders inside packages.

    ``rosbuild``: also yield rosbuild packages, which have a manifest.xml and no package.xml; catkin ignores them.
    """
    if (root / _MANIFEST).is_file():
        if not (root / "CATKIN_IGNORE").exists():
            yield root
        return
    entries = _entries(root)
    if rosbuild and any(entry.name == ROSBUILD_MANIFEST for entry in entries):
        yield root
        return
    for folder in _subfolders(entries):
        yield from crawl(folder, rosbuild=rosbuild)


def _entries(folder: Path) -> list[os.DirEntry[str]]:
    """Return the sorted entries of a folder, or [] if a marker file says to ignore the folder."""
    try:
        entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    except OSError:
        return []
    return [] if any(entry.name in _IGNORE for entry in entries) else entries


def _subfolders(entries: list[os.DirEntry[str]]) -> list[Path]:
    """Return the subfolders that may contain packages, or [] if a marker file says that there are none."""
    if any(entry.name == _NO_SUBFOLDERS for entry in entries):
        return []
    return [
        Path(entry.path)
        for entry in entries
        if not entry.name.startswith(".") and entry.is_dir() and not _leads_back(entry)
    ]


def _leads_back(entry: os.DirEntry[str]) -> bool:
    """Return whether an entry is a link to a folder above it, which would make the search endless."""
    return entry.is_symlink() and Path(entry.path).parent.resolve().is_relative_to(Path(entry.path).resolve())


def package_name(folder: Path) -> str | None:
    """Return the package name of a folder (from package.xml, or the folder's name), or None if it is not a package.

    A folder with a manifest.xml is a package for rosbuild, which has the name of its folder.
    """
    try:
        text = (folder / _MANIFEST).read_bytes()
    except OSError:
        # Unlike Path.is_file(), os.path.isfile() raises no error if the name is too long.
        return folder.name if os.path.isfile(folder / ROSBUILD_MANIFEST) else None
    match = _NAME.search(text)
    return match[1].decode("utf-8", "replace") if match else folder.name


def _files(folder: Path) -> Iterator[Path]:
    """Yield the files of a package: those in its folder, then programs from builds and installations.

    The Python modules in minirospy's own packages are skipped, because `rosrun` does not run them.
    """
    is_ours = folder.parent == _OURS / "ros"
    for path, folders, names in os.walk(folder):
        folders[:] = sorted(
            name
            for name in folders
            if not name.startswith(".")
            and name != "__pycache__"
            and not (is_ours and Path(path, name, "__init__.py").is_file())
        )
        for name in sorted(names):
            if not (is_ours and name.endswith(".py") and not _has_interpreter(Path(path, name))):
                yield Path(path, name)
    prefixes = [
        Path(prefix) for prefix in os.environ.get("CMAKE_PREFIX_PATH", "").split(os.pathsep) if prefix
    ]
    if folder.parent.name == "share":
        # If a package is in /usr/share/PKG, its programs are in /usr/lib/PKG, whichever workspace is sourced.
        prefixes.append(folder.parents[1])
    for prefix in dict.fromkeys(prefixes):
        programs = prefix / "lib" / (package_name(folder) or folder.name)
        if programs.is_dir():
            yield from (path for path in sorted(programs.iterdir()) if path.is_file())


def _has_interpreter(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(2) == b"#!"


def _is_program(path: Path) -> bool:
    if path.name in ("setup.py", "__init__.py"):
        return False
    return (
        is_python(path) if path.suffix == ".py" else os.access(path, os.X_OK) and _starts_like_program(path)
    )


def is_python(path: Path) -> bool:
    """Return whether a file is a Python program, according to its name or first line."""
    if path.suffix == ".py":
        return True
    with path.open("rb") as file:
        return bool(_PYTHON_LINE.match(file.readline(200)))


def why_ros_refuses(program: Path) -> str | None:
    """Return why ROS 1, unlike minirospy, would not run a Python program, and a remedy; None if ROS 1 would run it.

    ROS 1 lets the system choose the interpreter, which requires execute permission and a shebang line.
    """
    if sys.platform == "win32" or not is_python(program):
        return None
    if not os.access(program, os.X_OK):
        return f"{program} is not executable, which ROS 1 refuses: chmod +x {program}"
    with program.open("rb") as file:
        first = file.readline(200)
    if not first.startswith(b"#!"):
        return f"{program} has no interpreter in its first line, which ROS 1 needs: #!/usr/bin/env python3"
    if first.endswith(b"\r\n"):
        return f"{program} has the line ends of Windows, which ROS 1 cannot run: sed -i 's/\\r$//' {program}"
    return None


def with_prefix(prefix: list[str], command: list[str]) -> list[str]:
    """Insert a prefix, such as ``gdb --args`` or ``python3 -m pdb``, into a program's command.

    If the prefix is a Python command, it is followed by only the program's file, as in ROS 1.
    """
    if any(_RUNS_PYTHON.fullmatch(Path(word).stem) for word in prefix):
        command = command[-1:]
    return [*prefix, *command]


def _starts_like_program(path: Path) -> bool:
    if sys.platform == "win32":
        return path.suffix.lower() in (".exe", ".bat", ".cmd")
    with path.open("rb") as file:
        return file.read(2) in (b"#!", b"\x7fE", b"\xcf\xfa", b"\xca\xfe")


_PROGRAM = re.compile(r"\badd_executable\s*\(\s*([^\s)]+)")


def is_compiled_program(folder: Path, name: str) -> bool:
    """Return whether CMakeLists.txt in ``folder`` declares a C++ program ``name``; minirospy's catkin_make builds no C++."""
    try:
        text = (folder / "CMakeLists.txt").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return False
    programs = _PROGRAM.findall(re.sub(r"#.*", "", text))
    return name in {program.replace("${PROJECT_NAME}", folder.name) for program in programs}
