"""Parse a CMakeLists.txt into commands, without evaluating them. Pure.

Handles words, quotes, brackets and comments, and nests commands inside their ``if``, ``foreach`` or ``macro``; cmake_run.py
evaluates them. Source: https://cmake.org/cmake/help/latest/manual/cmake-language.7.html.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from minirospy.base.errors import BuildError

__all__ = ["Statement", "Word", "keyword_arguments", "parse_cmake"]

_TOKEN_PATTERN = r"""
      (?P<blank>[\s;]+)
    | (?P<comment>%s \#[^\n]*)
    | %s
    | "(?P<quoted>(?:[^"\\]|\\.)*)"
    | (?P<open>\()
    | (?P<close>\))
    | (?P<word>(?:[^\s()"\#;\\]|\\.)+)
"""
_TOKEN = re.compile(
    _TOKEN_PATTERN % (r"\#\[(?P<c>=*)\[.*?\](?P=c)\] |", r"\[(?P<b>=*)\[\n?(?P<bracket>.*?)\](?P=b)\]"),
    re.VERBOSE | re.DOTALL,
)
_TOKEN_WITHOUT_BRACKETS = re.compile(_TOKEN_PATTERN % ("", r"(?P<bracket>(?!))"), re.VERBOSE | re.DOTALL)
_BRACKET = re.compile(r"\#?\[(=*)\[")
_ENDS = {name: f"end{name}" for name in ("if", "foreach", "while", "macro", "function")}
_OPENERS = {end: name for name, end in _ENDS.items()}


class Word(NamedTuple):
    """An argument as written in the file. If ``quoted``, it remains a single word, whatever it contains."""

    text: str
    quoted: bool = False


class Statement(NamedTuple):
    """A command: its name in lower case, its arguments, the line in which it starts, and its body.

    ``body`` contains the commands before the closing ``endif()`` or ``endforeach()``, including ``else()``.
    """

    name: str
    words: tuple[Word, ...]
    line: int
    body: tuple[Statement, ...] = ()


def parse_cmake(text: str, where: str) -> tuple[Statement, ...]:
    """Parse a CMakeLists.txt. ``where`` is the file name for error messages.

    Raise BuildError if a quote, a bracket, an ``if`` or a loop is not closed.
    """
    return _nested(_commands(text.removeprefix("\ufeff"), where), where, None)


def keyword_arguments(arguments: tuple[str, ...], keywords: frozenset[str]) -> dict[str, list[str]]:
    """Group arguments by the keyword before them. Arguments before the first keyword have the key ``""``."""
    found: dict[str, list[str]] = {"": []}
    current = ""
    for word in arguments:
        if word in keywords:
            current = word
            found.setdefault(current, [])
        else:
            found[current].append(word)
    return found


def _nested(commands: Iterator[Statement], where: str, opener: Statement | None) -> tuple[Statement, ...]:
    """Return the commands up to the one that closes ``opener``. The bodies of blocks are nested."""
    statements: list[Statement] = []
    for statement in commands:
        if opener and statement.name == _ENDS[opener.name]:
            return tuple(statements)
        if statement.name in _OPENERS:
            # Report the open block as unclosed; if there is none, report a closing command without a block.
            line, missing = (
                (opener.line, _ENDS[opener.name]) if opener else (statement.line, _OPENERS[statement.name])
            )
            raise BuildError(where, line, f"{(opener or statement).name}() without {missing}()")
        statements.append(
            statement._replace(body=_nested(commands, where, statement))
            if statement.name in _ENDS
            else statement
        )
    if opener:
        raise BuildError(where, opener.line, f"{opener.name}() without {_ENDS[opener.name]}()")
    return tuple(statements)


def _commands(text: str, where: str) -> Iterator[Statement]:
    name, start = "", 0
    words: list[Word] = []
    depth = 0

    for match, line in _tokens(text, where):
        kind = match.lastgroup
        if match["blank"] or match["comment"]:
            continue

        if match["open"]:
            if not depth and not name:
                raise BuildError(where, line, "a bracket without a command before it")
            if depth:
                words.append(Word("("))
            depth += 1
        elif match["close"]:
            depth -= 1
            if depth < 0:
                raise BuildError(where, line, "a closing bracket without an opening one")
            if depth:
                words.append(Word(")"))
            else:
                yield Statement(name.lower(), tuple(words), start)
                name, words = "", []
        elif depth:
            words.append(_word(match))
        elif name or kind != "word":
            raise BuildError(where, line, f"[{_shown(name or match[0])}] is not followed by ( ... )")
        else:
            name, start = match["word"], line

    if depth or name:
        raise BuildError(where, start, f"{name}( is not closed")


def _is_closed(text: str, bracket: re.Match[str], unclosed: set[str]) -> bool:
    """Return whether the opening ``bracket`` is closed later. If not, record its level in ``unclosed``.

    Without the record, each of thousands of opening brackets would cause a search to the end of the file.
    """
    level = bracket[1]
    if level not in unclosed and text.find(f"]{level}]", bracket.end()) < 0:
        unclosed.add(level)
    return level not in unclosed


def _tokens(text: str, where: str) -> Iterable[tuple[re.Match[str], int]]:
    """Yield each token with the number of its line."""
    position, line = 0, 1
    unclosed: set[str] = set()
    while position < len(text):
        bracket = _BRACKET.match(text, position)
        is_closed = bracket is None or _is_closed(text, bracket, unclosed)
        match = (_TOKEN if is_closed else _TOKEN_WITHOUT_BRACKETS).match(text, position)
        if match is None:
            rest = text[position:].split("\n", maxsplit=1)[0].rstrip("\r")
            raise BuildError(where, line, f"a quote or bracket is not closed: {rest}")
        yield match, line
        position = match.end()
        line += match[0].count("\n")


def _shown(text: str) -> str:
    """Return the first words of a text, for an error message."""
    return " ".join(text[:40].split())


def _word(match: re.Match[str]) -> Word:
    if match["bracket"] is not None:
        # CMake expands no variables in a bracket argument, so escape text that looks like a variable reference.
        return Word(re.sub(r"([\\$])", r"\\\1", match["bracket"]), True)
    quoted = match["quoted"] is not None
    return Word(match["quoted"] if quoted else match["word"], quoted)
