"""Read XML as leniently as TinyXML, the parser of ROS's and Gazebo's C++ programs. Pure.

Text that TinyXML accepts although it is not well-formed is rewritten as well-formed XML. Each kind of change adds one note. Line
numbers are preserved. Reference: Debian's `check_urdf` (liburdfdom with TinyXML 2.6.2).
"""

from __future__ import annotations

import codecs
import re
from typing import NamedTuple

from minirospy.base.xml_text import XmlElement, XmlSyntaxError, parse_xml

__all__ = ["Note", "Parsed", "decode_xml", "parse_lenient"]

_TOKEN = re.compile(
    r"<!--(?P<comment>.*?)-->"
    r"|<!\[CDATA\[.*?\]\]>"
    r"|(?P<declaration><\?xml\b.*?\?>)"
    r"|<\?.*?\?>"
    r"|<!DOCTYPE(?=(?P<doctype>[^>\[]*))(?P=doctype)(?:\[[^\]]*\])?[^>]*>"  # the lookahead prevents quadratic time
    r"|(?P<end></[^\s<>]+\s*>)"
    r"|<(?P<tag>[A-Za-z_][^\s/>]*)(?P<attributes>(?:[^<>\"']|\"[^\"]*\"|'[^']*')*?)(?P<close>/?)>"
    r"|(?P<text>[^<]+)"
    r"|<",
    re.DOTALL,
)
_ATTRIBUTE = re.compile(
    r"""\s*([^\s=<>"'/]+)\s*=\s*("[^"]*"|'[^']*'|[^\s"'<>=/][^\s"'<>=]*?(?=\s|$))""", re.DOTALL
)
_AMPERSAND = re.compile(r"&(?!#\d+;|#x[0-9a-fA-F]+;|(?:amp|lt|gt|quot|apos);)")
_FORBIDDEN = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff\ud800-\udfff]")
_PLAIN_DECLARATION = re.compile(r"""<\?xml\s+version\s*=\s*(["'])1\.\d\1""")
_ENCODING = re.compile(rb"""^\s*<\?xml\b[^>]*?\bencoding\s*=\s*["']([A-Za-z][\w.:-]*)["']""")

_FALLBACK = "Latin-1"  # this encoding can decode any bytes, because it maps each byte to a character


class Note(NamedTuple):
    """A tolerated fault: the line of its first occurrence, and a sentence without the final period."""

    line: int
    text: str


class Parsed(NamedTuple):
    """The root element, and one note for each kind of tolerated fault."""

    root: XmlElement
    notes: tuple[Note, ...]


def parse_lenient(text: str | bytes) -> Parsed:
    """Parse XML text, tolerating the faults that TinyXML tolerates.

    Raise XmlSyntaxError for other faults, XmlError if the text is rejected.
    """
    try:
        return Parsed(parse_xml(text), ())
    except XmlSyntaxError as error:
        rewriting = _Rewriting()
        rewritten = rewriting.rewrite(text)
        try:
            return Parsed(parse_xml(rewritten), tuple(rewriting.notes.values()))
        except XmlSyntaxError:
            # Raise the first error, whose line and column refer to the original text.
            raise error from None


def decode_xml(data: bytes) -> tuple[str, str]:
    """Return the text and its encoding: UTF-8 if the data is valid UTF-8, else the declared encoding, else Latin-1."""
    declared = _ENCODING.match(data)
    for encoding in ("UTF-8", *([declared[1].decode("ascii")] if declared else [])):
        try:
            return data.decode(encoding), encoding
        except (LookupError, UnicodeError):  # UnicodeError is raised by the encoding "undefined"
            continue
    return data.decode(_FALLBACK), _FALLBACK


class _Rewriting:
    """Rewrites one document as well-formed XML. ``notes`` has one entry per kind of fault, in order of first occurrence."""

    def __init__(self) -> None:
        self.notes: dict[str, Note] = {}
        self._line = 1
        self._depth = 0

    def rewrite(self, text: str | bytes) -> str:
        """Return the text without the faults."""
        text = self._decode(text).removeprefix("\ufeff")
        if _FORBIDDEN.search(text):
            self._note("control characters are not allowed in XML, and were replaced by spaces")
            text = _FORBIDDEN.sub(" ", text)

        parts: list[str] = []
        root = ""
        for match in _TOKEN.finditer(text):
            token = match.group()
            if root and not self._depth and not _is_filler(token):
                self._line += token[: len(token) - len(token.lstrip())].count("\n")
                self._note(f"everything after the end of <{root}> is ignored")
                break
            if token == "<":
                # No parser accepts a bare "<" here. Stop searching: a text with many of them would take quadratic time.
                parts.append(text[match.start() :])
                break
            parts.append(self._token(match, is_first=match.start() == 0))
            self._line += token.count("\n")
            root = root or match["tag"] or ""
        return "".join(parts)

    def _decode(self, text: str | bytes) -> str:
        if isinstance(text, str):
            return text
        decoded, encoding = decode_xml(text)
        if encoding == _FALLBACK:
            self._note("the text is not UTF-8, and was read as Latin-1")
        return decoded

    def _token(self, match: re.Match[str], is_first: bool) -> str:
        whole = match.group()
        newlines = "\n" * whole.count("\n")
        if match["comment"] is not None:
            if "--" in match["comment"] or match["comment"].endswith("-"):
                self._note("'--' is not allowed inside a comment")
            return newlines
        if match["declaration"]:
            if not is_first:
                self._note("the XML declaration has to be at the start of the text: delete what precedes it")
            elif not _PLAIN_DECLARATION.match(whole):
                self._note('the XML declaration has to begin with <?xml version="1.0"')
            else:
                self._note_encoding(whole)
            return newlines
        if match["tag"]:
            self._depth += not match["close"]
            return f"<{match['tag']}{self._attributes(match['attributes'])}{match['close']}>"
        if match["end"]:
            self._depth -= 1
        if match["text"]:
            return self._ampersands(whole.replace("]]>", "]]&gt;"))
        return whole

    def _note_encoding(self, declaration: str) -> None:
        declared = _ENCODING.match(declaration.encode("utf-8", "replace"))
        if declared:
            name = declared[1].decode("ascii")
            try:
                codecs.lookup(name)
            except LookupError:
                self._note(f"the encoding {name} in the XML declaration is unknown")

    def _attributes(self, text: str) -> str:
        text = text.removesuffix("/")
        parts, at = [], 0
        while match := _ATTRIBUTE.match(text, at):
            at = match.end()
            before, value = match.group()[: match.start(2) - match.start()], match[2]
            if value[0] not in "\"'":
                self._note("the value of an attribute is not in quotes")
                value = f'"{value}"'
            if "<" in value:
                self._note("'<' is not allowed in an attribute: write &lt;")
            if not before[0].isspace():
                self._note("a space is missing between two attributes")
                before = " " + before
            parts.append(before + self._ampersands(value.replace("<", "&lt;")))
        return "".join(parts) + text[at:]

    def _ampersands(self, text: str) -> str:
        """Return the text without unescaped ampersands, which TinyXML drops."""
        if not _AMPERSAND.search(text):
            return text
        self._note("'&' is not allowed alone, and was ignored: write &amp;")
        return _AMPERSAND.sub("", text)

    def _note(self, text: str) -> None:
        self.notes.setdefault(text, Note(self._line, text))


def _is_filler(token: str) -> bool:
    """Return whether a token may follow the root element."""
    return not token.strip() or (token.startswith(("<!--", "<?")) and not token.startswith("<?xml"))
