"""The words of a command line, as shells write them: quotes and escapes taken out, and put in. Pure."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from typing import NamedTuple

from minirospy.cli.completion.completers import Text

__all__ = ["POSIX", "POWERSHELL", "Shell", "Word"]

_VARIABLE = re.compile(r"\$(\w+)|\$\{(\w+)\}")
_LINE_FEED = "\v"
_PLAIN = re.compile(r"[\w@%+=:,./~-]*\Z")
"""What no shell reads as more than a word."""
_PLAIN_IN_POWERSHELL = re.compile(r"[\w+=:./\\~-]*\Z")
"""The same there, where a comma makes an array, @ and % have meanings of their own."""


class Word(NamedTuple):
    """A word without its quotes; the one that is still open at its end was opened at ``text[at:]``."""

    text: str
    quote: str
    at: int


class Shell(NamedTuple):
    """How a shell's words are read, and how a candidate for a word is written."""

    read: Callable[[str], Word]
    write: Callable[[str, Word], str]


# --- bash, zsh, fish


def _read_posix(word: str) -> Word:
    """Return a word without its quotes; $NAME outside of single ones is replaced by its value."""
    text = ""
    quote = ""
    at = read = 0
    while read < len(word):
        letter = word[read]
        variable = _VARIABLE.match(word, read) if quote != "'" else None
        value = os.environ.get(variable[1] or variable[2]) if variable else None
        read += 1

        if letter == "\\" and quote != "'":
            text += word[read : read + 1]
            read += 1
        elif variable and value is not None:
            text += value
            read = variable.end()
        elif letter == quote:
            quote = ""
        elif letter in "'\"" and not quote:
            quote, at = letter, len(text)
        else:
            text += letter

    return Word(text, quote, at)


def _write_posix(text: str, word: Word) -> str:
    """Return ``text`` as shells read it: in the quotes that were opened; else a :class:`Text` in double ones."""
    if word.quote:
        # A folder's quotes stay open: what is in it comes next.
        end = "" if text.endswith("/") else word.quote
        return _escaped(text[: word.at]) + word.quote + _inside(text[word.at :], word.quote) + end
    if "\n" in text or (isinstance(text, Text) and not _PLAIN.match(text)):
        return f'"{_inside(text, chr(34))}"'
    return _escaped(text)


def _inside(text: str, quote: str) -> str:
    text = text.replace("\n", _LINE_FEED)
    if quote == "'":
        return text.replace("'", r"'\''")
    # A shell for people puts old commands in place of an exclamation mark, in double quotes too.
    return re.sub(r'(["$`\\])', r"\\\1", text).replace("!", "\"'!'\"")


def _escaped(text: str) -> str:
    return re.sub(r"([^\w@%+=:,./~-])", r"\\\1", text)


# --- PowerShell: the backtick escapes, a quote inside its own quotes is doubled


def _read_powershell(word: str) -> Word:
    """Return a word without its quotes; ``quote`` is the one that it began with, whether closed or not."""
    text = ""
    quote = ""
    read = 0
    while read < len(word):
        letter = word[read]
        read += 1
        if letter == "`" and quote != "'":
            text += word[read : read + 1]
            read += 1
        elif letter == quote and word[read : read + 1] == quote:
            text += letter
            read += 1
        elif letter == quote:
            quote = ""
        elif letter in "'\"" and not quote:
            quote = letter
        else:
            text += letter
    return Word(text, word[:1] if word[:1] in ("'", '"') else "", 0)


def _write_powershell(text: str, word: Word) -> str:
    """Return ``text`` in the quotes that its word began with; else in single ones where it needs any."""
    if word.quote == '"':
        return '"' + re.sub(r'([`$"])', r"`\1", text) + '"'
    if word.quote or not _PLAIN_IN_POWERSHELL.match(text):
        return "'" + text.replace("'", "''") + "'"
    return text


POSIX = Shell(_read_posix, _write_posix)
POWERSHELL = Shell(_read_powershell, _write_powershell)
