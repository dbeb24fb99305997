"""Definitions that were changed after `catkin_make` generated their classes."""

from __future__ import annotations

import ast
from pathlib import Path

from minirospy.workspace.packages import DIST_PACKAGES

__all__ = ["stale_definitions", "warning_of_stale_definitions", "workspace_of"]

_SEPARATOR = "=" * 80  # precedes each nested type's definition in a full definition


def workspace_of(package: Path) -> Path | None:
    """Return the workspace that has the package in ``src`` and also has a ``devel`` folder, or None."""
    for folder in package.parents:
        if folder.name == "src" and (folder.parent / "devel").is_dir():
            return folder.parent
    return None


def stale_definitions(package: Path) -> list[Path]:
    """Return the definitions in a package that are newer than, and differ from, the classes generated from them."""
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
            except (OSError, ValueError, SyntaxError):
                continue
    return found


def _differs(definition: Path, module: Path) -> bool:
    """Return whether a definition differs from the text in its generated class. Raise ValueError if there is no text."""
    tree = ast.parse(module.read_text(encoding="utf-8"))
    texts = [
        ast.literal_eval(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign)
        and [getattr(target, "id", "") for target in node.targets] == ["_full_text"]
    ]
    generated = [line for text in texts for line in _lines(text.partition(_SEPARATOR)[0])]
    return generated != _lines(definition.read_text(encoding="utf-8"))


def _lines(text: str) -> list[str]:
    lines = (line.strip() for line in text.splitlines())
    return [line for line in lines if line and line != "---"]


def warning_of_stale_definitions(package: Path) -> str:
    """Return a warning with the changed definitions in a package's workspace, or "" if there are none."""
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
