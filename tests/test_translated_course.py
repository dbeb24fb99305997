"""The course is complete in German, and its German pages are those that tools/translate_course.py writes."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tools.translate_course import COURSE, GERMAN, english_pages, main, pieces, read_catalogue, translate

FENCE = re.compile(r"^```.*?^```$", re.DOTALL | re.MULTILINE)

TOPICS = """\
# Topics

English | [Deutsch](de/topics.md)

A topic has a name,
and a type.

## The commands

| command | does |
|---|---|
| `rostopic list` | lists the topics |

- See [the commands](#the-commands), and
  [setup](setup.md#the-board).
- `code` alone
"""
SETUP = """\
# Setup

English | [Deutsch](de/setup.md)

Type this:

```console
$ ls
# Setup
```

## The board

Read [more](../board.md#pins), [this](session.txt) and [ROS](https://ros.org/a#b). ![A board](pictures/board.png)
"""
GERMAN_TEXTS = {
    "topics": {
        "Topics": "Topics",
        "A topic has a name, and a type.": "Ein Topic hat einen Namen und einen Typ.",
        "The commands": "Die Befehle",
        "command": "Befehl",
        "does": "Wirkung",
        "lists the topics": "listet die Topics auf",
        "See [the commands](#the-commands), and [setup](setup.md#the-board).": (
            "Siehe [die Befehle](#the-commands) und [Einrichten](setup.md#the-board)."
        ),
        "`code` alone": "nur `code`",
    },
    "setup": {
        "Setup": "Einrichten",
        "Type this:": "Tippe das:",
        "The board": "Das Brett, größer",
        (
            "Read [more](../board.md#pins), [this](session.txt) and [ROS](https://ros.org/a#b). "
            "![A board](pictures/board.png)"
        ): (
            "Lies [mehr](../board.md#pins), [das](session.txt) und [ROS](https://ros.org/a#b). "
            "![Ein Brett](pictures/board.png)"
        ),
    },
}


@pytest.fixture
def course(tmp_path: Path) -> Path:
    """Return the folder of a small course that is complete in German."""
    (tmp_path / "topics.md").write_text(TOPICS, encoding="utf-8")
    (tmp_path / "setup.md").write_text(SETUP, encoding="utf-8")
    translate(tmp_path, write=True)
    for name, texts in GERMAN_TEXTS.items():
        for english, german in texts.items():
            put(tmp_path, name, english, german)
    assert translate(tmp_path, write=True) == []
    return tmp_path


def put(course: Path, name: str, english: str, german: str) -> None:
    """Translate one text of a page."""
    path = course / "de" / f"{name}.po"
    catalogue = read_catalogue(path)
    entry = catalogue.find(english)
    assert entry is not None, english
    entry.msgstr = german
    path.write_text(f"{catalogue}\n", encoding="utf-8")


def test_each_text_of_the_course_is_translated_and_each_german_page_is_current() -> None:
    left = translate(write=False)
    assert not left, "\n".join(left)


def test_german_texts_use_the_terms_of_the_glossary() -> None:
    glossary = read_catalogue(GERMAN / "index.po").header
    refused = re.findall(r"\bnot (\w+)", glossary)
    assert {"Knoten", "Dienst"} <= set(refused)
    word = re.compile(rf"\b(?:{'|'.join(refused)})(?:e|en|er|n|s)?\b")
    for path in sorted(GERMAN.glob("*.po")):
        found = [entry.msgstr for entry in read_catalogue(path) if word.search(entry.msgstr)]
        assert not found, f"{path.name}: see the glossary at the head of index.po: {found}"


def test_comment_at_the_head_of_a_catalogue_is_kept(course: Path) -> None:
    path = course / "de" / "topics.po"
    catalogue = read_catalogue(path)
    catalogue.header = "The glossary.\n\nnode: Node"
    path.write_text(f"{catalogue}\n", encoding="utf-8")
    assert translate(course, write=True) == []
    assert read_catalogue(path).header == "The glossary.\n\nnode: Node"


@pytest.mark.parametrize("page", english_pages())
def test_both_pages_have_the_same_code_and_the_same_headings(page: str) -> None:
    english, german = ((folder / page).read_text(encoding="utf-8") for folder in (COURSE, GERMAN))
    assert FENCE.findall(german) == FENCE.findall(english)
    outlines = [re.findall(r"^#+ ", FENCE.sub("", text), re.MULTILINE) for text in (english, german)]
    assert outlines[0] == outlines[1]


@pytest.mark.parametrize("page", english_pages())
def test_each_page_links_to_the_other_language_below_its_title(page: str) -> None:
    assert (COURSE / page).read_text(encoding="utf-8").splitlines()[2] == f"English | [Deutsch](de/{page})"
    assert (GERMAN / page).read_text(encoding="utf-8").splitlines()[2] == f"[English](../{page}) | Deutsch"


@pytest.mark.parametrize("page", english_pages())
def test_the_pieces_of_a_page_are_the_page(page: str) -> None:
    text = (COURSE / page).read_text(encoding="utf-8")
    joined = "".join(piece.text for piece in pieces(text, page))
    assert " ".join(joined.split()) == " ".join(text.split())
    for piece in pieces(text, page):
        first = piece.text.split(" ")[0]
        assert piece.kind == "kept" or first in text.splitlines()[piece.line - 1]


def test_german_page_has_the_code_of_the_english_one_and_german_links(course: Path) -> None:
    assert (
        (course / "de" / "topics.md").read_text(encoding="utf-8")
        == """\
# Topics

[English](../topics.md) | Deutsch

<!-- Written by tools/translate_course.py from ../topics.md and topics.po: change those. -->

Ein Topic hat einen Namen und einen Typ.

## Die Befehle

| Befehl | Wirkung |
|---|---|
| `rostopic list` | listet die Topics auf |

- Siehe [die Befehle](#die-befehle) und [Einrichten](setup.md#das-brett-größer).
- nur `code`
"""
    )
    assert (
        (course / "de" / "setup.md").read_text(encoding="utf-8")
        == """\
# Einrichten

[English](../setup.md) | Deutsch

<!-- Written by tools/translate_course.py from ../setup.md and setup.po: change those. -->

Tippe das:

```console
$ ls
# Setup
```

## Das Brett, größer

Lies [mehr](../../board.md#pins), [das](../session.txt) und [ROS](https://ros.org/a#b). ![Ein Brett](../pictures/board.png)
"""
    )


def test_wrapped_lines_change_nothing(course: Path) -> None:
    (course / "topics.md").write_text(TOPICS.replace("name,\nand", "name, and"), encoding="utf-8")
    assert translate(course, write=False) == []


def test_changed_sentence_is_named_and_keeps_its_old_translation_as_fuzzy(course: Path) -> None:
    changed = "A topic has a name, and a message type."
    (course / "topics.md").write_text(TOPICS.replace("and a type", "and a message type"), encoding="utf-8")
    assert translate(course, write=False) == [
        f"docs/workshop/topics.md:5: not translated: {changed}",
        "docs/workshop/de/topics.po: not on the page any more: A topic has a name, and a type.",
        "docs/workshop/de/topics.md: out of date: run `python tools/translate_course.py`",
    ]

    again = [f"docs/workshop/topics.md:5: translate again, then remove the line `#, fuzzy`: {changed}"]
    assert translate(course, write=True) == again
    assert translate(course, write=True) == again
    entry = read_catalogue(course / "de" / "topics.po").find(changed)
    assert entry is not None
    assert (entry.msgstr, entry.previous_msgid, entry.fuzzy) == (
        "Ein Topic hat einen Namen und einen Typ.",
        "A topic has a name, and a type.",
        True,
    )
    assert changed in (course / "de" / "topics.md").read_text(encoding="utf-8")

    path = course / "de" / "topics.po"
    path.write_text(path.read_text(encoding="utf-8").replace("#, fuzzy\n", ""), encoding="utf-8")
    assert translate(course, write=True) == []


def test_new_text_takes_the_translation_from_another_page_or_a_compendium(
    course: Path, tmp_path: Path
) -> None:
    (course / "topics.md").write_text(TOPICS + "\nType this:\n\nStop.\n\nWait.\n", encoding="utf-8")
    compendium = tmp_path / "more.po"
    compendium.write_text('msgid "Stop."\nmsgstr "Halt."\n', encoding="utf-8")
    left = translate(course, write=True, compendium=compendium)
    assert left == ["docs/workshop/topics.md:22: not translated: Wait."]
    assert (
        (course / "de" / "topics.md").read_text(encoding="utf-8").endswith("\nTippe das:\n\nHalt.\n\nWait.\n")
    )


def test_new_page_and_removed_page_are_named(course: Path) -> None:
    (course / "bags.md").write_text("# Bags\n", encoding="utf-8")
    (course / "setup.md").unlink()
    assert translate(course, write=False) == [
        "docs/workshop/bags.md:2: add this line below the title: English | [Deutsch](de/bags.md)",
        "docs/workshop/bags.md:1: not translated: Bags",
        "docs/workshop/de/bags.md: out of date: run `python tools/translate_course.py`",
        "docs/workshop/de/topics.md: out of date: run `python tools/translate_course.py`",
        "docs/workshop/de/setup.md: delete it: there is no English page of this name",
        "docs/workshop/de/setup.po: delete it: there is no English page of this name",
    ]


@pytest.mark.parametrize(
    ("english", "german", "fault"),
    [
        ("`code` alone", "alleine", "the code differ in the translation, [] for ['`code`']: `code` alone"),
        (
            "See [the commands](#the-commands), and [setup](setup.md#the-board).",
            "Siehe [die Befehle](#die-befehle) und [Einrichten](setup.md#the-board).",
            "the links differ in the translation, ['#die-befehle', 'setup.md#the-board'] "
            "for ['#the-commands', 'setup.md#the-board']: See [the commands]",
        ),
        ("A topic has a name, and a type.", "A topic has a name, and a type.", "still English: A topic"),
        ("lists the topics", "listet die *Topics auf", "the translation has 1 asterisks for 0: lists"),
        ("lists the topics", "", "not translated: lists the topics"),
    ],
)
def test_fault_in_a_translation_is_named(course: Path, english: str, german: str, fault: str) -> None:
    put(course, "topics", english, german)
    assert fault in translate(course, write=True)[0]


def test_catalogue_that_cannot_be_read_is_named_with_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    compendium = tmp_path / "more.po"
    compendium.write_text('msgid "Stop."\nmsgst "Halt."\n', encoding="utf-8")
    with pytest.raises(SystemExit):
        main(["--check", "--compendium", str(tmp_path / "none.po")])
    assert "none.po does not exist" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["--check", "--compendium", str(compendium)])
    assert "more.po (line 2)" in capsys.readouterr().err


def test_hand_edited_german_page_is_named(course: Path) -> None:
    page = course / "de" / "topics.md"
    page.write_text(page.read_text(encoding="utf-8").replace("Befehl", "Kommando"), encoding="utf-8")
    assert translate(course, write=False) == [
        "docs/workshop/de/topics.md: out of date: run `python tools/translate_course.py`"
    ]
    assert translate(course, write=True) == []
    assert "Kommando" not in page.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("markdown", "texts"),
    [
        ("one\ntwo\n\nthree\n", ["one two", "three"]),
        ("1. one\n   two\n2. three\n", ["one two", "three"]),
        ("text:\n- one\n  - two\n", ["text:", "one", "two"]),
        ("- [ ] one\n- [x] two\n- [three](four.md)\n", ["one", "two", "[three](four.md)"]),
        ("text\n```sh\nls # a comment\n```\nmore\n", ["text", "more"]),
        ("```sh\nls\n", []),
        ("| `a` | | 12 | b \\| c |\n", ["b \\| c"]),
        ("<!-- a comment -->\n\n    indented code\n", []),
        ("`rostopic hz`, `rostopic bw`.\n", []),
    ],
)
def test_only_prose_is_translated(markdown: str, texts: list[str]) -> None:
    assert [piece.text for piece in pieces(markdown, "page.md") if piece.kind != "kept"] == texts
