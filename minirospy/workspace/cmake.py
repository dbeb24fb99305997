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

    A variable that nobody set is empty, as in CMake; loops over words are unrolled. Raises BuildError where brackets,
    quotes or loops do not close.
    """
    return list(_evaluated(list(_commands(text, where)), where, dict(variables)))


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


def _evaluated(commands: list[Command], where: str, known: dict[str, str]) -> Iterator[Command]:
    """The commands with their variables filled in. ``known`` grows by what they set."""
    position = 0
    while position < len(commands):
        command = commands[position]
        position += 1
        arguments = tuple(word for argument in command.arguments for word in _expanded(argument, known))
        if command.name == "foreach" and arguments:
            end = _end_of_loop(commands, position, where)
            for item in _loop_items(arguments[1:], known):
                known[arguments[0]] = item
                yield from _evaluated(commands[position:end], where, known)
            position = end + 1
            continue
        _assign(command.name, arguments, known)
        yield command._replace(arguments=arguments)


def _end_of_loop(commands: list[Command], start: int, where: str) -> int:
    depth = 1
    for index in range(start, len(commands)):
        depth += {"foreach": 1, "endforeach": -1}.get(commands[index].name, 0)
        if not depth:
            return index
    raise BuildError(where, commands[start - 1].line, "foreach() without endforeach()")


def _loop_items(words: tuple[str, ...], known: Mapping[str, str]) -> list[str]:
    """What a loop runs over: words, or ``IN LISTS`` of variables and ``ITEMS``. A range of numbers is left out."""
    if words[:1] == ("RANGE",):
        return []
    if words[:1] != ("IN",):
        return list(words)
    given = keyword_arguments(words[1:], frozenset(["LISTS", "ITEMS", "ZIP_LISTS"]))
    lists = [word for name in given.get("LISTS", []) for word in known.get(name, "").split(";") if word]
    return [*lists, *given.get("ITEMS", [])]


def _assign(name: str, arguments: tuple[str, ...], known: dict[str, str]) -> None:
    """What a command does to the variables."""
    if name == "project" and arguments:
        known["PROJECT_NAME"] = arguments[0]
    elif name == "set" and arguments:
        values = list(arguments[1:])
        ends = [values.index(word) for word in ("CACHE", "PARENT_SCOPE") if word in values]
        known[arguments[0]] = ";".join(values[: min(ends, default=len(values))])
    elif name == "list" and arguments[:1] == ("APPEND",) and len(arguments) > 1:
        before = [known[arguments[1]]] if known.get(arguments[1]) else []
        known[arguments[1]] = ";".join([*before, *arguments[2:]])


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
