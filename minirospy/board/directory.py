"""A board's files: derives the paths of its socket, lock and saved pins from its name.

``MINIROSPY_BOARD`` is the board's name (default "default"); ``MINIROSPY_RUNTIME_DIR`` is the folder for its files,
by default one in the temporary folder that only this user may enter.
"""

from __future__ import annotations

import os
import re
import socket
import stat
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from minirospy.base.errors import BoardError

__all__ = ["BoardDirectory"]

_NAME = re.compile(r"[A-Za-z0-9_.-]{1,60}")
_SOCKET_PATH_LIMIT = 100  # maximum bytes in a Unix socket's path; macOS allows 103, Linux 107


@dataclass(frozen=True)
class BoardDirectory:
    """One board's name and folder."""

    name: str
    folder: Path

    @classmethod
    def find(cls, name: str | None = None, environ: Mapping[str, str] | None = None) -> BoardDirectory:
        """Return the directory of the board ``name`` (default: from the environment).

        Raise BoardError if the name is not valid as a file name.
        """
        environ = os.environ if environ is None else environ
        name = name or environ.get("MINIROSPY_BOARD") or "default"
        if not _NAME.fullmatch(name) or name.startswith("."):
            raise BoardError(
                f"the board's name [{name}] may hold letters, digits, `_`, `-` and `.` (up to 60)"
            )
        given = environ.get("MINIROSPY_RUNTIME_DIR")
        folder = Path(given) if given else _usual_folder()
        return cls(name, folder.absolute())

    def names(self) -> list[str]:
        """Return the names of the boards in this folder, sorted."""
        return sorted(path.name.removesuffix(".lock") for path in self.folder.glob("*.lock"))

    def prepare(self) -> None:
        """Create the folder. Raise BoardError if it cannot be created or other users may write to it."""
        try:
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            found = self.folder.lstat()
        except OSError as error:
            raise BoardError(f"the board's folder {self.folder} cannot be made: {error.strerror}") from error
        if sys.platform != "win32" and (found.st_uid != os.getuid() or stat.S_IMODE(found.st_mode) & 0o022):
            raise BoardError(
                f"the board's folder {self.folder} is open to others: remove it, or set MINIROSPY_RUNTIME_DIR"
            )

    @property
    def uses_unix_socket(self) -> bool:
        """Return whether the server listens on the Unix socket ``socket_path``.

        Otherwise it uses loopback TCP, see ``address_path``.
        """
        has_unix = sys.platform != "win32" and hasattr(socket, "AF_UNIX")
        return has_unix and len(os.fsencode(self.socket_path)) <= _SOCKET_PATH_LIMIT

    @property
    def socket_path(self) -> Path:
        """The path of the Unix socket."""
        return self.folder / f"{self.name}.sock"

    @property
    def address_path(self) -> Path:
        """The path of the file in which a TCP server stores "port token". Only this user may read it."""
        return self.folder / f"{self.name}.address"

    @property
    def lock_path(self) -> Path:
        """The path of the file that the running server locks."""
        return self.folder / f"{self.name}.lock"

    @property
    def state_path(self) -> Path:
        """The path of the file in which the last server saved the board's state."""
        return self.folder / f"{self.name}.pins"

    @property
    def log_path(self) -> Path:
        """The path of the log file to which a failing server writes its error."""
        return self.folder / f"{self.name}.log"


def _usual_folder() -> Path:
    import tempfile

    if sys.platform != "win32":
        user = str(os.getuid())
    else:
        import getpass

        user = re.sub(r"[^A-Za-z0-9_.-]", "_", getpass.getuser())
    return Path(tempfile.gettempdir()) / f"minirospy-{user}"
