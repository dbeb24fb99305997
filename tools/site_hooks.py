"""Hooks of MkDocs for `make site`: include some pages outside of docs/, and make links work in both places.

In the sources README.md links to `docs/bags.md`, and `docs/bags.md` to `../README.md`; on the site both are in one folder.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]

PAGES = {
    "README.md": "overview.md",
    "CONTRIBUTING.md": "CONTRIBUTING.md",
    "CHANGELOG.md": "CHANGELOG.md",
    "tests/README.md": "tests.md",
}
"""Pages outside docs/, with their names on the site (README.md would become its start page)."""

FILES = {"LICENSE": "LICENSE.txt"}
"""Files outside docs/ that pages link to, with their names on the site."""

_LINK = re.compile(r"(\]\()(?!https?:|#|mailto:)([^)\s]+)(\))")


def place_on_site(page: str) -> str:
    """Return the site path of a source file."""
    return {**PAGES, **FILES}.get(page, page.removeprefix("docs/"))


def link_on_site(target: str, page: str) -> str:
    """Return a link's target on the site; ``page`` is the path of the page in the sources."""
    name, mark, anchor = target.partition("#")
    if not name:
        return target
    linked = place_on_site(posixpath.normpath(posixpath.join(posixpath.dirname(page), name)))
    return posixpath.relpath(linked, posixpath.dirname(place_on_site(page)) or ".") + mark + anchor


def on_config(config: Any) -> Any:
    """Make the anchors of headings in the same way as GitHub, so that links work in both places."""
    from pymdownx.slugs import slugify

    config.mdx_configs.setdefault("toc", {})["slugify"] = slugify(case="lower")
    return config


def on_files(files: Any, config: Any) -> Any:
    """Add the pages and files outside docs/."""
    from mkdocs.structure.files import File

    for page, place in {**PAGES, **FILES}.items():
        files.append(File.generated(config, place, content=(ROOT / page).read_text(encoding="utf-8")))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Convert a page's links to the site's paths."""
    place = page.file.src_uri
    original = {there: here for here, there in PAGES.items()}.get(place, f"docs/{place}")
    return _LINK.sub(lambda link: link[1] + link_on_site(link[2], original) + link[3], markdown)
