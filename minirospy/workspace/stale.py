"""Definitions that were changed after `catkin_make` has generated their classes."""

from __future__ import annotations

from pathlib import Path

from minirospy.workspace.plan import DIST_PACKAGES

__all__ = ["stale_definitions", "warning_of_stale_definitions", "workspace_of"]


def workspace_of(package: Path) -> Path | None:
    """Return the workspace with a package's folder in ``src`` and a ``devel`` folder, or None."""
    for folder in package.parents:
        if folder.name == "src" and (folder.parent / "devel").is_dir():
            return folder.parent
    return None


def stale_definitions(package: Path) -> list[Path]:
    """Return the definitions in a package's folder whose generated classes are older and have other lines."""
    workspace = workspace_of(package)
    if workspace is None:
        return []
    modules = workspace / "devel" / DIST_PACKAGES / package.name
    found = []
    for kind in ("msg", "srv"):
        for definition in sorted((package / kind).glob(f"*.{kind}")):
            module = modules / kind / f"_{definition.stem}.py"
            try:
                if definition.stat().st_mtime > module.stat().st_mtime and _differs(definition, module):
                    found.append(definition)
            except (OSError, UnicodeError):
                continue
    return found


def _differs(definition: Path, module: Path) -> bool:
    """Return whether a line of the definition is missing in the module, which contains its text."""
    generated = module.read_text(encoding="utf-8")
    lines = (line.strip() for line in definition.read_text(encoding="utf-8").splitlines())
    return any(repr(line)[1:-1] not in generated for line in lines if line and line != "---")


def warning_of_stale_definitions(package: Path) -> str:
    """Return a warning that names the changed definitions in a package's workspace; an empty string if there are none."""
    workspace = workspace_of(package)
    if workspace is None:
        return ""
    stale = [
        path
        for manifest in sorted((workspace / "src").glob("*/package.xml"))
        for path in stale_definitions(manifest.parent)
    ]
    if not stale:
        return ""
    names = ", ".join(f"{path.parent.parent.name}/{path.parent.name}/{path.name}" for path in stale[:3])
    more = " and others" if stale[3:] else ""
    return f"{names}{more}: changed since the last catkin_make; run it in {workspace}"
