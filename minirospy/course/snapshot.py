"""A snapshot of a student's workspace for a helper: sources, the output of `minirospy doctor` and the results, in a zip file."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

from minirospy.base.environment import Environment
from minirospy.base.errors import MinirospyError
from minirospy.course.results import Record

__all__ = ["write_snapshot"]

_MAX_FILE_BYTES = 1_000_000  # files larger than this, such as bags, models and videos, are left out
_MAX_FILES = 2000
MAX_BYTES = 50_000_000  # maximum total size of the files before compression: a snapshot is sent by e-mail
_LEFT_OUT = frozenset(
    {".git", "__pycache__", "node_modules", ".venv", "venv", "build", "devel", "install", "logs"}
)
_VARIABLES = (
    "ROS_MASTER_URI",
    "ROS_IP",
    "ROS_HOSTNAME",
    "ROS_NAMESPACE",
    "ROS_PACKAGE_PATH",
    "MINIROSPY_BOARD",
    "MINIROSPY_LOCAL",
)
_DOCTOR_SECONDS = 60.0


def write_snapshot(file: Path, environment: Environment) -> tuple[int, dict[str, str]]:
    """Write a snapshot. Return the number of workspace files in it, and a dict of the omitted files with the reasons.

    A file is left out if it cannot be read, or if it, or all files together, would be too large. The workspace is the folders
    of ROS_PACKAGE_PATH. Hidden files, which may be keys and passwords, and build folders are left out. Raise MinirospyError if
    there is no workspace, or if the file exists or cannot be written; an unfinished file is removed.
    """
    roots = [root for root in environment.package_path if root.is_dir() and os.access(root, os.W_OK)]
    if not roots:
        raise MinirospyError("no workspace is known in this terminal: `source WORKSPACE/devel/setup.bash`")
    # Complete the lists before creating the snapshot, because it may be in the workspace itself.
    left_out: dict[str, str] = {}
    listed = [(root, _files(root, left_out)) for root in roots]
    try:
        # A zip file cannot store dates before 1980; 1980-01-01 is stored instead.
        archive = zipfile.ZipFile(file, "x", zipfile.ZIP_DEFLATED, strict_timestamps=False)
    except FileExistsError:
        raise MinirospyError(f"{file} exists: name another file") from None
    except OSError as error:
        raise _not_written(file, error) from error
    try:
        with archive:
            count = _pack(archive, listed, left_out)
            archive.writestr("doctor.txt", _doctor())
            archive.writestr("results.json", json.dumps(Record.read(environment).to_parameter(), indent=1))
            variables = {name: os.environ[name] for name in _VARIABLES if name in os.environ}
            archive.writestr(
                "variables.txt", "".join(f"{name}={value}\n" for name, value in variables.items())
            )
    except BaseException as error:
        with contextlib.suppress(OSError):
            file.unlink()
        if isinstance(error, OSError | ValueError):
            raise _not_written(file, error) from error
        raise
    return count, left_out


def _not_written(file: Path, error: OSError | ValueError) -> MinirospyError:
    return MinirospyError(f"{file} cannot be written: {getattr(error, 'strerror', None) or error}")


def _pack(archive: zipfile.ZipFile, listed: list[tuple[Path, list[Path]]], left_out: dict[str, str]) -> int:
    """Add the files in the workspace's folders; return their number. Add omitted files to ``left_out``, with the reason."""
    count, total = 0, 0
    for number, (root, files) in enumerate(listed, 1):
        prefix = root.parent.name if len(listed) == 1 else f"{number}_{root.parent.name}"
        for path in files:
            # Read the whole file first: if it vanishes or changes meanwhile, the zip file contains no incomplete entry.
            try:
                name = f"{prefix}/{path.relative_to(root).as_posix()}"
                name.encode()
                info = zipfile.ZipInfo.from_file(path, name, strict_timestamps=False)
                # Do not read files that are left out, because a folder may have many large ones.
                if _fits(info.file_size, count, total):
                    with path.open("rb") as stream:
                        data = stream.read(_MAX_FILE_BYTES + 1)
                else:
                    data = None
            except OSError as error:
                left_out[str(path)] = _unreadable(error)
                continue
            except UnicodeEncodeError:
                left_out[str(path)] = "its name is not UTF-8"
                continue
            if data is None or not _fits(len(data), count, total):
                left_out[str(path)] = "it or the snapshot is too large"
                continue
            archive.writestr(info, data, zipfile.ZIP_DEFLATED)
            count, total = count + 1, total + len(data)
    return count


def _fits(size: int, count: int, total: int) -> bool:
    """Return whether a file of ``size`` bytes fits into a snapshot with ``count`` files of ``total`` bytes."""
    return size <= _MAX_FILE_BYTES and total + size <= MAX_BYTES and count < _MAX_FILES


def _files(root: Path, left_out: dict[str, str]) -> list[Path]:
    """Return the sorted files below a folder; do not follow links out of it. Add unreadable folders to ``left_out``."""

    def note(error: OSError) -> None:
        left_out[str(error.filename)] = _unreadable(error)

    found = []
    for folder, inner, names in os.walk(root, onerror=note):
        inner[:] = sorted(each for each in inner if each not in _LEFT_OUT and not each.startswith("."))
        for name in sorted(names):
            path = Path(folder, name)
            with contextlib.suppress(OSError):
                if not name.startswith(".") and path.is_file() and not path.is_symlink():
                    found.append(path)
    return found


def _unreadable(error: OSError) -> str:
    return f"it cannot be read: {error.strerror or error}"


def _doctor() -> str:
    """Return the output of `minirospy doctor`."""
    command = [sys.executable, "-m", "minirospy", "doctor"]
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            check=False,
            timeout=_DOCTOR_SECONDS,
        )
    except subprocess.TimeoutExpired as error:
        return (error.stdout or b"").decode(errors="replace") + "\nminirospy doctor did not end\n"
    return done.stdout.decode(errors="replace")
