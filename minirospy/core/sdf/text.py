"""Parse the XML of worlds and robots into elements, as leniently as Gazebo's parser (TinyXML) does, and write elements again."""

from __future__ import annotations

import re

from minirospy.base.errors import SdfError
from minirospy.base.xml_text import XmlElement as Element
from minirospy.base.xml_text import XmlError, XmlSyntaxError, parse_xml

__all__ = ["Element", "clean_xml", "new_element", "parse_document"]

_DECLARATION = re.compile(r"\s*<\?xml\b.*?\?>", re.DOTALL)
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_LONE_AMPERSAND = re.compile(r"&(?!#\d+;|#x[0-9a-fA-F]+;|\w+;)")
_NOT_ALLOWED = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f]")


def clean_xml(text: str | bytes) -> str:
    """Return the text without the parts that XML forbids and Gazebo's parser accepts; lines keep their numbers.

    These are a declaration with a wrong version or after empty lines, ``--`` in comments, and a lone ``&``.
    """
    text = _NOT_ALLOWED.sub(" ", _decoded(text).removeprefix("\ufeff"))

    declaration = _DECLARATION.match(text)
    if declaration:
        text = _newlines(declaration) + text[declaration.end() :]
    if "<![CDATA[" not in text:
        text = _LONE_AMPERSAND.sub("&amp;", _COMMENT.sub(_newlines, text))
    return text


def parse_document(text: str | bytes, file: str) -> Element:
    """Parse a document and return its root. ``file`` is its name in errors. Raise SdfError if the text is not accepted."""
    cleaned = clean_xml(text)
    if not cleaned.strip():
        raise SdfError(file, 0, "the file is empty")
    try:
        return parse_xml(cleaned)
    except XmlSyntaxError as error:
        raise SdfError(file, error.line, f"not XML: {error.why}") from None
    except XmlError as error:
        raise SdfError(file, error.line, error.why) from None


def new_element(
    tag: str, text: str = "", *children: Element, line: int = 0, attributes: dict[str, str] | None = None
) -> Element:
    """Return an element that no file contains."""
    return Element(tag, dict(attributes or {}), line, list(children), text)


def _decoded(text: str | bytes) -> str:
    if isinstance(text, str):
        return text
    try:
        return text.decode("utf-8")
    except UnicodeDecodeError:
        return text.decode("latin-1")


def _newlines(match: re.Match[str]) -> str:
    return "\n" * match.group().count("\n")
