"""XML with faults that TinyXML accepts is read, with one note for each kind of fault."""

from __future__ import annotations

import pytest

from minirospy.base.tinyxml import parse_lenient
from minirospy.base.xml_text import XmlError, XmlSyntaxError

DECLARED = '<?xml version="1.0"?>\n'

ACCEPTED: dict[str, tuple[str | bytes, str, int, str]] = {
    # name: (text, the root's attribute, line of the note, part of the note)
    "dashes in a comment": (DECLARED + '<!-- a -- b --->\n<r n="x"/>', "x", 2, "'--'"),
    "blank line first": (f'\n{DECLARED}<r n="x"/>', "x", 2, "start of the text"),
    "second declaration": (f'{DECLARED}<r n="x">\n{DECLARED}</r>', "x", 3, "start of the text"),
    "bare ampersand": ('<r n="a & b"/>', "a  b", 1, "write &amp;"),
    "unknown entity": ('<r n="a&nbsp;b"/>', "anbsp;b", 1, "write &amp;"),
    "ampersand in a text": ('<r n="x">\na & b</r>', "x", 1, "write &amp;"),
    "Latin-1": ('<r n="\xe9t\xe9"/>'.encode("latin-1"), "\xe9t\xe9", 1, "read as Latin-1"),
    "text after the root": ('<r n="x"/>\n<!-- -->\n\nmore <', "x", 4, "after the end of <r>"),
    "two roots": ('<r n="x"/><r n="y"/>', "x", 1, "after the end of <r>"),
    "declaration without version": ('<?xml?><r n="x"/>', "x", 1, 'begin with <?xml version="1.0"'),
    "unknown encoding": (b'<?xml version="1.0" encoding="foo"?><r n="x"/>', "x", 1, "foo"),
    "encoding of no characters": (
        b'<?xml version="1.0" encoding="undefined"?><r n="\xe9"/>',
        "\xe9",
        1,
        "read as Latin-1",
    ),
    "value without quotes": ("<r n=x/>", "x", 1, "not in quotes"),
    "less-than sign in a value": ('<r n="a<b"/>', "a<b", 1, "write &lt;"),
    "no space between attributes": ('<r n="x"m="y"/>', "x", 1, "space is missing"),
    "control character": ('<r n="a\x01b"/>', "a b", 1, "control characters"),
}


@pytest.mark.parametrize("name", ACCEPTED)
def test_a_fault_that_tinyxml_accepts_has_one_note(name: str) -> None:
    text, value, line, words = ACCEPTED[name]
    root, notes = parse_lenient(text)
    assert root.attributes["n"] == value
    assert [(note.line, words in note.text) for note in notes] == [(line, True)]


def test_each_kind_of_fault_is_noted_once() -> None:
    root, notes = parse_lenient("<r>" + "<!-- -- -->\n<a n='&'/>" * 50 + "<b/></r>")
    assert [note.line for note in notes] == [1, 2]
    assert root.first("b").line == 51  # type: ignore[union-attr]


@pytest.mark.parametrize(
    "text",
    [
        DECLARED + '<?ok?><r n="&amp;&#65;&lt;"><![CDATA[ a & b -- <c> ]]><!-- & --></r>\n<!-- end -->',
        '<?xml version="1"?>\n<r/>',
        '<?xml version="1.0" encoding="ISO-8859-1"?><r n="\xe9"/>'.encode("latin-1"),
        '\ufeff<r n="x"/>',
    ],
)
def test_a_correct_text_has_no_notes(text: str | bytes) -> None:
    assert parse_lenient(text).notes == ()


def test_cdata_keeps_its_text_beside_a_fault() -> None:
    root, notes = parse_lenient("<r><![CDATA[a & <b> -- ]]><!-- -- --></r>")
    assert root.text == "a & <b> -- "
    assert len(notes) == 1


@pytest.mark.parametrize(
    "text", ["", "hello <r/>", "<r>", "<r></s>", "<r n/>", '<r n="1" n="2"/>', "<r><!-- </r>", "< r/>"]
)
def test_a_fault_that_tinyxml_refuses_is_an_error(text: str) -> None:
    with pytest.raises(XmlSyntaxError):
        parse_lenient(text)


def test_entities_are_refused_beside_a_fault() -> None:
    with pytest.raises(XmlError, match="entities are not supported"):
        parse_lenient('\n<?xml version="1.0"?><!DOCTYPE r [<!ENTITY a "b">]><r/>')


@pytest.mark.parametrize(
    "text",
    [
        "<r>" + "<!--" * 200_000,
        "<r " + "a" * 400_000 + ">",
        "<r>" + '<a "' * 200_000,
        "<r/>" + "<!-- -->" * 200_000 + "x",
        "<r>" + "&" * 400_000 + "</r",
        "<?xml " * 200_000,
        "<!DOCTYPE " * 40_000,
    ],
)
def test_long_texts_take_linear_time(text: str) -> None:
    """Quadratic time would be minutes: the test's timeout is the check."""
    try:
        parse_lenient(text)
    except XmlSyntaxError:
        pass
