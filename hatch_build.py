"""Build hook: compiles ``msgs/`` into Python modules, and adds the files that the wheel has in addition to the package.

An editable install needs only the modules: its path lines (``dev-mode-dirs`` in pyproject.toml) point into the
checkout, where everything else already is.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from hatchling.builders.config import BuilderConfig
from hatchling.builders.hooks.plugin.interface import BuildHookInterface


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
