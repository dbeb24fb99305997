"""Build hooks: addresses, console scripts and PyPI's README; ``overlay/``, rqt's packages, and the wheel's other files.

An editable install needs only the modules: its path lines (``dev-mode-dirs`` in pyproject.toml) point into the
checkout, where everything else already is.
"""

from __future__ import annotations

import hashlib
import os
import re
import sys
import tokenize
import zipfile
from base64 import urlsafe_b64encode
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from hatchling.builders.config import BuilderConfig
from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

if sys.version_info < (3, 10):  # noqa: UP036 pip builds before it compares requires-python
    found = ".".join(map(str, sys.version_info[:2]))
    sys.exit(f"minirospy needs Python 3.10 or newer, this is {found} (docs/install.md)")

ADDRESS_VARIABLE = "MINIROSPY_PROJECT_URL"
"""The environment variable with the address of the repository, set by the publisher: docs/release.md."""

_PICTURE = re.compile(r"!\[([^\]]*)\]\((?!https?:)([^)]+)\)")
_LINK = re.compile(r"\[([^\]]+)\]\((?!https?:|#)([^)]+)\)")

_PAGE = re.compile(r"minirospy/web/dashboard/page/(?!vendor/).*\.(js|css)")
_MODULE = re.compile(r"minirospy/(?!overlay/).*\.py")
_COMMENT = re.compile(r"//.*|/\*((?!\*/).)*\*/")
_CODE_AND_COMMENT = re.compile(r"(.*[;,{}(\[>)])\s+// [^`]*")


def project_urls(address: str) -> dict[str, str]:
    """Return ``project.urls`` of a repository at ``address``, with the paths of GitHub or, by the host's name, of GitLab.

    Raise ValueError if the address is not one of a repository: PyPI shows it to everyone.
    """
    address = address.rstrip("/").removesuffix(".git")
    try:
        parts = urlsplit(address)
        host, is_plain = parts.hostname or "", parts.port is None or parts.port > 0
    except ValueError:
        host, is_plain = "", False
    is_plain = is_plain and not (parts.query or parts.fragment or parts.username or parts.password)
    if not (is_plain and host and parts.scheme == "https" and re.fullmatch(r"/[\w.~/-]+", parts.path)):
        raise ValueError(
            f"{ADDRESS_VARIABLE}={address!r} is not the address of a repository, such as https://HOST/OWNER/NAME"
        )

    pages = f"{address}/-" if "gitlab" in host.split(".") else address
    files = f"{pages}/blob/HEAD"
    return {
        "Homepage": address,
        "Documentation": f"{files}/docs/index.md",
        "Repository": address,
        "Issues": f"{pages}/issues",
        "Changelog": f"{files}/CHANGELOG.md",
    }


def readme_of_wheel(text: str, url: str = "") -> str:
    """Return the README for outside of the sources: links lead below ``url``, the address of the repository's files.

    Without a ``url``, links become names of files, and pictures are left out.
    """
    if not url:
        text = _PICTURE.sub("", text)
        return _LINK.sub(lambda link: link[1] if link[1] == link[2] else f"{link[1]} ({link[2]})", text)
    files = url.rstrip("/")
    # A page about a file is no picture.
    contents = files.replace("/blob/", "/raw/")
    repository = re.sub(r"(/-)?/blob/.*", "", files)
    text = _PICTURE.sub(lambda picture: f"![{picture[1]}]({contents}/{picture[2]})", text)
    text = _LINK.sub(lambda link: f"[{link[1]}]({files}/{link[2]})", text)
    return text.replace("<this repository>", repository)


def lean(text: str) -> str:
    """Return a script or style of the page without its comments and indentation; what is in `...` stays as it is."""
    if text.count("`") % 2:
        return text
    lines = []
    is_literal = is_comment = False
    for line in text.splitlines():
        short = line.strip()
        if is_comment or (not is_literal and short.startswith("/**") and "*/" not in short):
            is_comment = not short.endswith("*/")
            continue
        if not is_literal and (not short or _COMMENT.fullmatch(short)):
            continue
        found = None if is_literal else _CODE_AND_COMMENT.fullmatch(short)
        if found and not any(found[1].count(quote) % 2 for quote in "\"'`"):
            short = found[1]
        lines.append(line if is_literal else short)
        is_literal ^= line.count("`") % 2 == 1
    return "\n".join(lines) + "\n"


