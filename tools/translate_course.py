"""`python tools/translate_course.py`: write the German pages of the course, docs/workshop/de/*.md.

An English page (docs/workshop/topics.md) gives the structure, the commands, programs and outputs. Its catalogue
(docs/workshop/de/topics.po, gettext's format) has the translation of each heading, paragraph, list item and table cell.
A link to a page that has a translation leads to the German page, any other link to the same file as before.

The program also brings the catalogues up to date: it adds new English text, and removes text that is no longer used. If a
sentence has changed, its entry keeps the old translation and is marked "fuzzy", until it has been translated again and the
mark is removed. New text that another page has, too, or the catalogue ``--compendium FILE.po``, takes the translation from
there. The exit status is 1, and each place to translate is printed, until all is translated; the German page shows the
English text until then. ``--check`` only prints; a test does that, too.

The comment at the head of docs/workshop/de/index.po is the glossary: one German term for each English one.
"""

from __future__ import annotations

import argparse
import difflib
import posixpath
import re
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Literal, NamedTuple

import polib

__all__ = [
    "COURSE",
    "GERMAN",
    "Piece",
    "english_pages",
    "main",
    "pieces",
    "problems",
    "translated",
    "updated",
]

ROOT = Path(__file__).resolve().parents[1]
COURSE = ROOT / "docs" / "workshop"
GERMAN = COURSE / "de"

MIN_SIMILARITY = (
    0.6  # of an old and a new sentence, from 0 to 1: the old translation helps if they differ less
)
MAX_EQUAL_WORDS = (
    4  # a text that is the same in both languages may be a title such as "Topics", not a sentence
)
WRAP_WIDTH = 110  # characters in a line of a catalogue

METADATA = {
    "Project-Id-Version": "minirospy",
    "Language": "de",
    "MIME-Version": "1.0",
    "Content-Type": "text/plain; charset=UTF-8",
    "Content-Transfer-Encoding": "8bit",
}

_CODE = re.compile(r"`[^`]*`")
_LINK = re.compile(r"(?<=\]\()(?!https?:|mailto:)[^)\s]+(?=\))")
_RULE = re.compile(r"[|\s:-]+")  # the line below a table's head
_CELL_END = re.compile(r"(?<!\\)\|")
_ITEM = re.compile(r"\s*(?:[-*]|\d+\.) (?:\[[ x]\] )?")
_NOTICE = "<!-- Written by tools/translate_course.py from ../{page} and {catalogue}: change those. -->\n\n"


class Piece(NamedTuple):
    """A part of a page. The texts of all pieces are the page, with each paragraph in one line."""

    kind: Literal["kept", "switch", "heading", "prose"]
    text: str
    line: int  # in the English page, from 1


def english_pages(course: Path = COURSE) -> list[str]:
    """Return the names of the pages of the course."""
    return sorted(page.name for page in course.glob("*.md"))


def pieces(markdown: str, page: str) -> list[Piece]:
    """Split a page into texts to translate, and what stays as it is: code, markup and empty lines."""
    found: list[Piece] = []
    lines = markdown.splitlines()
    at = 0
    while at < len(lines):
        start, line = at, lines[at]
        at += 1
        heading = re.match(r"#+ ", line)
        if line.lstrip().startswith("```"):
            while at < len(lines) and lines[at].strip() != "```":
                at += 1
            at += 1
            found.append(Piece("kept", "\n".join(lines[start:at]), start + 1))
        elif heading:
            found.append(Piece("kept", heading[0], start + 1))
            found.append(Piece("heading", line[heading.end() :], start + 1))
        elif line.startswith("|") and not _RULE.fullmatch(line):
            for cell in _CELL_END.split(line.strip().removeprefix("|").removesuffix("|")):
                found += [Piece("kept", "| ", start + 1), *_prose(cell.strip(), start + 1)]
                found.append(Piece("kept", " ", start + 1))
            found.append(Piece("kept", "|", start + 1))
        elif line == _switch(page):
            found.append(Piece("switch", line, start + 1))
        elif line.strip() and not line.startswith(("|", "<", "    ", "\t")):
            mark = _ITEM.match(line)
            if mark:
                found.append(Piece("kept", mark[0], start + 1))
            while at < len(lines) and _continues(lines[at]):
                at += 1
            text = " ".join(part.strip() for part in lines[start:at])
            found += _prose(text[len(mark[0].lstrip()) :] if mark else text, start + 1)
        else:
            found.append(Piece("kept", line, start + 1))
        found.append(Piece("kept", "\n", start + 1))
    return found


