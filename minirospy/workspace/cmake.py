"""CMakeLists.txt -> the commands in it, with variables filled in. Pure.

Only the language's surface is read: words, quotes, brackets, comments, ``set`` and ``project``; nothing is
evaluated, and commands inside ``if`` blocks are listed like all others.
Source: https://cmake.org/cmake/help/latest/manual/cmake-language.7.html.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from minirospy.errors import BuildError

__all__ = ["Command", "keyword_arguments", "parse_cmake"]

_TOKEN = re.compile(
    r"""
      (?P<blank>[\s;]+)
    | (?P<comment>\#\[(?P<c>=*)\[.*?\](?P=c)\] | \#[^\n]*)
    | \[(?P<b>=*)\[\n?(?P<bracket>.*?)\](?P=b)\]
    | "(?P<quoted>(?:[^"\\]|\\.)*)"
    | (?P<open>\()
    | (?P<close>\))
    | (?P<word>(?:[^\s()"\#;\\]|\\.)+)
    """,
    re.VERBOSE | re.DOTALL,
)
_VARIABLE = re.compile(r"\$\{([\w.+/-]+)\}|\$ENV\{(\w+)\}")


class Command(NamedTuple):
    """One command: its name in lower case, its arguments, and the line where it begins, from 1."""

    name: str
    arguments: tuple[str, ...]
    line: int


def parse_cmake(text: str, where: str, variables: Mapping[str, str]) -> list[Command]:
    """The commands of a CMakeLists.txt. ``where`` names the file in errors; ``variables`` are set beforehand.

    A variable that nobody set is empty, as in CMake. Raises BuildError where brackets or quotes do not close.
    """
    known = dict(variables)
    commands = []
    for command in _commands(text, where):
        arguments = tuple(word for argument in command.arguments for word in _expanded(argument, known))
        commands.append(command._replace(arguments=arguments))
        if command.name == "set" and arguments:
            known[arguments[0]] = ";".join(
                word for word in arguments[1:] if word not in ("CACHE", "PARENT_SCOPE")
            )
        elif command.name == "project" and arguments:
            known["PROJECT_NAME"] = arguments[0]
    return commands


def keyword_arguments(arguments: tuple[str, ...], keywords: frozenset[str]) -> dict[str, list[str]]:
    """Arguments by the keyword that they follow; those before any keyword are under ``""``."""
    found: dict[str, list[str]] = {"": []}
    current = ""
    for word in arguments:
        if word in keywords:
            current = word
            found.setdefault(current, [])
        else:
            found[current].append(word)
    return found


def _commands(text: str, where: str) -> Iterator[Command]:
    name, start = "", 0
    arguments: list[str] = []
    depth = position = 0
    while position < len(text):
        line = text.count("\n", 0, position) + 1
        match = _TOKEN.match(text, position)
        if match is None:
            raise BuildError(
                where,
                line,
                f"a quote or bracket is not closed: {text[position:].split(chr(10), maxsplit=1)[0]}",
            )
        position = match.end()
        kind = match.lastgroup
        if match["blank"] or match["comment"]:
            continue
        if match["open"]:
            if not depth and not name:
                raise BuildError(where, line, "a bracket without a command before it")
            if depth:
                arguments.append("(")
            depth += 1
        elif match["close"]:
            depth -= 1
            if depth < 0:
                raise BuildError(where, line, "a closing bracket without an opening one")
            if depth:
                arguments.append(")")
            else:
                yield Command(name.lower(), tuple(arguments), start)
                name, arguments = "", []
        elif depth:
            quoted = match["quoted"] is not None or match["bracket"] is not None
            arguments.append(('"' if quoted else "") + _argument(match))
        elif name or kind != "word":
            raise BuildError(where, line, f"[{_shown(name or match[0])}] is not followed by ( ... )")
        else:
            name, start = match["word"], line
    if depth or name:
        raise BuildError(where, start, f"{name}( is not closed")


def _shown(text: str) -> str:
    """The first words of a text, for an error."""
    return " ".join(text[:40].split())


def _argument(match: re.Match[str]) -> str:
    if match["bracket"] is not None:
        return match["bracket"]
    text = match["quoted"] if match["quoted"] is not None else match["word"]
    return re.sub(r"\\(.)", r"\1", text)


def _expanded(argument: str, known: Mapping[str, str]) -> list[str]:
    """An argument with its variables filled in; unquoted, a list in it falls apart into words."""
    quoted = argument.startswith('"')
    text = _VARIABLE.sub(lambda match: known.get(match[1] or "", ""), argument[1:] if quoted else argument)
    return [text] if quoted else [word for word in text.split(";") if word]
