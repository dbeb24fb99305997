"""Values as people type and read them: YAML text in, parameter values out, and back.

Pure. Simple values, which most parameters are, are read and written without importing a YAML library: that
import costs more than all else that `rosparam get` does. ``deg(90)`` and ``rad(pi/2)`` are angles in radians.
Source: http://wiki.ros.org/rosparam, http://wiki.ros.org/YAML%20Overview.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, TypeAlias

from minirospy.errors import ValueTextError

if TYPE_CHECKING:
    import yaml

    _Loader: TypeAlias = yaml.SafeLoader | yaml.FullLoader | yaml.Loader

__all__ = [
    "add_angles",
    "check_parameter",
    "check_yaml",
    "format_pretty",
    "format_value",
    "message_values",
    "parse_arguments",
    "parse_documents",
    "parse_lines",
    "parse_value",
]

_WORDS_WITH_MEANING = frozenset({"yes", "no", "true", "false", "on", "off", "null"})
_TRUTH = {"true": True, "True": True, "false": False, "False": False}
_DOCUMENT_END = "\n...\n"
_INT32 = 2**31
_MOST_YAML_LEVELS = 200
_YAML_INDENT = re.compile(r"^[ \t?:-]+", re.MULTILINE)
_MOST_YAML_VALUES = 1_000_000
_LONGEST_ANGLE = 200


def parse_value(text: str) -> object:
    """Return the value of a YAML text. Raise ValueTextError."""
    word = text.strip()
    whole, dot, fraction = word.removeprefix("-").partition(".")
    if _is_digits(whole) and dot and _is_digits(fraction):
        return float(word)
    if word == "0" or (_is_digits(whole) and not dot and whole[0] != "0"):
        return int(word)
    if word in _TRUTH:
        return _TRUTH[word]
    if _is_plain_text(word):
        return word
    import yaml

    try:
        check_yaml(text)
        return yaml.load(text, Loader=_loader())
    except UnicodeEncodeError:
        # A byte of the command line that is not UTF-8 is a usage error, which the command reports.
        raise
    except (yaml.YAMLError, ValueError) as error:
        raise ValueTextError(text, _complaint(error)) from error


def parse_documents(text: str, where: str) -> Iterator[object]:
    """Yield the values of the documents of a YAML text, ``---`` between them. Raise ValueTextError."""
    import yaml

    try:
        check_yaml(text)
        yield from yaml.load_all(text, Loader=_loader())
    except (yaml.YAMLError, ValueError) as error:
        raise ValueTextError(where, _complaint(error)) from error


def check_yaml(text: str) -> None:
    """Raise ValueError where a YAML text is nested too deeply, or unfolds to too much by its aliases.

    Libraries of YAML read both: the first one may crash Python, what the second one gives is small only as long as
    nobody sends or prints it. Raise yaml.YAMLError where it is not YAML.
    """
    # How deep it can be at most: by its brackets, and by what its lines start with. Nearly every text ends here.
    indent = max(map(len, _YAML_INDENT.findall(text)), default=0)
    has_aliases = "*" in text and "&" in text
    if text.count("[") + text.count("{") + 2 * indent < _MOST_YAML_LEVELS and not has_aliases:
        return
    import yaml

    counts = [0]
    """How many values each open collection has so far; the document's own first."""
    anchors: list[str | None] = []
    sizes: dict[str, int | None] = {}
    """Anchor -> the values in what it names; None while that is open."""
    loader: type[yaml.SafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    for event in yaml.parse(text, Loader=loader):
        match event:
            case yaml.AliasEvent(anchor=name):
                size = sizes.get(str(name), 1)
                if size is None:
                    raise ValueError(f"the alias *{name} is inside of what it names")
                counts[-1] += size
            case yaml.ScalarEvent(anchor=name):
                counts[-1] += 1
                if name:
                    sizes[name] = 1
            case yaml.CollectionStartEvent(anchor=name):
                counts.append(1)
                anchors.append(name)
                if name:
                    sizes[name] = None
            case yaml.CollectionEndEvent():
                size, name = counts.pop(), anchors.pop()
                counts[-1] += size
                if name:
                    sizes[name] = size
        if len(counts) > _MOST_YAML_LEVELS:
            raise ValueError(f"it is nested deeper than {_MOST_YAML_LEVELS} levels")
        if has_aliases and counts[-1] > _MOST_YAML_VALUES:
            raise ValueError(f"its aliases unfold to more than {_MOST_YAML_VALUES} values")


def parse_lines(lines: Iterable[str], where: str) -> Iterator[object]:
    """Like :func:`parse_documents`, each as soon as its last line has come: `rostopic echo /a | rostopic pub /b TYPE`."""
    text: list[str] = []
    for line in lines:
        if line.rstrip() != "---":
            text.append(line)
            continue
        yield from parse_documents("".join(text), where)
        text.clear()
    yield from parse_documents("".join(text), where)


def parse_arguments(words: Sequence[str]) -> list[object]:
    """Return the values that a command line gives a message. An empty word is the empty text; to YAML it would be null."""
    return [parse_value(word) if word else "" for word in words]


def message_values(documents: Iterable[object]) -> Iterator[list[object]]:
    """Yield the values that each document gives a message: a list has one for each field."""
    for document in documents:
        if document is not None:
            yield document if isinstance(document, list) else [document]


def format_value(value: object) -> str:
    """Return a value as YAML, as `rosparam get` prints it; a list or dictionary ends with a line feed."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, str) and _is_plain_text(value):
        return value
    import yaml

    return yaml.safe_dump(value).removesuffix(_DOCUMENT_END)


def format_pretty(value: object) -> str:
    """Return a value for people's eyes, as `rosparam get -p` prints it: texts bare, not to be parsed again."""
    if isinstance(value, dict):
        return "\n".join(_pretty_lines(value, ""))
    return value if isinstance(value, str) else format_value(value)


def check_parameter(value: object, name: str) -> None:
    """Raise ValueTextError where a value, or one inside it, is nothing that a parameter can hold."""
    if isinstance(value, dict):
        for key, inner in value.items():
            if not isinstance(key, str):
                raise ValueTextError(name, f"the key {key!r} is not a text: put it in quotes")
            check_parameter(inner, f"{name.rstrip('/')}/{key}")
    elif isinstance(value, list | tuple):
        for inner in value:
            check_parameter(inner, name)
    elif value is None:
        raise ValueTextError(name, "null is not a value of a parameter: use '' or delete the parameter")
    elif isinstance(value, int) and not -_INT32 <= value < _INT32:
        raise ValueTextError(name, f"{value} is more than a parameter's 32 bits hold: write {value}.0")
    elif not isinstance(value, bool | int | float | str | bytes):
        raise ValueTextError(
            name,
            f"a {type(value).__name__} is not a parameter: quote {str(value)!r} twice for the text",
        )


def _is_digits(text: str) -> bool:
    """Nine digits at most: what YAML reads as Python does. By hand: to compile expressions takes a start's time."""
    return text.isascii() and text.isdecimal() and len(text) <= 9


def _is_plain_text(word: str) -> bool:
    """Return whether YAML reads a text as itself, for it has only letters, digits, / and _."""
    return (
        len(word) > 1
        and word.isascii()
        and word.replace("/", "_").isidentifier()
        and word.lower() not in _WORDS_WITH_MEANING
    )


def _pretty_lines(table: dict[str, object], indent: str) -> Iterator[str]:
    for key in sorted(table):
        value = table[key]
        if isinstance(value, dict) and value:
            yield f"{indent}{key}:"
            yield from _pretty_lines(value, indent + "  ")
        elif isinstance(value, str) and "\n" in value:
            yield f"{indent}{key}: |"
            yield from (f"{indent}  {line}" for line in value.split("\n"))
        else:
            text = value if isinstance(value, str) else format_value(value).removesuffix("\n")
            yield f"{indent}{key}: {text}"


def _complaint(error: Exception) -> str:
    """Return a YAML library's complaint on one line."""
    problem = " ".join(str(getattr(error, "problem", None) or error).split())
    mark = getattr(error, "problem_mark", None)
    return f"{problem} (line {mark.line + 1}, column {mark.column + 1})" if mark else problem


@lru_cache(maxsize=1)
def _loader() -> type[yaml.SafeLoader]:
    """Return a safe YAML loader that knows angles."""
    import yaml

    class AngleLoader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
        pass

    add_angles(AngleLoader)
    return AngleLoader


def add_angles(loader_class: type[_Loader]) -> None:
    """Teach a YAML loader angles: ``deg(90)``, ``rad(pi/2)``, ``!degrees 90``, ``!radians pi``."""
    import yaml

    in_brackets = re.compile(r"(deg|rad)\(([^()]*(?:\([^()]*\)[^()]*)*)\)\Z")

    def construct(unit: float) -> Callable[[_Loader, yaml.ScalarNode], float]:
        def angle(loader: _Loader, node: yaml.ScalarNode) -> float:
            text = loader.construct_scalar(node)
            match = in_brackets.match(text)
            try:
                return unit * _arithmetic(match.group(2) if match else text)
            except (ValueError, SyntaxError, ArithmeticError) as error:
                raise yaml.constructor.ConstructorError(
                    None, None, f"[{text}] is not an angle: {error}", node.start_mark
                ) from error

        return angle

    for tag, name, unit in (("!degrees", "deg", math.pi / 180.0), ("!radians", "rad", 1.0)):
        loader_class.add_constructor(tag, construct(unit))
        loader_class.add_implicit_resolver(tag, re.compile(rf"^{name}\(.*\)$"), [name[0]])


def _arithmetic(text: str) -> float:
    """Return the value of a sum over numbers and ``pi``. Raise ValueError, SyntaxError or ArithmeticError."""
    import ast
    import operator

    if len(text) > _LONGEST_ANGLE:
        # Python's parser has its own limits, and its own errors for them.
        raise ValueError(f"more than {_LONGEST_ANGLE} characters")
    binary = {
        ast.Add: operator.add,
        ast.Sub: operator.sub,
        ast.Mult: operator.mul,
        ast.Div: operator.truediv,
    }

    def value(node: ast.expr) -> float:
        match node:
            case ast.Constant(value=int() | float() as number):
                return float(number)
            case ast.Name(id="pi"):
                return math.pi
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return -value(inner)
            case ast.UnaryOp(op=ast.UAdd(), operand=inner):
                return value(inner)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in binary:
                return float(binary[type(op)](value(left), value(right)))
            case _:
                raise ValueError("only numbers, pi, + - * / and brackets")

    return value(ast.parse(text.strip(), mode="eval").body)
