"""The pages as a site: mkdocs.yml lists all of them, and no link is broken on the site or in the sources."""

from __future__ import annotations

import functools
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from tools.site_hooks import FILES, PAGES, link_on_site

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
ALL = [*(ROOT / name for name in PAGES), *sorted(DOCS.rglob("*.md"))]


def _nav(entries: object) -> Iterator[str]:
    if isinstance(entries, str):
        yield entries
    elif isinstance(entries, list):
        for entry in entries:
            yield from _nav(entry)
    elif isinstance(entries, dict):
        for entry in entries.values():
            yield from _nav(entry)


def _prose(page: Path) -> str:
    """Return a page's text without code."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    return re.sub(r"^(?:    |\t)(?![-*\d]).*$", "", text, flags=re.MULTILINE)


@functools.cache
def _anchors(page: Path) -> set[str]:
    """Return the names by which GitHub and the site link to a page's headings."""
    found: Counter[str] = Counter()
    names = set()
    for heading in re.findall(r"^#+ (.*)$", _prose(page), flags=re.MULTILINE):
        text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        name = re.sub(r"[^\w\- ]", "", text.lower()).strip().replace(" ", "-")
        names.add(f"{name}-{found[name]}" if found[name] else name)
        found[name] += 1
    return names


def test_every_page_has_its_place_on_the_site() -> None:
    named = list(_nav(yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))["nav"]))
    assert len(named) == len(set(named))
    pages = {page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md")}
    assert set(named) == pages | set(PAGES.values())


def test_no_link_is_broken() -> None:
    broken = []
    for page in ALL:
        prose = re.sub(r"`[^`\n]*`", "", _prose(page))
        for target in re.findall(r"\]\((?!https?:|mailto:)([^)\s]+)\)", prose):
            name, _, anchor = target.partition("#")
            file = (page.parent / name).resolve() if name else page
            is_broken = not file.exists() or (
                file.suffix == ".md" and anchor and anchor not in _anchors(file)
            )
            if is_broken:
                broken.append((page, target))
    assert not broken


@pytest.mark.parametrize(
    ("page", "target", "expected"),
    [
        ("README.md", "docs/bags.md", "bags.md"),
        ("README.md", "docs/pictures/first.webp", "pictures/first.webp"),
        ("README.md", "docs/security.md#one-word", "security.md#one-word"),
        ("README.md", "CONTRIBUTING.md", "CONTRIBUTING.md"),
        ("README.md", "LICENSE", "LICENSE.txt"),
        ("CONTRIBUTING.md", "README.md#install", "overview.md#install"),
        ("CONTRIBUTING.md", "tests/README.md", "tests.md"),
        ("tests/README.md", "../docs/bags.md", "bags.md"),
        ("docs/install.md", "../README.md", "overview.md"),
        ("docs/install.md", "#here", "#here"),
        ("docs/start/student.md", "../../README.md#install", "../overview.md#install"),
        ("docs/start/student.md", "../workshop/index.md", "../workshop/index.md"),
        ("docs/workshop/setup.md", "packages.md", "packages.md"),
    ],
)
def test_link_leads_to_the_same_page_on_the_site(page: str, target: str, expected: str) -> None:
    assert link_on_site(target, page) == expected


def test_each_linked_file_outside_the_documentation_is_on_the_site() -> None:
    for page in ALL:
        prose = re.sub(r"`[^`\n]*`", "", _prose(page))
        for target in re.findall(r"\]\((?!https?:|mailto:|#)([^)\s#]+)", prose):
            file = (page.parent / target).resolve()
            name = file.relative_to(ROOT).as_posix()
            assert file.is_relative_to(DOCS) or name in {**PAGES, **FILES}, f"{page.name}: {target}"