def _continues(line: str) -> bool:
    """Return whether a line belongs to the paragraph or the list item before it."""
    return (
        bool(line.strip()) and not _ITEM.match(line) and not line.lstrip().startswith(("```", "|", "#", "<"))
    )


def _prose(text: str, line: int) -> list[Piece]:
    """Return a text as one piece: without a letter outside of code there is nothing to translate."""
    return [Piece("prose" if re.search(r"[^\W\d_]", _CODE.sub("", text)) else "kept", text, line)]


def _switch(page: str) -> str:
    """Return the line at the head of an English page that leads to the German one."""
    return f"English | [Deutsch](de/{page})"


def updated(catalogue: polib.POFile, page: list[Piece], compendium: Mapping[str, str]) -> polib.POFile:
    """Return the catalogue of a page: known translations, and entries to translate for what is new.

    ``compendium`` has translations by English text: those of other pages.
    """
    texts = dict.fromkeys(piece.text for piece in page if piece.kind in ("heading", "prose"))
    known = {entry.msgid: entry for entry in catalogue if not entry.obsolete}
    stale = {text: entry for text, entry in known.items() if text not in texts and entry.msgstr}
    new = polib.POFile(wrapwidth=WRAP_WIDTH)
    new.metadata, new.header = dict(METADATA), catalogue.header
    for text in texts:
        entry = known.get(text) or polib.POEntry(msgid=text)
        if not entry.msgstr and text in compendium:
            entry.msgstr = compendium[text]
        elif text not in known:
            for old in difflib.get_close_matches(text, stale, n=1, cutoff=MIN_SIMILARITY):
                entry.msgstr, entry.previous_msgid = stale[old].msgstr, old
                entry.flags.append("fuzzy")
        new.append(entry)
    return new


def translated(page: str, course: Mapping[str, list[Piece]], texts: Mapping[str, Mapping[str, str]]) -> str:
    """Return the German page; ``course`` has the pieces of all pages, ``texts`` their translations by page."""
    names = {
        (name, english): german
        for name, parts in course.items()
        for english, german in zip(
            _anchors([piece.text for piece in parts if piece.kind == "heading"]),
            _anchors([texts[name].get(piece.text, piece.text) for piece in parts if piece.kind == "heading"]),
            strict=True,
        )
    }

    def german_link(link: re.Match[str]) -> str:
        name, mark, anchor = link[0].partition("#")
        target = name or page
        if target in course:
            return name + mark + names.get((target, anchor), anchor)
        return posixpath.normpath(f"../{name}") + mark + anchor

    done = ""
    notice = _NOTICE.format(page=page, catalogue=Path(page).with_suffix(".po"))
    for piece in course[page]:
        if piece.kind == "switch":
            done += f"[English](../{page}) | Deutsch\n\n{notice}".rstrip("\n")
        elif piece.kind == "kept":
            done += piece.text
        else:
            done += _LINK.sub(german_link, texts[page].get(piece.text, piece.text))
    return done


def _anchors(headings: list[str]) -> Iterator[str]:
    """Yield the anchors of a page's headings, as GitHub and the site make them."""
    seen: Counter[str] = Counter()
    for heading in headings:
        text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        name = re.sub(r"[^\w\- ]", "", text.lower()).strip().replace(" ", "-")
        yield f"{name}-{seen[name]}" if seen[name] else name
        seen[name] += 1


def problems(page: str, parts: list[Piece], catalogue: polib.POFile) -> list[str]:
    """Return what is wrong with the translation of a page, each with its place."""
    found = []
    if not any(piece.kind == "switch" for piece in parts):
        found.append(f"docs/workshop/{page}:2: add this line below the title: {_switch(page)}")
    entries = {entry.msgid: entry for entry in catalogue if not entry.obsolete}
    lines = {piece.text: piece.line for piece in reversed(parts) if piece.kind in ("heading", "prose")}
    for text, line in sorted(lines.items(), key=lambda item: item[1]):
        entry = entries.get(text)
        place = f"docs/workshop/{page}:{line}"
        if entry is None or not entry.msgstr:
            found.append(f"{place}: not translated: {text}")
        elif entry.fuzzy:
            found.append(f"{place}: translate again, then remove the line `#, fuzzy`: {text}")
        else:
            found += [f"{place}: {fault}" for fault in _faults(text, entry.msgstr)]
    catalogue_name = Path(page).with_suffix(".po")
    found += [
        f"docs/workshop/de/{catalogue_name}: not on the page any more: {text}"
        for text in entries
        if text not in lines
    ]
    return found


