"""Parse the YAML of .rviz files to plain values, and format such values as YAML that RViz reads. Pure.

Parsing and formatting are implemented here in one pass, because PyYAML's loader and dumper take seconds for a 200 kB file
or, in their compiled form, hold the GIL for that time.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

import yaml

from minirospy.base.errors import RvizFileError

if TYPE_CHECKING:
    from yaml.events import Event

__all__ = ["MAX_CHARACTERS", "format_rviz", "parse_rviz"]

MAX_CHARACTERS = 200_000  # maximum size in characters; RViz's own files have about 10,000

_MANAGER = "Visualization Manager"
_MAX_DEPTH = 50
_TEXT_TAGS = (None, "!", "tag:yaml.org,2002:str")
_LOADER: type[yaml.SafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

_SCALARS: tuple[tuple[re.Pattern[str], Callable[[str], object]], ...] = (
    (re.compile(r"true|false"), lambda text: text == "true"),
    (re.compile(r"~|null|"), lambda _: None),
    (re.compile(r"-?(?:0|[1-9][0-9]{0,14})"), int),
    (re.compile(r"-?(?:[0-9]+\.[0-9]*(?:[eE][-+]?[0-9]{1,3})?|[0-9]+[eE][-+][0-9]{1,3})"), float),
)
"""Patterns and parsers for values that are not strings. Other YAML 1.1 types (dates, octal numbers) stay strings, as in RViz."""

_PLAIN = re.compile(r"[A-Za-z0-9_/(](?:[A-Za-z0-9_/.;,()+=-]| (?=[^ #])|:(?=[^ ]))*")
"""Matches strings that need no quotes, except those that another parser could read as a number."""


def parse_rviz(text: str, name: str = "the file") -> dict[str, object]:
    """Convert the text of a .rviz file to JSON-compatible values.

    Raise RvizFileError, which contains ``name`` and the line, if it is invalid.
    """
    if len(text) > MAX_CHARACTERS:
        raise RvizFileError(name, 0, f"more than {MAX_CHARACTERS} characters")
    try:
        value = _built(yaml.parse(text, Loader=_LOADER), name)
    except yaml.MarkedYAMLError as error:
        # If the end of the file is missing, the compiled parser reports the line after the last one.
        line = min(error.problem_mark.line, text.count("\n")) + 1 if error.problem_mark else 1
        raise RvizFileError(name, line, f"not YAML: {error.problem}") from None
    except (yaml.YAMLError, ValueError) as error:
        raise RvizFileError(name, 0, f"not YAML: {str(error).splitlines()[0]}") from None

    if not isinstance(value, dict) or not isinstance(value.get(_MANAGER), dict):
        raise RvizFileError(name, 0, f'not a file of RViz: it has no "{_MANAGER}"')
    return value


def _built(events: Iterator[Event], name: str) -> object:
    """Build the document's value from YAML events. Raise RvizFileError if the document is invalid."""
    result: list[object] = []
    # The open collections (first the whole stream), each with the keys whose values are still missing.
    stack: list[tuple[list[object] | dict[str, object], list[str]]] = [(result, [])]
    for event in events:
        line = event.start_mark.line + 1 if event.start_mark else 0
        value: object
        match event:
            case yaml.AliasEvent(anchor=anchor):
                # Aliases could expand a small file to a huge value.
                raise RvizFileError(name, line, f"a file of RViz has no aliases (*{anchor})")
            case yaml.DocumentStartEvent() if result:
                raise RvizFileError(name, line, "more than one document")
            case yaml.NodeEvent() if (tag := getattr(event, "tag", None)) not in _TEXT_TAGS:
                raise RvizFileError(name, line, f"a file of RViz has no tags ({str(tag)[:80]})")
            case yaml.ScalarEvent():
                value = _scalar(event)
            case yaml.CollectionStartEvent():
                stack.append(([] if isinstance(event, yaml.SequenceStartEvent) else {}, []))
                if len(stack) > _MAX_DEPTH:
                    raise RvizFileError(name, line, "nested too deeply")
                continue
            case yaml.CollectionEndEvent():
                value, _ = stack.pop()
            case _:
                continue

        parent, waiting = stack[-1]
        if isinstance(parent, list):
            parent.append(value)
        elif waiting:
            parent[waiting.pop()] = value
        elif isinstance(event, yaml.ScalarEvent):
            waiting.append(event.value)
        else:
            raise RvizFileError(name, line, "a name that is a list or a map")
    return result[0] if result else None


def _scalar(event: yaml.ScalarEvent) -> object:
    text = str(event.value)
    if event.implicit[0]:
        for pattern, read in _SCALARS:
            if pattern.fullmatch(text):
                value = read(text)
                is_number = not isinstance(value, float) or math.isfinite(value)
                return value if is_number else str(value)
    return text


def format_rviz(config: Mapping[str, object]) -> str:
    """Format a .rviz file like RViz: keys are sorted, and lists are indented below their keys.

    Raise RvizFileError if ``config`` is nested more deeply than :func:`parse_rviz` accepts.
    """
    return "".join(f"{line}\n" for line in _lines(config, 1)) or "{}\n"


def _lines(value: Mapping[str, object] | list[object], depth: int) -> Iterator[str]:
    """Yield the lines of a nonempty map or list at nesting level ``depth``."""
    # Limit the depth, because each level adds a generator and an indentation to every line.
    if depth >= _MAX_DEPTH:
        raise RvizFileError("the file", 0, "nested too deeply")
    if isinstance(value, list):
        for each in value:
            yield from _after("-", each, " ", depth)
        return
    for name in sorted(value):
        yield from _after(f"{_text(name)}:", value[name], "\n", depth)


def _after(start: str, value: object, separator: str, depth: int) -> Iterator[str]:
    """Yield the lines of ``start``, which is a key or a dash, and of the value that follows it."""
    if not isinstance(value, dict | list) or not value:
        yield f"{start} {_word(value)}"
        return
    below = _lines(value, depth + 1)
    if separator == "\n":
        yield start
    else:
        yield f"{start} {next(below)}"
    yield from (f"  {line}" for line in below)


def _word(value: object) -> str:
    match value:
        case None:
            return "~"
        case bool():
            return str(value).lower()
        case float():
            return _number(value)
        case int() | dict() | list():
            return str(value)
        case _:
            return _text(str(value))


def _number(value: float) -> str:
    if not math.isfinite(value):
        return f"'{value}'"
    digits, _, exponent = repr(value).partition("e")
    return f"{digits if '.' in digits else digits + '.0'}e{exponent}" if exponent else digits


def _text(text: str) -> str:
    others = yaml.SafeLoader.yaml_implicit_resolvers.get(text[:1], ())
    if _PLAIN.fullmatch(text) and not any(pattern.match(text) for _, pattern in others):
        return text
    if text.isprintable():
        return "'" + text.replace("'", "''") + "'"
    return (
        '"'
        + "".join(
            each if each.isprintable() and each not in '"\\' else f"\\U{ord(each):08x}" for each in text
        )
        + '"'
    )
