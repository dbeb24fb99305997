"""Parse XML text into elements with line numbers, for launch files, robot descriptions, manifests and test results. Pure.

As in ROS, a document type is accepted, but not if it declares entities or default attribute values, because a few hundred
characters of these can expand to gigabytes. Nothing is ever loaded from another file or address.
Source: https://www.w3.org/TR/xml/.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from xml.parsers import expat

from minirospy.base.errors import MinirospyError

__all__ = ["MAX_LEVELS", "XmlElement", "XmlError", "XmlSyntaxError", "check_xml", "new_parser", "parse_xml"]

MAX_LEVELS = 100  # maximum depth of nested tags; parsers and libraries recurse at least once per level
# maximum tags per document; even a tag of 4 characters uses about 500 bytes of memory
_MAX_ELEMENTS = 1_000_000
_UNQUOTED = re.compile(rb"""<[^<"'>]*(?:"[^"]*"[^<"'>]*|'[^']*'[^<"'>]*)*?\s([\w:-]+)\s*=\s*([^\s"'<>/=]+)""")
_MAX_ADVISED = 1000  # maximum bytes of a line to search for a mistake; searches take quadratic time
_TYPOGRAPHIC_QUOTE = re.compile(rb"=\s*(?:\xe2\x80[\x98-\x9f]|\xc2[\xab\xbb])")
_UNCLOSED = re.compile(rb"""\s([\w:-]+)\s*=\s*(["'])[^"'<>]*=\2(?=[^\s/>?])""")
# Patterns of mistakes in a malformed line, each with the advice for it.
_MISTAKES = (
    (re.compile(rb"&(?!#?\w+;)"), "& is written &amp;"),
    (re.compile(rb"""=\s*(?:"[^"<]*<[^"]*"|'[^'<]*<[^']*')"""), "< in a value is written &lt;"),
    # The second alternative matches a comment that starts on an earlier line.
    (re.compile(rb"<!--(?:(?!-->).)*?--(?!>)|\A[^<=]*--(?!>)"), "a comment contains no --"),
)


class XmlError(MinirospyError):
    """The text is rejected. ``line`` is the line of the error, or 0 if unknown; ``why`` is the reason."""

    def __init__(self, line: int, why: str) -> None:
        super().__init__(line, why)
        self.line = line
        self.why = why

    def __str__(self) -> str:
        return f"line {self.line}: {self.why}" if self.line else self.why


class XmlSyntaxError(XmlError):
    """The text is not XML."""


@dataclass
class XmlElement:
    """A tag at ``line``. ``text`` excludes the text of the tag's children."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[XmlElement] = field(default_factory=list)
    text: str = ""

    def all(self, tag: str) -> Iterator[XmlElement]:
        """Yield the children with this tag, in order."""
        return (child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> XmlElement | None:
        """Return the first child with this tag, or None if there is none."""
        return next(self.all(tag), None)


def new_parser() -> expat.XMLParserType:
    """Return a parser that delivers text in large pieces. Its Parse raises XmlError for entities and attribute defaults."""
    parser = expat.ParserCreate()
    parser.buffer_text = True

    def entity(name: str, is_parameter: bool, *_: object) -> None:
        kind = f"{'%' if is_parameter else '&'}{name};"
        raise XmlError(
            parser.CurrentLineNumber,
            f"the entity {kind} is declared, and entities are not supported: write its value where it is used",
        )

    def attribute(tag: str, name: str, _type: str, default: str | None, _required: bool) -> None:
        if default is not None:
            raise XmlError(
                parser.CurrentLineNumber,
                f"a default is declared for the attribute '{name}' of <{tag}>, which is not supported: "
                "write its value where it is used",
            )

    parser.EntityDeclHandler, parser.AttlistDeclHandler = entity, attribute
    return parser


def parse_xml(text: str | bytes) -> XmlElement:
    """Parse an XML text and return its root. Raise XmlSyntaxError if it is not XML, XmlError if it is rejected."""
    parser = new_parser()
    stack: list[XmlElement] = []
    texts: list[list[str]] = []
    roots: list[XmlElement] = []
    left = _MAX_ELEMENTS

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal left
        line = parser.CurrentLineNumber
        left -= 1
        _check(line, len(stack), left)
        element = XmlElement(tag, attributes, line)
        (stack[-1].children if stack else roots).append(element)
        stack.append(element)
        texts.append([])

    def end(_: str) -> None:
        stack.pop().text = "".join(texts.pop())

    def data(part: str) -> None:
        texts[-1].append(part)

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = data
    try:
        _parse(parser, text)
    except XmlSyntaxError as error:
        raise XmlSyntaxError(error.line, f"{error.why}{_advice(error, stack, text)}") from None
    return roots[0]


def check_xml(text: str | bytes) -> None:
    """Raise XmlError if :func:`parse_xml` would reject the text. Call this before a library parses the text.

    Text that is not XML is accepted here, because callers expect the error that the library then raises.
    """
    parser = new_parser()
    level, left = 0, _MAX_ELEMENTS

    def start(*_: object) -> None:
        nonlocal level, left
        left -= 1
        _check(parser.CurrentLineNumber, level, left)
        level += 1

    def end(_: str) -> None:
        nonlocal level
        level -= 1

    parser.StartElementHandler, parser.EndElementHandler = start, end
    with suppress(XmlSyntaxError):
        _parse(parser, text)


def _advice(error: XmlSyntaxError, opened: list[XmlElement], text: str | bytes) -> str:
    """Return a hint for the usual mistakes: an element that is not closed, wrong quotes, a bare & or <, no text at all."""
    if not text.strip():
        return ": the file is empty"
    if error.why.startswith(("mismatched tag", "no element found")) and opened:
        last = opened[-1]
        return f": <{last.tag}> of line {last.line} is not closed, by /> or </{last.tag}>"
    if error.why.startswith("junk after document element"):
        return ": a file has one outermost tag"
    lines = text.split(b"\n") if isinstance(text, bytes) else text.encode("utf-8", "replace").split(b"\n")
    line = lines[error.line - 1][:_MAX_ADVISED] if 0 < error.line <= len(lines) else b""
    is_malformed = error.why.startswith("not well-formed")
    if is_malformed and _TYPOGRAPHIC_QUOTE.search(line):
        return ": a value is written in straight quotes, \" or '"
    if found := _UNQUOTED.search(line):
        name, value = (part.decode("utf-8", "replace") for part in found.groups())
        return f': a value is written in quotes: {name}="{value}"'
    if not is_malformed:
        return ""
    if found := _UNCLOSED.search(line):
        return f": the value of {found[1].decode('utf-8', 'replace')} has no closing quote"
    return next((f": {advice}" for pattern, advice in _MISTAKES if pattern.search(line)), "")


def _check(line: int, level: int, left: int) -> None:
    if level >= MAX_LEVELS:
        raise XmlError(line, f"tags are nested deeper than {MAX_LEVELS} levels")
    if left < 0:
        raise XmlError(line, f"there are more than {_MAX_ELEMENTS} tags")


def _parse(parser: expat.XMLParserType, text: str | bytes) -> None:
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        why = f"{expat.ErrorString(error.code)} (column {error.offset})"
        raise XmlSyntaxError(error.lineno, why) from None
    except (LookupError, ValueError) as error:
        # Report an unknown encoding, or text with a lone surrogate, as a syntax error.
        raise XmlSyntaxError(0, str(error)) from None