def _faults(english: str, german: str) -> Iterator[str]:
    """Yield what a translation must have in common with the English text, and has not."""
    if english == german and len(_CODE.sub("", english).split()) > MAX_EQUAL_WORDS:
        yield f"still English: {english}"
    for name, pattern in (("code", _CODE), ("links", _LINK)):
        expected, found = (sorted(set(pattern.findall(text))) for text in (english, german))
        if expected != found:
            yield f"the {name} differ in the translation, {found} for {expected}: {english}"
    stars = [_CODE.sub("", text).count("*") for text in (english, german)]
    if stars[0] != stars[1]:
        yield f"the translation has {stars[1]} asterisks for {stars[0]}: {english}"


def read_catalogue(path: Path) -> polib.POFile:
    """Return a catalogue; an empty one if the file does not exist."""
    if not path.exists():
        return polib.POFile(wrapwidth=WRAP_WIDTH)
    return polib.pofile(str(path), encoding="utf-8", wrapwidth=WRAP_WIDTH)


def translate(course: Path = COURSE, *, write: bool, compendium: Path | None = None) -> list[str]:
    """Check all pages of a course, or bring its catalogues and German pages up to date; return what is left to do.

    ``compendium`` is one more catalogue to take translations from.
    """
    german = course / "de"
    parts = {
        page: pieces((course / page).read_text(encoding="utf-8"), page) for page in english_pages(course)
    }
    catalogues = {page: read_catalogue(german / Path(page).with_suffix(".po")) for page in parts}
    more = [read_catalogue(compendium)] if compendium else []
    if write:
        german.mkdir(exist_ok=True)
        known = {
            entry.msgid: entry.msgstr
            for catalogue in [*catalogues.values(), *more]
            for entry in catalogue.translated_entries()
        }
        catalogues = {page: updated(catalogues[page], parts[page], known) for page in parts}
        for page, catalogue in catalogues.items():
            _write(german / Path(page).with_suffix(".po"), f"{catalogue}\n")

    left = [problem for page in parts for problem in problems(page, parts[page], catalogues[page])]
    texts = {
        page: {entry.msgid: entry.msgstr for entry in catalogue.translated_entries()}
        for page, catalogue in catalogues.items()
    }
    for page in parts:
        path, text = german / page, translated(page, parts, texts)
        if write:
            _write(path, text)
        elif not path.exists() or path.read_text(encoding="utf-8") != text:
            left.append(f"docs/workshop/de/{page}: out of date: run `python tools/translate_course.py`")
    expected = {*parts, *(str(Path(page).with_suffix(".po")) for page in parts)}
    extra = sorted({path.name for path in german.glob("*")} - expected)
    return left + [
        f"docs/workshop/de/{name}: delete it: there is no English page of this name" for name in extra
    ]


def _write(path: Path, text: str) -> None:
    """Write a file if its text changes, with the same line ends on all systems."""
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_bytes(text.encode())


def main(argv: list[str] | None = None) -> int:
    """Write the German pages, or check them."""
    parser = argparse.ArgumentParser(description="Write the German pages of the course.")
    parser.add_argument(
        "--check", action="store_true", help="write nothing, only print what is left to translate"
    )
    parser.add_argument(
        "--compendium", metavar="FILE", type=Path, help="a catalogue to take translations of new text from"
    )
    arguments = parser.parse_args(argv)
    if arguments.compendium and not arguments.compendium.exists():
        parser.error(f"{arguments.compendium} does not exist")
    try:
        left = translate(write=not arguments.check, compendium=arguments.compendium)
    except OSError as error:
        parser.error(str(error))
    print("\n".join(left) or "the course is complete in German")
    return bool(left)


if __name__ == "__main__":
    sys.exit(main())
