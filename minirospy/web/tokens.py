"""The tokens of this user's bridges, stored in a file that only the user can read, so that they survive restarts."""

from __future__ import annotations

import contextlib
import json
import os
import stat
import sys
from pathlib import Path
from typing import NamedTuple

from minirospy.base.errors import BridgeError
from minirospy.base.private_files import open_file
from minirospy.web.access import is_token, new_token

__all__ = ["Tokens", "kept_tokens", "read_tokens"]

_NAME = "bridge-tokens.json"


class Tokens(NamedTuple):
    """The tokens of a user: ``write`` permits publishing, calling services and setting parameters, ``read`` only reading."""

    write: str
    read: str


def read_tokens(home: Path) -> Tokens | None:
    """Return the tokens in ROS_HOME, or None if there are none."""
    try:
        with os.fdopen(open_file(home / _NAME, os.O_RDONLY), encoding="utf-8") as file:
            if sys.platform != "win32" and not _is_own(os.fstat(file.fileno())):
                return None
            fields = json.load(file)
        found = Tokens(fields["write"], fields["read"])
        return found if all(map(is_token, found)) else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _is_own(found: os.stat_result) -> bool:
    """Return whether a file belongs to this user and is private: others may create files in a shared folder."""
    return found.st_uid == os.geteuid() and not stat.S_IMODE(found.st_mode) & 0o077


def kept_tokens(home: Path, *, renews: bool = False) -> Tokens:
    """Return the tokens in ROS_HOME. If there are none, or if ``renews`` is set, create new ones.

    Raise BridgeError if they cannot be stored.
    """
    found = None if renews else read_tokens(home)
    if found:
        return found
    tokens = Tokens(new_token(), new_token())
    path = home / _NAME
    try:
        home.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(FileNotFoundError):
            path.unlink()
        with os.fdopen(
            open_file(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8"
        ) as file:
            json.dump(tokens._asdict(), file)
    except OSError as error:
        raise BridgeError(f"the tokens cannot be kept in {path}: {error.strerror}: give --token") from error
    return tokens
