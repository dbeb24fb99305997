"""resource_retriever: retrieve files and pages by URL, including package://. Source: http://wiki.ros.org/resource_retriever."""

from __future__ import annotations

import os
from pathlib import Path
from urllib.error import URLError
from urllib.request import urlopen

from minirospy.ros.rospkg.rospkg.rospack import RosPack

__all__ = ["PACKAGE_PREFIX", "URLError", "get", "get_filename", "urlopen"]

PACKAGE_PREFIX = "package://"
_TIMEOUT = 60.0  # seconds without receiving data after which a server counts as unreachable


def get(url: str) -> bytes:
    """Fetch a URL: ``package://PACKAGE/FILE``, ``file:///FILE`` or any other that urllib supports (http, https, ...).

    Raise Exception, as ROS does, if there is no such resource, ResourceNotFound if the package is not found, ValueError if
    ``url`` is not a URL.
    """
    try:
        if url.startswith(PACKAGE_PREFIX):
            return Path(get_filename(url, use_protocol=False)).read_bytes()
        with urlopen(url, timeout=_TIMEOUT) as answer:
            content: bytes = answer.read()
    except OSError as error:
        raise Exception(f"Invalid URL: {get_filename(url)}") from error
    return content


def get_filename(url: str, use_protocol: bool = True) -> str:
    """Convert a package:// URL to a file:// URL; return other URLs unchanged.

    If not ``use_protocol``, return the file's path. Raise ResourceNotFound if the package is not found, Exception if the URL
    does not refer to a file.
    """
    if not url.startswith(PACKAGE_PREFIX):
        return url
    package, slash, name = url[len(PACKAGE_PREFIX) :].partition("/")
    if not slash:
        raise Exception(f"Could not parse package:// format into file:// format for {url}")
    path = f"{RosPack().get_path(package)}/{name}"
    if not use_protocol:
        return path
    return Path(path).as_uri() if os.name == "nt" else f"file://{path}"
