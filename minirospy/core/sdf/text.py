"""Parse the XML of worlds and robots into elements, as leniently as Gazebo's parser (TinyXML), and write elements."""

from __future__ import annotations

from minirospy.base.errors import SdfError
from minirospy.base.tinyxml import parse_lenient
from minirospy.base.xml_text import XmlElement as Element
from minirospy.base.xml_text import XmlError, XmlSyntaxError

__all__ = ["Element", "copy_of", "new_element", "parse_document"]


def parse_document(text: str | bytes, file: str, warnings: list[str] | None = None) -> Element:
    """Parse a document and return its root. ``file`` is its name in errors. Raise SdfError if the text is rejected.

    For each kind of XML fault that is tolerated, a line is added to ``warnings``.
    """
    if not text.strip():
        raise SdfError(file, 0, "the file is empty")
    try:
        root, notes = parse_lenient(text)
    except XmlSyntaxError as error:
        raise SdfError(file, error.line, f"not XML: {error.why}") from None
    except XmlError as error:
        raise SdfError(file, error.line, error.why) from None
    if warnings is not None:
        warnings += [f"{file}:{note.line}: {note.text}" for note in notes]
    return root


def new_element(
    tag: str, text: str = "", *children: Element, line: int = 0, attributes: dict[str, str] | None = None
) -> Element:
    """Return an element that does not come from a file."""
    return Element(tag, dict(attributes or {}), line, list(children), text)


def copy_of(element: Element) -> Element:
    """Return a deep copy of an element."""
    children = [copy_of(child) for child in element.children]
    return Element(element.tag, dict(element.attributes), element.line, children, element.text)
