"""Parse the XML of worlds and robots into elements, as leniently as Gazebo's parser (TinyXML) does, and write elements again."""

from __future__ import annotations

import re

from minirospy.base.errors import SdfError
from minirospy.base.xml_text import XmlElement as Element
from minirospy.base.xml_text import XmlError, XmlSyntaxError, parse_xml

__all__ = ["Element", "clean_xml", "copy_of", "new_element", "parse_document"]

_DECLARATION = re.compile(r"<\?xml\s.*?\?>", re.DOTALL)
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_LONE_AMPERSAND = re.compile(r"&(?!#\d+;|#x[0-9a-fA-F]+;|\w+;)")
_TAG = re.compile(r"<[A-Za-z][^<>]*>")
_BARE_VALUE = re.compile(r"""(\s[\w:.-]+=)([^\s"'<>=]+?)(?=\s|/?>)""")  # name=value without quotes
_NOT_ALLOWED = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f]")


def clean_xml(text: str | bytes) -> str:
    """Return the text without the parts that XML forbids and Gazebo's parser accepts; lines keep their numbers.

    These are a declaration with a wrong version or after other text, ``--`` in comments, and a lone ``&``.
    :func:`parse_document` also accepts attributes without quotes.
    """
    text = _NOT_ALLOWED.sub(" ", _decoded(text).removeprefix("\ufeff"))

    if "<![CDATA[" not in text:
        text = _LONE_AMPERSAND.sub("&amp;", _COMMENT.sub(_newlines, text))
    return _DECLARATION.sub(_newlines, text, count=1)


def parse_document(text: str | bytes, file: str) -> Element:
    """Parse a document and return its root. ``file`` is its name in errors. Raise SdfError if the text is not accepted."""
    cleaned = clean_xml(text)
    if not cleaned.strip():
        raise SdfError(file, 0, "the file is empty")
    try:
        return _parse(cleaned)
    except XmlSyntaxError as error:
        raise SdfError(file, error.line, f"not XML: {error.why}") from None
    except XmlError as error:
        raise SdfError(file, error.line, error.why) from None


def new_element(
    tag: str, text: str = "", *children: Element, line: int = 0, attributes: dict[str, str] | None = None
) -> Element:
    """Return an element that no file contains."""
    return Element(tag, dict(attributes or {}), line, list(children), text)


def _parse(text: str) -> Element:
    try:
        return parse_xml(text)
    except XmlSyntaxError as error:
        quoted = _TAG.sub(lambda tag: _BARE_VALUE.sub(r'\1"\2"', tag.group()), text)
        if quoted == text:
            raise
        try:
            return parse_xml(quoted)
        except XmlSyntaxError:
            raise error from None


def _decoded(text: str | bytes) -> str:
    if isinstance(text, str):
        return text
    try:
        return text.decode("utf-8")
    except UnicodeDecodeError:
        return text.decode("latin-1")


def copy_of(element: Element) -> Element:
    """Return a copy of an element with copies of its children."""
    children = [copy_of(child) for child in element.children]
    return Element(element.tag, dict(element.attributes), element.line, children, element.text)


def _newlines(match: re.Match[str]) -> str:
    return "\n" * match.group().count("\n")
