"""Files for clients: meshes and images that a robot description refers to. The files are read only from known packages."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO
from urllib.parse import quote, unquote

from minirospy.base.errors import BridgeError, NotFoundError
from minirospy.workspace.packages import package_name

if TYPE_CHECKING:
    from minirospy.workspace.packages import Packages

__all__ = ["ALLOWED", "MAX_BYTES", "Assets"]

ALLOWED = r"^package://(?:[-\w%]+/)*[-\w%.]+\.(?:dae|fbx|glb|gltf|jpeg|jpg|mtl|obj|png|stl|tif|tiff|urdf|webp|xacro)$"
"""The URIs that foxglove_bridge allows. The whole URI must match, ignoring case."""

MAX_BYTES = 100_000_000  # maximum size of a file, in bytes


class Assets:
    """Reads files inside packages, given by ``package://`` or ``file://`` URIs. Methods block."""

    def __init__(
        self, packages: Packages, allowed: Sequence[str] = (ALLOWED,), max_bytes: int = MAX_BYTES
    ) -> None:
        """Create a reader for files in ``packages``. Each URI must match one of the regular expressions in ``allowed``.

        Raise BridgeError if an expression is invalid.
        """
        self._packages = packages
        self._max_bytes = max_bytes
        try:
            self._allowed = [re.compile(each, re.IGNORECASE) for each in allowed]
        except re.error as error:
            raise BridgeError(f"'{error.pattern!s}' is not a regular expression: {error}") from error

    def open(self, uri: str) -> tuple[BinaryIO, int]:
        """Open a file; return it and its size. Raise BridgeError with the reason if reading it is not allowed or fails."""
        try:
            file = self._path(uri).open("rb")
        except OSError as error:
            raise BridgeError(f"{uri}: {error.strerror}") from None
        except ValueError:
            # A file name cannot contain certain characters, such as an unpaired surrogate.
            raise BridgeError(f"Asset URI not allowed: {uri[:200]!a}") from None
        size = os.fstat(file.fileno()).st_size
        if size > self._max_bytes:
            file.close()
            raise BridgeError(f"{uri}: {size} bytes, {self._max_bytes} are allowed")
        return file, size

    def _path(self, uri: str) -> Path:
        if uri.lower().startswith("file://"):
            uri = self._package_uri(uri)
        if uri.lower().startswith("package:///"):
            # ROS's resource_retriever cannot load a URI without a package either.
            raise BridgeError(f"{uri[:200]}: the name of the package is missing before the path")
        if not any(each.fullmatch(uri) for each in self._allowed):
            raise BridgeError(f"Asset URI not allowed: {uri[:200]}")
        package, _, name = unquote(uri.removeprefix("package://")).partition("/")
        if ".." in name or "\\" in name or "\0" in name or not name:
            raise BridgeError(f"Asset URI not allowed: {uri[:200]}")
        try:
            folder = self._packages.find(package)
        except NotFoundError as error:
            raise BridgeError(f"{uri}: {error}") from None

        root = folder.resolve()
        path = (folder / name).resolve()
        # A symbolic link must not point outside the package.
        if not path.is_relative_to(root):
            raise BridgeError(f"Asset URI not allowed: {uri[:200]} leaves its package")
        if not path.is_file():
            raise BridgeError(f"{uri}: there is no such file in {folder}")
        return path

    def _package_uri(self, uri: str) -> str:
        """Convert the ``file://`` URI of a file inside a package to ``package://``. Raise BridgeError if it is in no package.

        xacro replaces ``$(find pkg)`` by the package's folder, so descriptions contain such URIs.
        """
        text = unquote(uri[len("file://") :])
        # On Windows, accessing \\host\share would connect to that host.
        if "\\" in text or "\0" in text:
            raise BridgeError(f"Asset URI not allowed: {uri[:200]}")
        path = Path(text.lstrip("/") if os.name == "nt" else text)  # file:///C:/folder
        for folder in path.parents if path.is_absolute() and ".." not in path.parts else ():
            name = package_name(folder)
            if name is None:
                continue
            try:
                if self._packages.find(name).resolve() == folder.resolve():
                    return f"package://{name}/{quote(path.relative_to(folder).as_posix())}"
            except NotFoundError:
                pass
            break
        raise BridgeError(f"Asset URI not allowed: {uri[:200]} is not a file of a package")
