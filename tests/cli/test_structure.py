"""cli/ as a whole: no import cycle, neither at import nor inside functions."""

from __future__ import annotations

import ast
from graphlib import TopologicalSorter
from pathlib import Path

CLI = Path(__file__).parents[2] / "minirospy" / "cli"


def module_of(path: Path) -> str:
    parts = ("minirospy", *path.relative_to(CLI.parent).with_suffix("").parts)
    return ".".join(parts).removesuffix(".__init__")


def imports_of(path: Path, modules: set[str]) -> set[str]:
    """Return the modules of cli/ that a file imports, wherever in the file, unless for types alone."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    typing_only = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for inner in ast.walk(node)
    }
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and id(node) not in typing_only and node.module:
            submodules = {f"{node.module}.{alias.name}" for alias in node.names} & modules
            found |= submodules or {node.module} & modules
    return found


def test_no_import_cycle() -> None:
    files = {module_of(path): path for path in CLI.rglob("*.py")}
    graph = {name: imports_of(path, {*files}) for name, path in files.items()}
    assert sum(map(len, graph.values())) > 50
    # Raises CycleError, which names the modules.
    TopologicalSorter(graph).prepare()
