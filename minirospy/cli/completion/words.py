"""Remove and add quotes and escapes in the words of a shell's command line. Pure."""

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
"""Matches strings that need no quotes in any POSIX shell."""
_PLAIN_IN_POWERSHELL = re.compile(r"[\w+=:./\\~-]*\Z")
"""Matches strings that need no quotes in PowerShell.

Commas are excluded because they make an array, and @ and % because they have other meanings.
"""


class Word(NamedTuple):
    """A word without its quotes. If ``quote`` is still open, ``text[at:]`` is the quoted part."""

    text: str
    quote: str
    at: int


class Shell(NamedTuple):
    """The syntax of a shell: a function that parses a word, and one that formats the candidate replacing it."""

    read: Callable[[str], Word]
    write: Callable[[str, Word], str]


# --- bash, zsh, fish


def _read_posix(word: str) -> Word:
    """Remove the quotes from a word. Expand $NAME, except within single quotes."""
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
    """Return ``text`` in the shell's syntax: within the user's open quote, in double quotes (a :class:`Text`) or escaped."""
    if word.quote:
        # Leave the quote open after a folder, because the user may continue the path.
        end = "" if text.endswith("/") else word.quote
        return _escaped(text[: word.at]) + word.quote + _inside(text[word.at :], word.quote) + end
    if "\n" in text or (isinstance(text, Text) and not _PLAIN.match(text)):
        return f'"{_inside(text, chr(34))}"'
    return _escaped(text)


def _inside(text: str, quote: str) -> str:
    text = text.replace("\n", _LINE_FEED)
    if quote == "'":
        return text.replace("'", r"'\''")
    # Put ! in single quotes: an interactive shell expands it from its history, even in double quotes.
    return re.sub(r'(["$`\\])', r"\\\1", text).replace("!", "\"'!'\"")


def _escaped(text: str) -> str:
    return re.sub(r"([^\w@%+=:,./~-])", r"\\\1", text)


# --- PowerShell (backtick escapes, doubled quotes inside quotes)


def _read_powershell(word: str) -> Word:
    """Remove the quotes from a word. The result's ``quote`` is the quote that starts the word, even if closed."""
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
    """Return ``text`` within the user's open quote; otherwise in single quotes if ``text`` needs quotes."""
    if word.quote == '"':
        return '"' + re.sub(r'([`$"])', r"`\1", text) + '"'
    if word.quote or not _PLAIN_IN_POWERSHELL.match(text):
        return "'" + text.replace("'", "''") + "'"
    return text


POSIX = Shell(_read_posix, _write_posix)
POWERSHELL = Shell(_read_powershell, _write_powershell)
