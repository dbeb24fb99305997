"""Build hooks: what PyPI shows of the README; ``msgs/`` as Python modules, and the files that the wheel has in addition.

An editable install needs only the modules: its path lines (``dev-mode-dirs`` in pyproject.toml) point into the
checkout, where everything else already is.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.config import BuilderConfig
from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

_LINK = re.compile(r"\[([^\]]+)\]\((?!https?:|#)([^)]+)\)")


def readme_of_wheel(text: str, url: str = "") -> str:
    """Return the README with links that work outside of the sources: below ``url``, or as the names of files without one."""
    if url:
        return _LINK.sub(lambda link: f"[{link[1]}]({url.rstrip('/')}/{link[2]})", text)
    return _LINK.sub(lambda link: link[1] if link[1] == link[2] else f"{link[1]} ({link[2]})", text)


class DescribeProject(MetadataHookInterface):
    """Writes the description of the package: the README, whose links lead to ``urls.Documentation`` where it is set."""

    PLUGIN_NAME = "custom"

    def update(self, metadata: dict[str, Any]) -> None:
        """Set the readme."""
        text = Path(self.root, "README.md").read_text(encoding="utf-8")
        url = metadata.get("urls", {}).get("Documentation", "")
        metadata["readme"] = {"content-type": "text/markdown", "text": readme_of_wheel(text, url)}


class CompileDefinitions(BuildHookInterface[BuilderConfig]):
    """Compiles the definitions before each build of a wheel."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Write the generated modules; list the additional files of the wheel."""
        if self.target_name != "wheel":
            return
        root = Path(self.root)
        sys.path.insert(0, self.root)
        try:
            from minirospy.idl.load import Catalogue, write_package
            from minirospy.idl.own_packages import COMPILED_AHEAD
        finally:
            sys.path.remove(self.root)
        overlay = root / "minirospy" / "overlay"
        catalogue = Catalogue.below(root / "msgs")
        for package in catalogue.packages:
            write_package(catalogue, package, overlay, on_demand=package not in COMPILED_AHEAD)
        if version == "editable":
            return
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