def without_comments(text: str) -> str:
    """Return a module with empty lines for its lines of comment: the numbers of the others stay those of the sources."""
    lines = text.splitlines(keepends=True)
    for kind, _, (row, column), _, _ in tokenize.generate_tokens(iter(lines).__next__):
        if kind == tokenize.COMMENT and row > 1 and not lines[row - 1][:column].strip():
            lines[row - 1] = "\n"
    return "".join(lines)


def compress(wheel: Path) -> None:
    """Write a wheel's files again, in their order and with their dates: the page and modules lean, all deflated best."""
    packed = wheel.with_suffix(".packed")
    changed: dict[str, bytes] = {}
    with zipfile.ZipFile(wheel) as old, zipfile.ZipFile(packed, "w") as new:
        for info in old.infolist():
            data = old.read(info)
            if _PAGE.fullmatch(info.filename):
                data = changed[info.filename] = lean(data.decode()).encode()
            elif _MODULE.fullmatch(info.filename):
                data = changed[info.filename] = without_comments(data.decode()).encode()
            elif info.filename.endswith(".dist-info/RECORD"):
                data = "".join(
                    _recorded(line, changed) for line in data.decode().splitlines(keepends=True)
                ).encode()
            new.writestr(info, data, zipfile.ZIP_DEFLATED, 9)
    packed.replace(wheel)


def _recorded(line: str, changed: dict[str, bytes]) -> str:
    """Return a line of a RECORD with the hash and size of what has changed (the specification of binary distributions)."""
    name = line.partition(",")[0]
    if name not in changed:
        return line
    digest = urlsafe_b64encode(hashlib.sha256(changed[name]).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(changed[name])}\n"


class DescribeProject(MetadataHookInterface):
    """Writes the console scripts, the addresses of the project, if one is given, and the README, whose links lead there."""

    PLUGIN_NAME = "custom"

    def update(self, metadata: dict[str, Any]) -> None:
        """Set ``scripts``, ``urls`` and the readme; the last two of an unpacked sdist, which hatchling has read already, stay."""
        metadata["scripts"] = self._scripts()
        address = os.environ.get(ADDRESS_VARIABLE, "").strip()
        if "readme" in metadata:
            return

        metadata["urls"] = urls = project_urls(address) if address else {}
        text = Path(self.root, "README.md").read_text(encoding="utf-8")
        files = urls["Changelog"].rpartition("/")[0] if urls else ""
        metadata["readme"] = {"content-type": "text/markdown", "text": readme_of_wheel(text, files)}

    def _scripts(self) -> dict[str, str]:
        """Return the console scripts, which the registry of commands lists."""
        sys.path.insert(0, self.root)
        try:
            from minirospy.cli.registry import console_scripts
        finally:
            sys.path.remove(self.root)
        return console_scripts()


class CompileDefinitions(BuildHookInterface[BuilderConfig]):
    """Writes `overlay/` and the packages of rqt's windows before each build of a wheel."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Write the generated modules; list the additional files of the wheel."""
        if self.target_name != "wheel":
            return
        root = Path(self.root)
        sys.path.insert(0, self.root)
        try:
            from minirospy.cli.windows import write_packages
            from minirospy.core.idl.load import Catalogue, write_package
            from minirospy.core.idl.own_packages import COMPILED_AHEAD
            from minirospy.ros.overlay_modules import write_overlay
        finally:
            sys.path.remove(self.root)
        overlay = root / "minirospy" / "overlay"
        modules = write_overlay(overlay)
        catalogue = Catalogue.below(root / "msgs")
        for package in catalogue.packages:
            write_package(catalogue, package, overlay, on_demand=package not in COMPILED_AHEAD)
        windows = write_packages(root / "minirospy" / "ros")
        if version == "editable":
            return
        build_data["artifacts"] += [f"minirospy/ros/{package}/**" for package in windows]
        build_data["artifacts"] += [f"minirospy/overlay/{path}" for path in modules]
        for package in catalogue.packages:
            build_data["artifacts"] += [
                f"minirospy/overlay/{package}/**/*.py",
                f"minirospy/overlay/{package}/**/*.pyi",
                f"minirospy/overlay/{package}/py.typed",
            ]
        build_data["force_include"] |= {
            str(root / "minirospy_overlay.pth"): "minirospy_overlay.pth",
            str(root / "msgs"): "minirospy/share/msgs",
            str(root / "rpi_feros"): "minirospy/share/rpi_feros",
            str(root / "launch"): "minirospy/share/launch",
        }

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Compress the wheel: it is copied to small computers."""
        if self.target_name == "wheel" and version != "editable":
            compress(Path(artifact_path))
