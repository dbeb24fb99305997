"""Write the teacher's kit from the pages of the course: pages without solutions, a card to print, and slides.

::

    python tools/course_kit.py OUT                              # in English
    python tools/course_kit.py OUT --pages docs/workshop/de     # in German

OUT/students has the pages without solutions, OUT/teachers all pages, OUT/card.html a card of two pages (print it from a
browser), OUT/slides.md the slides in the Markdown of Marp (https://marp.app: `marp slides.md`, or its extension for VS Code).
The pages are the only source: the kit is written again after a change of them.
"""

from __future__ import annotations

import argparse
import html
import re
import sys
from pathlib import Path
from typing import NamedTuple

__all__ = ["Section", "card", "main", "sections", "slides", "without_solutions"]

ROOT = Path(__file__).parents[1]
PAGES = ROOT / "docs" / "workshop"
SOLUTION = re.compile(r"\*(?:Solution|Lösung):\*")
COMMANDS = ("The commands of this chapter", "Die Befehle dieses Kapitels")
EXERCISE = ("Exercise", "Aufgabe")
CHECK = re.compile(r"`(minirospy check \w+)")
LINK = re.compile(r"\[([^\]]+)\]\([^)]*\)")
PROGRAM = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LANGUAGES = re.compile(
    r"^(?:\[English\]\([^)]*\) \| Deutsch|English \| \[Deutsch\]\([^)]*\))\n\n?", re.MULTILINE
)
COMMENT = re.compile(r"^<!-- Written by .*?-->\n\n?", re.MULTILINE | re.DOTALL)  # not those in a launch file
TEACHERS = "instructor.md"
CARD_LINES = range(5, 25)  # lines of a program on the card
MAX_CARD_PROGRAMS = 2  # programs of a chapter on the card

MAX_SLIDE_LINES = 16  # lines of code on a slide, readable from the last row
MAX_SLIDE_POINTS = 6  # bullets on a slide

CARD_STYLE = """
@page { size: A4; margin: 12mm; }
body { font: 9pt/1.2 sans-serif; margin: 0; }
.page { columns: 2; column-gap: 8mm; }
.page + .page { break-before: page; }
h1 { font-size: 14pt; margin: 0 0 2mm; column-span: all; }
h2 { font-size: 11pt; margin: 2mm 0 .5mm; break-after: avoid; }
dl { margin: 0; } dt { font: 8.2pt monospace; break-after: avoid; } dd { margin: 0 0 .8mm 3mm; }
pre { font: 7pt/1.15 monospace; margin: 1mm 0; padding: 1mm; border: .2mm solid #999; break-inside: avoid; }
pre { white-space: pre-wrap; }
"""


class Section(NamedTuple):
    """A part of a page: its heading (empty before the first ``##``) and its lines."""

    heading: str
    lines: list[str]


def sections(text: str) -> list[Section]:
    """Return the parts of a page. A heading in a block of code is not one."""
    found = [Section("", [])]
    in_code = False
    for line in text.splitlines():
        in_code ^= line.startswith("```")
        if line.startswith("## ") and not in_code:
            found.append(Section(line[3:], []))
        else:
            found[-1].lines.append(line)
    return found


def without_solutions(text: str) -> str:
    """Return a page without its solutions. The last paragraph, which links to the next page, stays."""
    parts = sections(text)
    kept: list[str] = []
    for number, part in enumerate(parts):
        if part.heading:
            kept.append(f"## {part.heading}")
        at = next((index for index, line in enumerate(part.lines) if SOLUTION.search(line)), None)
        if at is None:
            kept += part.lines
            continue
        kept += part.lines[:at]
        if before := SOLUTION.split(part.lines[at])[0].rstrip():
            kept += [before, ""]
        if number == len(parts) - 1:
            kept += _last_paragraph(part.lines)
    return "\n".join(kept).rstrip() + "\n"


def _last_paragraph(lines: list[str]) -> list[str]:
    """Return the last paragraph of a page, or nothing if the page ends with a block of code."""
    end = len(lines)
    while end and not lines[end - 1].strip():
        end -= 1
    start = end
    while start and lines[start - 1].strip():
        start -= 1
    return [] if lines[start:end] and lines[end - 1].startswith("```") else lines[start:end]


def title_of(text: str) -> str:
    """Return the title of a page."""
    return next((line[2:] for line in text.splitlines() if line.startswith("# ")), "")


