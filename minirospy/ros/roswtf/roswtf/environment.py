"""roswtf.environment: the checks for paths and URIs that roswtf plugins use."""

from __future__ import annotations

import os
import stat
from urllib.parse import urlparse

__all__ = ["invalid_url", "is_executable", "paths"]


def paths(path: str | None) -> list[str]:
    """Return the folders in the value of a variable such as PATH."""
    return path.split(os.pathsep) if path else []


def is_executable(path: str) -> int:
    """Return the permission bits that allow a file to be executed, or 0 if there are none. Raise OSError if it does not exist."""
    mode = os.stat(path)[stat.ST_MODE]
    return mode & (stat.S_IXUSR | stat.S_IXGRP | stat.S_IXOTH)


def invalid_url(url: str | None) -> str | None:
    """Return the error in a master's URI, or None if the URI is valid."""
    if not url:
        return None
    scheme, _, rest = url.partition("://")
    if scheme != "http" or not rest:
        return "protocol is not 'http'"
    place = urlparse(url).netloc.rsplit("@", 1)[-1]
    _, colon, port = place.rpartition(":")
    if not colon:
        return "port number is missing"
    try:
        int(port)
    except ValueError:
        return f"port number [{port}] is invalid"
    return None
