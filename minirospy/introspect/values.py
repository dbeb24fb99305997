"""Convert parameter values from and to the YAML that users write and read.

Pure. Simple values, which most parameters are, are parsed and formatted without importing a YAML library, because the import
takes longer than everything else that `rosparam get` does. ``deg(90)`` and ``rad(pi/2)`` are angles in radians.
Source: http://wiki.ros.org/rosparam, http://wiki.ros.org/YAML%20Overview.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, TypeAlias

from minirospy.base import yaml_text
from minirospy.base.errors import ValueTextError
from minirospy.base.yaml_text import one_line
from minirospy.introspect.arithmetic import BRACKETS, degrees, radians

if TYPE_CHECKING:
    import yaml

    _Loader: TypeAlias = yaml.SafeLoader | yaml.FullLoader | yaml.Loader

__all__ = [
    "add_angles",
    "check_parameter",
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
_MAX_SHOWN_DIGITS = 40  # maximum number of digits shown of an integer in an error message


def parse_value(text: str) -> object:
    """Parse a YAML string. Raise ValueTextError if it is invalid."""
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
        return yaml_text.load(text, _loader())
    except yaml.YAMLError as error:
        if isinstance(error.__cause__, UnicodeEncodeError):
            # Do not wrap the error for text that is not UTF-8: the command reports it as a usage error.
            raise error.__cause__ from None
        accepted = _accepted_by_ros(text, error)
        if len(accepted) != 1:
            raise ValueTextError(text, one_line(error)) from error
        return accepted[0]


def parse_documents(text: str, where: str) -> Iterator[object]:
    """Yield the value of each document in a YAML string; ``---`` separates documents.

    Raise ValueTextError if the string is invalid.
    """
    import yaml

    count = 0
    try:
        for document in yaml_text.load_all(text, _loader()):
            yield document
            count += 1
    except yaml.YAMLError as error:
        accepted = _accepted_by_ros(text, error)
        if len(accepted) <= count:
            raise ValueTextError(where, one_line(error)) from error
        yield from accepted[count:]


def _accepted_by_ros(text: str, error: yaml.YAMLError) -> list[object]:
    """Return the documents of a text that the compiled loader rejected, or [] if ROS's loader rejects it, too.

    ROS uses PyYAML's loader in Python, which also accepts ``{data:[1, 2]}``, without a space after the colon.
    """
    import yaml

    if getattr(error, "problem", None) != "found unexpected ':'":
        return []
    try:
        return list(yaml_text.load_all(text, _loader(compiled=False)))
    except yaml.YAMLError:
        return []


def parse_lines(lines: Iterable[str], where: str) -> Iterator[object]:
    """Yield values like :func:`parse_documents`, but yield each as soon as its document is complete.

    For example, `rostopic echo /a | rostopic pub /b TYPE` needs this.
    """
    text: list[str] = []
    for line in lines:
        if line.rstrip() != "---":
            text.append(line)
            continue
        yield from parse_documents("".join(text), where)
        text.clear()
    yield from parse_documents("".join(text), where)


def parse_arguments(words: Sequence[str]) -> list[object]:
    """Parse a message's values from command-line arguments. An empty argument becomes an empty string, not null as in YAML."""
    return [parse_value(word) if word else "" for word in words]


def message_values(documents: Iterable[object]) -> Iterator[list[object]]:
    """For each YAML document, yield the list of values to assign to the message's fields."""
    for document in documents:
        if document is not None:
            yield document if isinstance(document, list) else [document]


def format_value(value: object) -> str:
    """Format a value as YAML, like `rosparam get`. The text for a list or dictionary ends with a line feed."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, str) and _is_plain_text(value):
        return value
    import yaml

    return yaml.safe_dump(value).removesuffix(_DOCUMENT_END)


def format_pretty(value: object, indent: str = "") -> str:
    """Format a value for people, like `rosparam get -p`: strings are not quoted, so the output may not be valid YAML.

    ``indent`` is put before the entries of a dictionary.
    """
    if isinstance(value, dict):
        return "\n".join(_pretty_lines(value, indent))
    return value if isinstance(value, str) else format_value(value)


def check_parameter(value: object, name: str) -> None:
    """Raise ValueTextError if a value, or a nested one, cannot be stored as a parameter."""
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
        digits = format_value(value)
        if len(digits) > _MAX_SHOWN_DIGITS:
            raise ValueTextError(
                name, f"{digits[:_MAX_SHOWN_DIGITS]}... is more than a parameter's 32 bits hold"
            )
        raise ValueTextError(name, f"{digits} is more than a parameter's 32 bits hold: write {digits}.0")
    elif not isinstance(value, bool | int | float | str | bytes):
        raise ValueTextError(
            name,
            f"a {type(value).__name__} is not a parameter: quote {str(value)!r} twice for the text",
        )


def _is_digits(text: str) -> bool:
    """Return whether a string consists of one to nine ASCII digits.

    Uses no regular expression, because compiling one slows the start.
    """
    return text.isascii() and text.isdecimal() and len(text) <= 9


def _is_plain_text(word: str) -> bool:
    """Return whether YAML reads an unquoted word as a string: only letters, digits, / and _, but no keyword such as ``yes``."""
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


@lru_cache(maxsize=2)
def _loader(*, compiled: bool = True) -> type[yaml.SafeLoader]:
    """Return a safe YAML loader class that accepts angles such as ``deg(90)``."""
    import yaml

    class AngleLoader(yaml_text.fast_loader() if compiled else yaml.SafeLoader):  # type: ignore[misc]
        pass

    add_angles(AngleLoader)
    return AngleLoader


def add_angles(loader_class: type[_Loader]) -> None:
    """Make a YAML loader class accept angles: ``deg(90)``, ``rad(pi/2)``, ``!degrees 90``, ``!radians pi``."""
    import yaml

    def constructor(
        evaluate: Callable[[str], float | str],
    ) -> Callable[[_Loader, yaml.ScalarNode], float | str]:
        def construct(loader: _Loader, node: yaml.ScalarNode) -> float | str:
            text = loader.construct_scalar(node)
            try:
                return evaluate(text)
            except (ValueError, SyntaxError, ArithmeticError) as error:
                raise yaml.constructor.ConstructorError(
                    None, None, f"[{text}] is not an angle: {error}", node.start_mark
                ) from error

        return construct

    for tag, name, evaluate in (("!degrees", "deg", degrees), ("!radians", "rad", radians)):
        loader_class.add_constructor(tag, constructor(evaluate))
        loader_class.add_implicit_resolver(tag, re.compile(rf"^{name}{BRACKETS}$"), [name[0]])
