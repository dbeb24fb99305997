"""Parse XML into elements with line numbers, as leniently as ROS's parser. Reject all other text, and deep nesting."""

from __future__ import annotations

from minirospy.base.errors import UrdfError
from minirospy.base.tinyxml import Note, Parsed, parse_lenient
from minirospy.base.xml_text import XmlElement as Element
from minirospy.base.xml_text import XmlError, XmlSyntaxError

__all__ = ["Element", "Note", "parse_noted", "parse_xml"]


def parse_xml(text: str | bytes, file: str) -> Element:
    """Parse XML text and return its root. ``file`` is its name in errors. Raise UrdfError if the text is not accepted."""
    return parse_noted(text, file).root


def parse_noted(text: str | bytes, file: str) -> Parsed:
    """Parse like :func:`parse_xml`; return the root, and a note for each kind of fault that was tolerated."""
    if not text.strip():
        raise UrdfError(file, 0, "Error document empty.")
    try:
        return parse_lenient(text)
    except XmlSyntaxError as error:
        raise UrdfError(file, error.line, f"not XML: {error.why}") from None
    except XmlError as error:
        raise UrdfError(file, error.line, error.why) from None
