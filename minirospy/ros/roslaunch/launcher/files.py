"""Finds the launch files named on a command line or in an ``<include>``. Suggests similar names for a missing file."""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import Path

from minirospy.base.errors import LaunchError, MinirospyError, NotFoundError
from minirospy.base.suggestions import nearest
from minirospy.workspace.packages import Packages, package_name

__all__ = [
    "LaunchFileNotFoundError",
    "find_files",
    "hidden_hint",
    "near_files",
    "read_bytes",
    "read_launch_file",
    "wrong_substitution",
]

# maximum size in bytes; a launch file for a hundred robots is about 100 kB
_MAX_LAUNCH_FILE = 16 * 1024 * 1024


class LaunchFileNotFoundError(MinirospyError):
    """Raised if a launch file on the command line does not exist.

    ``ros_text`` is ROS's message, ``hint`` a suggestion.
    """

    def __init__(self, ros_text: str, hint: str) -> None:
        super().__init__(ros_text, hint)
        self.ros_text = ros_text
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.ros_text}: {self.hint}"


def find_files(what: list[str], packages: Packages) -> list[str]:
    """Return the launch files that a command line specifies as PACKAGE FILE or as paths.

    Raise LaunchFileNotFoundError if a file is not found, MinirospyError if an argument is malformed.
    """
    for word in what:
        name, equals, value = word.partition("=")
        if equals and name.isidentifier() and not Path(word).exists():
            raise MinirospyError(f"[{word}] is not a launch file: an argument is written {name}:={value}")

    if len(what) == 2 and not Path(what[0]).is_file():
        package, file = what
        try:
            return [str(packages.find_resource(package, file))]
        except NotFoundError as error:
            raise LaunchFileNotFoundError(
                f"[{file}] is neither a launch file in package [{package}] nor is [{package}] a launch file name",
                f"{error}{_hint_for_package_and_file(package, file, packages, has_hint=bool(error.nearest))}",
            ) from error

    for file in what:
        if not Path(file).is_file():
            hint = (
                near_files(file)
                or _launch_files_of(file, packages)
                or _package_with(file, packages)
                or _in_one_word(file, packages)
            )
            raise LaunchFileNotFoundError(
                f"[{file}] is not a launch file name", f"type roslaunch PACKAGE FILE, or a path{hint}"
            )
    return what


def read_launch_file(file: str) -> bytes:
    """Return a file's bytes. Raise LaunchError if the file cannot be read or is too large."""
    try:
        return read_bytes(file)
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise LaunchError(file, 0, f"cannot be read: {why}") from error


def read_bytes(file: str, limit: int = _MAX_LAUNCH_FILE) -> bytes:
    """Return a file's bytes.

    Raise OSError if the file cannot be read, or ValueError if it has more than ``limit`` bytes, like the device /dev/zero.
    """
    with open(file, "rb") as stream:
        data = stream.read(limit + 1)
    if len(data) > limit:
        raise ValueError(f"it has more than {limit} bytes")
    return data


def near_files(file: str) -> str:
    """Return a hint for a missing launch file: similar names in its folder, otherwise in its package."""
    wanted = Path(file)
    with suppress(OSError, ValueError):
        if wanted.exists():
            return ""
        folder, package = wanted.parent, _package_of(wanted)
        for files in (folder.iterdir() if folder.is_dir() else (), package.rglob("*.*") if package else ()):
            # Compare names without suffixes, because all launch files have the same suffix.
            known: dict[str, Path] = {}
            for path in files:
                if path.suffix in (".launch", ".xml", ".test") and path.name != "package.xml":
                    known.setdefault(path.name.partition(".")[0], path)
            near = [known[name] for name in nearest(wanted.name.partition(".")[0], known)]
            if near:
                shown = (path.name if path.parent == folder else str(path) for path in near)
                return f"; did you mean {' or '.join(shown)}?"
    return ""


def hidden_hint(file: str, packages: Packages) -> str:
    """Return a hint for a file missing from its package but present in another package of the same name."""
    with suppress(OSError, ValueError):
        folder = _package_of(Path(file))
        if folder:
            return packages.hidden_hint(package_name(folder) or folder.name, Path(file).name, folder)
    return ""


def wrong_substitution(file: str) -> str:
    """Return a hint for a file name with the $ of a substitution outside the parentheses."""
    found = re.search(r"\$(find|arg|dirname|env|optenv|anon|eval)\(([^)]*)\)", file)
    return f": {found[0]} is written $({found[1]} {found[2]})" if found else ""


def _package_of(file: Path) -> Path | None:
    return next((each for each in file.parents if (each / "package.xml").is_file()), None)


def _launch_files_of(package: str, packages: Packages) -> str:
    """Return a hint for a file missing from its package: the list of the package's launch files."""
    try:
        files = sorted(path.name for path in packages.find(package).rglob("*.launch"))
    except NotFoundError:
        return ""
    return f"; package [{package}] has {', '.join(files) or 'no launch files'}"


def _in_one_word(word: str, packages: Packages) -> str:
    """Return a hint for a user who typed ``package/file`` in place of ``package file``."""
    package, _, file = word.partition("/")
    return _command_hint(package, file.rpartition("/")[2], packages)


def _hint_for_package_and_file(package: str, file: str, packages: Packages, *, has_hint: bool) -> str:
    """Return a hint for a file missing from its package. ``has_hint``: similar names were already suggested."""
    return (
        _command_hint(file, package, packages)
        or _package_with(file, packages)
        or ("" if has_hint else _near_file_of(package, file, packages))
    )


def _command_hint(package: str, file: str, packages: Packages) -> str:
    """Return a hint with the command that launches a package's file, or an empty string if the file does not exist."""
    try:
        packages.find_resource(package, file)
    except (MinirospyError, OSError, ValueError):
        return ""
    return f"; did you mean `roslaunch {package} {file}`?"


def _near_file_of(package: str, file: str, packages: Packages) -> str:
    """Return a hint with a package's similarly named launch files, or an empty string if there are none."""
    try:
        folder = packages.find(package)
    except NotFoundError:
        return ""
    # Compare names without suffixes, because all launch files have the same suffix.
    known = {path.stem: path.name for path in folder.rglob("*.launch")}
    near = [known[name] for name in nearest(file.partition(".")[0], known)]
    return f"; did you mean {' or '.join(near)}?" if near else ""


def _package_with(file: str, packages: Packages) -> str:
    """Return a hint for a launch file given without its package or with the wrong one."""
    for package, folder in sorted(packages.folders().items()):
        if Path(file).name == file and any((folder / below / file).is_file() for below in ("launch", "")):
            return f"; did you mean `roslaunch {package} {file}`?"
    return ""
