"""XML -> elements, each with its line. Refuses what is not XML, or nested without end."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from minirospy.errors import UrdfError

__all__ = ["Element", "parse_xml"]

_MOST_LEVELS = 100


@dataclass
class Element:
    """A tag on ``line``; ``text`` is its text without that of its children."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def all(self, tag: str) -> Iterator[Element]:
        """Yield the children of this tag, in order."""
        return (child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> Element | None:
        """Return the first child of this tag; None where there is none."""
        return next(self.all(tag), None)


def parse_xml(text: str | bytes, file: str) -> Element:
    """Return the root of an XML text; ``file`` names it in errors. Raises UrdfError."""
    parser = expat.ParserCreate()
    stack: list[Element] = []
    roots: list[Element] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        line = parser.CurrentLineNumber
        if len(stack) >= _MOST_LEVELS:
            raise UrdfError(file, line, f"tags are nested deeper than {_MOST_LEVELS} levels")
        element = Element(tag, attributes, line)
        (stack[-1].children if stack else roots).append(element)
        stack.append(element)

    def end(_: str) -> None:
        stack.pop()

    def data(part: str) -> None:
        if stack:
            stack[-1].text += part

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = data
    if not text.strip():
        raise UrdfError(file, 0, "Error document empty.")
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        why = f"not XML: {expat.ErrorString(error.code)} (column {error.offset})"
        raise UrdfError(file, error.lineno, why) from None
    except (LookupError, ValueError) as error:
        # An encoding that is unknown, or a text with a lone surrogate.
        raise UrdfError(file, 0, f"not XML: {error}") from None
    return roots[0]
