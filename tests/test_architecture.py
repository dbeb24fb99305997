"""docs/architecture.md is correct: its rooms are those in the layer test, and all files and links in it exist."""

from __future__ import annotations

import re

from tests.test_layers import DEPTH, LAYERS, PACKAGE

ROOT = PACKAGE.parent
TEXT = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
ROOMS = {path.name for path in PACKAGE.iterdir() if path.is_dir()}


def paths() -> list[str]:
    """Return the paths in minirospy/ and tests/ on the page, including diagrams."""
    found = re.findall(rf"(?<![\w/.])(?:{'|'.join(sorted(ROOMS | {'tests'}))})/[\w/]*\w(?:\.\w+)?", TEXT)
    return sorted(set(found))


def test_rooms_are_those_of_the_layer_test() -> None:
    table = TEXT.partition("| room |")[2].partition("\n\n")[0]
    rows = [row.split("|")[1] for row in table.splitlines() if row.startswith("| `")]
    rooms = [re.findall(r"`(\w+)(?:/|\.py)`", row) for row in rows]
    assert [set(row) for row in rooms] == LAYERS
    assert sum(map(len, rooms)) == len(DEPTH)


def test_named_files_exist() -> None:
    assert len(paths()) > 100
    for path in paths():
        base = ROOT if path.startswith("tests/") else PACKAGE
        # In the diagrams, a module has no suffix.
        assert any((base / candidate).exists() for candidate in (path, f"{path}.py")), path


def test_contributing_names_files_that_exist() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = set(re.findall(r"(?:minirospy|tests|docs|benchmarks)/[\w/]+\.\w+", text))
    made_up = {"minirospy/ros/rosmine/commands/rosmine.py", "tests/cli/test_rosmine.py"}
    assert len(named) > 15
    assert not [path for path in named - made_up if not (ROOT / path).exists()]
    (example,) = re.findall(r"pytest (tests/[\w/]+\.py)::(\w+)", text)
    assert f"def {example[1]}(" in (ROOT / example[0]).read_text(encoding="utf-8")


def test_named_functions_and_tables_exist() -> None:
    """For example `_hz` in `ros/rostopic/commands/rostopic_rates.py`, or `Node.close` in `runtime/node/node.py`."""
    named = re.findall(r"`([\w.]+)` in `([\w/]+/\w+\.py)`", TEXT)
    assert len(named) >= 5
    for name, path in named:
        text = (PACKAGE / path).read_text(encoding="utf-8")
        for part in name.split("."):
            defined = rf"^ *(?:async )?(?:def|class) {part}\b|^{part}(?:: .*)? = "
            assert re.search(defined, text, re.MULTILINE), (name, path)


PAGES = sorted([*(ROOT / "docs").glob("*.md"), *ROOT.glob("*.md"), ROOT / "tests" / "README.md"])


def test_links_between_pages_resolve() -> None:
    for page in PAGES:
        for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            assert (page.parent / link).exists(), (page, link)
