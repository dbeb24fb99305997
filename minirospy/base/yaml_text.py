"""Load YAML with PyYAML's safe loaders, but reject text that would take minutes, fill the memory or crash Python. Pure.

A short text may be nested without limit, expand through its aliases, or be a single number that takes hours to parse:
`1:59:59:...` has base 60. Every rejection, and every other error in PyYAML, is raised as a yaml.YAMLError. PyYAML is
imported in the first call.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import lru_cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import yaml

    Loader = type[yaml.SafeLoader] | type[yaml.BaseLoader]

__all__ = ["check_yaml", "fast_loader", "guarded", "load", "load_all", "one_line", "safe_load"]

_MAX_LEVELS = 200  # maximum depth of nested lists and dictionaries; PyYAML recurses several times per level
_MAX_VALUES = 1_000_000  # maximum values in a text with its aliases expanded
# maximum characters in a number; parsing takes quadratic time, and a double has at most 309 digits
_MAX_NUMBER = 1_000
_INDENT = re.compile(r"^[ \t?:-]+", re.MULTILINE)
_NUMBERS = frozenset({"tag:yaml.org,2002:int", "tag:yaml.org,2002:float"})


def safe_load(text: str) -> object:
    """Parse YAML text, like yaml.safe_load. Raise yaml.YAMLError if it is invalid, TypeError if it is not a string."""
    return load(text, _plain_loader())


@lru_cache(maxsize=1)
def _plain_loader() -> type[yaml.SafeLoader]:
    """Return a safe loader that reads !!binary as bytes even after `import rosparam`, which changes PyYAML's own loaders."""
    import yaml

    class PlainLoader(yaml.SafeLoader):
        pass

    def binary(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> object:
        return loader.construct_yaml_binary(node)

    PlainLoader.add_constructor("tag:yaml.org,2002:binary", binary)
    return PlainLoader


def load(text: str, loader: Loader) -> Any:
    """Parse YAML text with a subclass of PyYAML's safe loaders.

    Raise yaml.YAMLError if the text is invalid, TypeError if it is not a string.
    """
    import yaml

    _require_text(text)
    try:
        check_yaml(text, loader)
        return yaml.load(text, Loader=guarded(loader))  # type: ignore[arg-type]
    except _RAISED as error:
        raise yaml.YAMLError(_reason(error)) from error


def load_all(text: str, loader: Loader) -> Iterator[Any]:
    """Like :func:`load`, but yield the value of each document in the text.

    Raise yaml.YAMLError if the text is invalid, TypeError if it is not a string.
    """
    import yaml

    _require_text(text)
    try:
        check_yaml(text, loader)
        documents = yaml.load_all(text, Loader=guarded(loader))  # type: ignore[arg-type]
    except _RAISED as error:
        raise yaml.YAMLError(_reason(error)) from error
    while True:
        try:
            document = next(documents)
        except StopIteration:
            return
        except _RAISED as error:
            raise yaml.YAMLError(_reason(error)) from error
        yield document


def _require_text(text: object) -> None:
    """Raise TypeError if a value is neither str nor bytes; that is an error in the program, not in the text."""
    if not isinstance(text, str | bytes):
        raise TypeError(f"YAML is a text, not {type(text).__name__}")


def fast_loader() -> type[yaml.SafeLoader]:
    """Return PyYAML's compiled safe loader or, if that is missing, the pure Python one, which takes ten times as long."""
    import yaml

    fastest: type[yaml.SafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    return fastest


@lru_cache(maxsize=32)
def guarded(loader: Loader) -> Loader:
    """Return a subclass of ``loader`` that rejects long numbers.

    The subclass also uses constructors added to ``loader`` later.
    """
    import yaml

    class Guarded(loader):  # type: ignore[valid-type,misc]
        def construct_scalar(self, node: yaml.ScalarNode) -> Any:
            value = super().construct_scalar(node)
            if len(value) > _MAX_NUMBER and node.tag in _NUMBERS:
                why = f"a number of more than {_MAX_NUMBER} characters"
                raise yaml.constructor.ConstructorError(None, None, why, node.start_mark)
            return value

    return Guarded


def check_yaml(text: str, loader: Loader | None = None) -> None:
    """Raise ValueError if a YAML text is nested too deeply, or expands too much through its aliases.

    YAML libraries accept such text: nesting may crash Python, and a value with aliases is small only until it is sent or
    printed. Raise yaml.YAMLError if the text is not YAML for ``loader`` (default: the compiled one).
    """
    # Brackets and indentation give an upper bound on the depth, which suffices for nearly all texts.
    indent = max(map(len, _INDENT.findall(text)), default=0)
    has_aliases = "*" in text and "&" in text
    if text.count("[") + text.count("{") + 2 * indent < _MAX_LEVELS and not has_aliases:
        return
    import yaml

    try:
        _check_events(yaml.parse(text, Loader=fast_loader()), has_aliases)
    except yaml.YAMLError:
        if loader is None or issubclass(loader, fast_loader()):
            raise
        # PyYAML's pure Python loader accepts more, such as {data:[1]}, but takes ten times as long.
        _check_events(yaml.parse(text, Loader=loader), has_aliases)


def _check_events(events: Iterator[yaml.Event], has_aliases: bool) -> None:
    import yaml

    counts = [0]  # number of values in each open collection, outermost first
    anchors: list[str | None] = []
    # dict from anchor to the number of values in its node, or None while the node is open
    sizes: dict[str, int | None] = {}
    for event in events:
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
        if len(counts) > _MAX_LEVELS:
            raise ValueError(f"it is nested deeper than {_MAX_LEVELS} levels")
        if has_aliases and counts[-1] > _MAX_VALUES:
            raise ValueError(f"its aliases unfold to more than {_MAX_VALUES} values")


def one_line(error: Exception) -> str:
    """Return a YAML library's error message on one line."""
    problem = " ".join(str(getattr(error, "problem", None) or error).split())
    mark = getattr(error, "problem_mark", None)
    place = f"{problem} (line {mark.line + 1}, column {mark.column + 1})" if mark else problem
    for part, advice in _ADVICE.items():
        if part in problem:
            return f"{place}: {advice}"
    return place


_ADVICE = {
    "expected ',' or ']'": "a [ is not closed, or a comma is missing",
    "expected ',' or '}'": "a { is not closed, or a comma is missing",
    "found a tab character": "YAML is indented with blanks, not with tabs",
    "character '\\t'": "YAML is indented with blanks, not with tabs",
    "mapping values are not allowed": "a value that contains a colon and a blank is written in quotes",
}
"""Advice by a part of the YAML library's error message."""


_RAISED = (ValueError, ArithmeticError, LookupError, AttributeError, TypeError, RecursionError)
"""Exceptions that check_yaml and PyYAML raise, for example for an invalid date or for !!bool before text that is not a bool."""


def _reason(error: Exception) -> str:
    if isinstance(error, ArithmeticError):
        return "a number is too large"
    if isinstance(error, RecursionError):
        return "it is nested too deeply"
    if isinstance(error, ValueError) and str(error):
        return str(error)
    return "a tag (!!) does not fit its value"