def card(pages: list[str]) -> str:
    """Return the HTML of the card: the commands of all chapters and the exercises, on two pages."""
    blocks = []
    for text in pages:
        entries = []
        for part in sections(text):
            if part.heading in COMMANDS:
                entries += [_cells(line) for line in part.lines if line.startswith("|")][2:]
            elif part.heading.startswith(EXERCISE):
                checks = CHECK.findall("\n".join(part.lines))
                entries += [(f"`{command} ...`", part.heading) for command in checks]
        programs = [
            each for each in PROGRAM.findall(without_solutions(text)) if each.count("\n") in CARD_LINES
        ]
        programs = (
            programs[:MAX_CARD_PROGRAMS] if any(part.heading in COMMANDS for part in sections(text)) else []
        )
        if entries:
            rows = "".join(f"<dt>{_html(name)}</dt><dd>{_html(does)}</dd>" for name, does in entries)
            code = "".join(f"<pre>{html.escape(each)}</pre>" for each in programs)
            lines = 2 * len(entries) + sum(each.count("\n") for each in programs)
            blocks.append((lines, f"<h2>{html.escape(title_of(text))}</h2><dl>{rows}</dl>{code}"))
    half, total, first = sum(count for count, _ in blocks) / 2, 0, []
    while blocks and (not first or total + blocks[0][0] / 2 < half):
        count, block = blocks.pop(0)
        total += count
        first.append(block)
    second = [block for _, block in blocks]
    body = "".join(
        f'<div class="page"><h1>ROS 1: {side}/2</h1>{"".join(each)}</div>'
        for side, each in ((1, first), (2, second))
    )
    head = f'<meta charset="utf-8"><title>ROS 1</title><style>{CARD_STYLE}</style>'
    return f"<!doctype html>\n<html><head>{head}</head><body>{body}</body></html>\n"


def _cells(line: str) -> tuple[str, str]:
    name, _, does = line.strip("|").partition(" | ")
    return name.strip(), does.strip()


def _html(text: str) -> str:
    """Return a table's cell as HTML, with its code in monospace."""
    return re.sub(r"`([^`]*)`", r"<code>\1</code>", html.escape(LINK.sub(r"\1", text)))


def slides(pages: list[str]) -> str:
    """Return the slides in the Markdown of Marp: one for each chapter and each part of it; exercises without solutions."""
    made = ["---\nmarp: true\npaginate: true\n---"]
    for text in pages:
        for part in sections(without_solutions(text)):
            if part.heading in COMMANDS:
                continue
            title = f"## {part.heading}" if part.heading else f"# {title_of(text)}"
            lines = [line for line in part.lines if not line.startswith("# ")]
            content = _slide(lines)
            if content or not part.heading:
                made.append(f"{title}\n\n{content}".rstrip())
    return "\n\n---\n\n".join(made).replace("---\n\n---\n\n", "---\n\n", 1) + "\n"


def _slide(lines: list[str]) -> str:
    """Return the first paragraph, the bullets and the first short block of code of a part."""
    text = "\n".join(lines)
    code = re.findall(r"^```\w*\n.*?^```$", text, re.MULTILINE | re.DOTALL)
    prose = re.sub(r"^```\w*\n.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    paragraphs = [each.strip() for each in re.split(r"\n\s*\n", prose) if each.strip()]
    plain = [each for each in paragraphs if not each.startswith(("- ", "|", "*Check", "*Prüf"))]
    points = [
        " ".join(point.split())
        for each in paragraphs
        if each.startswith("- ")
        for point in re.split(r"^- ", each, flags=re.MULTILINE)
        if point.strip()
    ]
    shown = [LINK.sub(r"\1", plain[0])] if plain else []
    if points:
        shown.append("\n".join("- " + LINK.sub(r"\1", point) for point in points[:MAX_SLIDE_POINTS]))
    if short := next((each for each in code if each.count("\n") <= MAX_SLIDE_LINES), None):
        shown.append(short)
    shown += [each for each in paragraphs if CHECK.search(each) and each not in shown]
    return "\n\n".join(shown)


def read_page(file: Path) -> str:
    """Return a page without the line that links to the other language, and without the translation tool's comment."""
    return COMMENT.sub("", LANGUAGES.sub("", file.read_text(encoding="utf-8")))


def page_names(folder: Path) -> list[str]:
    """Return the names of the chapters, in the order of index.md."""
    return re.findall(
        r"^\| \[.*\]\((\w+\.md)\)", (folder / "index.md").read_text(encoding="utf-8"), re.MULTILINE
    )


def write_kit(pages: Path, out: Path) -> None:
    """Write the kit into a folder, which may exist."""
    names = page_names(pages)
    texts = [read_page(pages / name) for name in names]
    for folder in ("students", "teachers"):
        (out / folder).mkdir(parents=True, exist_ok=True)
    for name, text in zip(names, texts, strict=True):
        (out / "students" / name).write_text(without_solutions(text), encoding="utf-8")
        (out / "teachers" / name).write_text(text, encoding="utf-8")
    for name in ("index.md", TEACHERS):
        (out / "teachers" / name).write_text(read_page(pages / name), encoding="utf-8")
    index = read_page(pages / "index.md")
    # The page for teachers and the record of the course have the solutions.
    kept = [each for each in index.split("\n\n") if TEACHERS not in each]
    (out / "students" / "index.md").write_text("\n\n".join(kept), encoding="utf-8")
    (out / "card.html").write_text(card(texts), encoding="utf-8")
    (out / "slides.md").write_text(slides(texts), encoding="utf-8")


def main() -> int:
    """Write the kit; return 0, or 2 if the pages do not exist."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("out", type=Path, help="the folder to write into")
    parser.add_argument("--pages", type=Path, default=PAGES, help="the folder of the pages")
    options = parser.parse_args()
    if not (options.pages / "index.md").is_file():
        print(f"course_kit.py: ERROR: {options.pages} has no index.md", file=sys.stderr)
        return 2
    write_kit(options.pages, options.out)
    print(f"{options.out}: students, teachers, card.html, slides.md")
    return 0


if __name__ == "__main__":
    sys.exit(main())
