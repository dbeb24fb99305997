"""Imports go only downwards through the rooms, and the pure rooms stay pure. By reading, not by importing."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "minirospy"

LAYERS = [
    {"compat"},
    {"cli"},
    {"testing"},
    {"launch"},
    {"introspect", "actionlib"},
    {"workspace"},
    {"client", "aio"},
    {"runtime"},
    {"graph", "wire", "idl", "gpio"},
    {"clock", "environment", "names", "private_files", "scanner", "steps", "times"},
    {"errors", "escape"},
]
DEPTH = {room: depth for depth, rooms in enumerate(LAYERS) for room in rooms}
PURE = {"graph", "wire", "idl"}
IMPURE_MODULES = {"asyncio", "socket", "threading", "select", "selectors", "subprocess"}

FILES = sorted(
    path
    for path in PACKAGE.rglob("*.py")
    if "overlay" not in path.relative_to(PACKAGE).parts and path.name != "__main__.py"
)


def imports(path: Path) -> set[str]:
    """Every module that a file imports, wherever in the file."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: imports are absolute"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def room_of(module: str) -> str:
    parts = module.split(".")
    return parts[1] if parts[0] == "minirospy" and len(parts) > 1 else ""


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_go_downwards(path: Path) -> None:
    room = path.relative_to(PACKAGE).with_suffix("").parts[0]
    if room == "__init__":
        return
    for module in imports(path):
        other = room_of(module)
        if other in DEPTH and other != room:
            assert DEPTH[other] > DEPTH[room], f"{room} imports {module}"


@pytest.mark.parametrize(
    "path", [path for path in FILES if path.relative_to(PACKAGE).parts[0] in PURE], ids=lambda path: path.name
)
def test_pure_rooms_touch_no_outside(path: Path) -> None:
    assert not {module.split(".")[0] for module in imports(path)} & IMPURE_MODULES


def test_every_room_has_its_place() -> None:
    rooms = {path.relative_to(PACKAGE).with_suffix("").parts[0] for path in FILES} - {"__init__"}
    assert rooms == set(DEPTH)
