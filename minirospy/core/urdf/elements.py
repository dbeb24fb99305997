"""Parse XML into elements with line numbers. Reject text that is not XML or is nested too deeply."""

from __future__ import annotations

from minirospy.base.errors import UrdfError
from minirospy.base.xml_text import XmlElement as Element
from minirospy.base.xml_text import XmlError, XmlSyntaxError
from minirospy.base.xml_text import parse_xml as _parse

__all__ = ["Element", "parse_xml"]


def parse_xml(text: str | bytes, file: str) -> Element:
    """Parse XML text and return its root. ``file`` is its name in errors. Raise UrdfError if the text is not accepted."""
    if not text.strip():
        raise UrdfError(file, 0, "Error document empty.")
    try:
        return _parse(text)
    except XmlSyntaxError as error:
        raise UrdfError(file, error.line, f"not XML: {error.why}") from None
    except XmlError as error:
        raise UrdfError(file, error.line, error.why) from None
