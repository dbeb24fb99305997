"""Imports go only downwards through the rooms, and the pure rooms stay pure. By reading, not by importing."""

from __future__ import annotations

import ast
import functools
import graphlib
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "minirospy"

LAYERS = [
    {"cli"},
    {"web", "fleet", "ros2"},
    {"zenoh"},
    {"ros"},
    {"command"},
    {"introspect"},
    {"workspace"},
    {"client", "aio"},
    {"runtime"},
    {"core", "board"},
    {"base"},
]
UPWARDS = {("ros/rosbag/commands/rosbag_play.py", "web")}
"""Imports that go upwards all the same: `rosbag play --bridge` shows the bag in a browser."""
DEPTH = {room: depth for depth, rooms in enumerate(LAYERS) for room in rooms}
BYTES_ONLY = [PACKAGE / "runtime", PACKAGE / "core" / "wire"]
PURE = {"core"}
PURE_FILES = (
    {
        PACKAGE / "web" / name
        for name in (
            "access.py",
            "foxglove/channels.py",
            "foxglove/parsing.py",
            "foxglove/protocol.py",
            "foxglove/serializing.py",
            "rosapi/typedefs.py",
            "rosbridge/cbor.py",
            "rosbridge/conversion.py",
            "rosbridge/png.py",
            "rosbridge/protocol.py",
            "rosbridge/subscription.py",
            "tf_republisher/pairs.py",
            "video/options.py",
            "video/pictures.py",
            "server/account.py",
            "server/admission.py",
            "server/frames.py",
            "server/jobs.py",
            "server/liveness.py",
            "server/queue.py",
            "server/turns.py",
            "server/websocket.py",
        )
    }
    | {
        PACKAGE / "ros2" / name
        for name in (
            "action_links.py",
            "action_messages.py",
            "definitions.py",
            "field_order.py",
            "layouts.py",
            "links.py",
            "parameter_values.py",
            "rules.py",
            "service_links.py",
            "xxh3.py",
            "zenoh_keys.py",
        )
    }
    | {
        PACKAGE / "fleet" / name
        for name in (
            "clocks.py",
            "contents.py",
            "frames.py",
            "holders.py",
            "keys.py",
            "flows.py",
            "report.py",
            "ros1_keys.py",
            "rules.py",
        )
    }
    | {PACKAGE / "web" / "dashboard" / "views.py"}
    | {PACKAGE / "ros" / "turtlesim" / name for name in ("canvas.py", "square.py", "world.py")}
)
IMPURE_MODULES = {"asyncio", "socket", "threading", "select", "selectors", "subprocess"}

FILES = sorted(
    path
    for path in PACKAGE.rglob("*.py")
    if not {"overlay", "nodes", "scripts"} & set(path.relative_to(PACKAGE).parts)
    and path.name != "__main__.py"
)


@functools.cache
def imports(path: Path, *, for_types: bool = True) -> frozenset[str]:
    """Return every module that a file imports, wherever in the file; without ``for_types`` only what runs."""
    found: set[str] = set()
    blocks: list[ast.AST] = [ast.parse(path.read_text(encoding="utf-8"))]
    while blocks:
        node = blocks.pop()
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: imports are absolute"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.If) and not for_types and ast.unparse(node.test) == "TYPE_CHECKING":
            blocks += node.orelse
        elif not isinstance(node, ast.expr):
            # Imports are statements, and no expression has one.
            blocks += ast.iter_child_nodes(node)
    return frozenset(found)


def graph_of_imports(room: str) -> dict[str, set[str]]:
    """Return the modules of a room that each of its modules imports, functions included, types alone excluded."""
    files = [path for path in FILES if path.relative_to(PACKAGE).with_suffix("").parts[0] == room]
    modules = {module_name(path): path for path in files}
    found = {module: imports(path, for_types=False) for module, path in modules.items()}
    # `from package.module import name` and `from package import module` look alike.
    named = {
        module: set(names) | {name.rpartition(".")[0] for name in names} for module, names in found.items()
    }
    for module in modules:
        named[module] -= {name.rpartition(".")[0] for name in found[module] if name in modules}
    return {module: (names & modules.keys()) - {module} for module, names in named.items()}


def module_name(path: Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


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
        is_known = (path.relative_to(PACKAGE).as_posix(), other) in UPWARDS
        if other in DEPTH and other != room and not is_known:
            assert DEPTH[other] > DEPTH[room], f"{room} imports {module}"


@pytest.mark.parametrize(
    "path",
    [path for path in FILES if path.relative_to(PACKAGE).parts[0] in PURE or path in PURE_FILES],
    ids=lambda path: path.name,
)
def test_pure_rooms_touch_no_outside(path: Path) -> None:
    assert not {module.split(".")[0] for module in imports(path)} & IMPURE_MODULES


@pytest.mark.parametrize(
    "path",
    [path for path in FILES if any(folder in path.parents for folder in BYTES_ONLY)],
    ids=lambda path: path.name,
)
def test_runtime_and_wire_know_no_messages(path: Path) -> None:
    generated = {each.parent.parent.name for each in (PACKAGE / "overlay").glob("*/msg/__init__.py")}
    assert "rosgraph_msgs" in generated
    assert not {module.split(".")[0] for module in imports(path)} & generated


@pytest.mark.parametrize("room", sorted(DEPTH))
def test_no_room_has_an_import_cycle(room: str) -> None:
    list(graphlib.TopologicalSorter(graph_of_imports(room)).static_order())


def test_every_room_has_its_place() -> None:
    rooms = {path.relative_to(PACKAGE).with_suffix("").parts[0] for path in FILES} - {"__init__"}
    assert rooms == set(DEPTH)
