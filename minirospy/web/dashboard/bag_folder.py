"""The bags that the page may open: those in or below one folder, and those on the command line.

A name from the page is never used as a path, but looked up among the bags that were found.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from minirospy.base.errors import BagError, UsageError

__all__ = ["BagFolder", "FoundBag"]

_SUFFIXES = (".bag", ".mcap")
_MAX_BAGS = 1000
_MAX_ENTRIES = 50_000
"""Maximum number of files and folders to visit, because the working folder may be a home folder."""

_MAX_DEPTH = 8
_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_ .+-]{0,99}")
_RESERVED = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\.|$)", re.IGNORECASE)
"""Device names on Windows, which cannot be file names."""


class FoundBag(NamedTuple):
    """A bag: its name as shown on the page (with forward slashes), its size in bytes, and its modification time in seconds."""

    name: str
    size: int
    modified: float


class BagFolder:
    """A folder with bags. ``given`` lists files from the command line, which may be in any folder."""

    def __init__(self, root: Path, given: Sequence[Path] = ()) -> None:
        self.root = root.absolute()
        self._given = {str(path): path.absolute() for path in given}

    @property
    def given(self) -> list[str]:
        """Return the names of the files from the command line."""
        return list(self._given)

    def bags(self) -> list[FoundBag]:
        """Return the bags, newest first. Do not follow links, and skip folders whose names start with a dot."""
        found: dict[str, FoundBag] = {}
        for name, path in self._given.items():
            try:
                status = path.stat()
            except OSError:
                continue
            found[name] = FoundBag(name, status.st_size, status.st_mtime)
        for entry in self._entries():
            name = Path(entry.path).relative_to(self.root).as_posix()
            try:
                status = entry.stat(follow_symlinks=False)
            except OSError:
                continue
            found.setdefault(name, FoundBag(name, status.st_size, status.st_mtime))
            if len(found) >= _MAX_BAGS:
                break
        return sorted(found.values(), key=lambda bag: bag.modified, reverse=True)

    def path_of(self, name: str) -> Path:
        """Return the path of the bag that :meth:`bags` lists as ``name``. Raise BagError if it does not exist."""
        if name in self._given:
            return self._given[name]
        parts = name.split("/")
        is_plain = all(part and not part.startswith(".") for part in parts)
        if not is_plain or "\\" in name or ":" in name or "\0" in name or not name.endswith(_SUFFIXES):
            raise BagError(f"'{name[:200]}' is not the name of a bag in {self.root}")
        path = self.root
        try:
            for part in parts:
                path = path / part
                if _is_link(path):
                    raise BagError(
                        f"'{name[:200]}' is a link, or in one: only what is in {self.root} is opened"
                    )
            if not path.is_file():
                raise BagError(f"there is no bag '{name[:200]}' in {self.root}")
        except (OSError, ValueError) as error:
            raise BagError(f"'{name[:200]}' cannot be opened: {error}") from error
        return path

    def new_file(self, name: str, suffix: str) -> Path:
        """Return the path for a new recording. Raise UsageError if the name is invalid or already exists."""
        stem = name.removesuffix(suffix)
        if not _NAME.fullmatch(stem) or stem.endswith((".", " ")) or _RESERVED.match(stem):
            raise UsageError(
                f"'{name[:120]}' cannot be the name of a recording: it has letters, digits, spaces and _ . + -, "
                "and is in the folder of this command"
            )
        path = self.root / f"{stem}{suffix}"
        for each in (path, path.with_name(f"{path.name}.active")):
            if os.path.lexists(each):
                raise UsageError(f"{each.name} exists already in {self.root}: choose another name")
        return path

    def _entries(self) -> Iterator[os.DirEntry[str]]:
        """Yield the bags in the folder and its subfolders, breadth first."""
        left = _MAX_ENTRIES
        level = [self.root]
        for _ in range(_MAX_DEPTH):
            below: list[Path] = []
            for folder in level:
                for entry in _listed(folder):
                    left -= 1
                    if left < 0:
                        return
                    if entry.name.startswith("."):
                        continue
                    if _is_folder(entry):
                        below.append(Path(entry.path))
                    elif entry.name.endswith(_SUFFIXES) and _is_file(entry):
                        yield entry
            level = below


def _listed(folder: Path) -> list[os.DirEntry[str]]:
    try:
        with os.scandir(folder) as entries:
            return sorted(entries, key=lambda entry: entry.name)
    except OSError:
        return []


def _is_folder(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_dir(follow_symlinks=False) and not _is_link(Path(entry.path))
    except OSError:
        return False


def _is_file(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_file(follow_symlinks=False)
    except OSError:
        return False


def _is_link(path: Path) -> bool:
    """Return whether a path is a symbolic link or, on Windows, a junction."""
    status = path.lstat()
    reparse = getattr(stat, "FILE_ATTRIBUTE_REPARSE_POINT", 0x400)
    return stat.S_ISLNK(status.st_mode) or bool(getattr(status, "st_file_attributes", 0) & reparse)
