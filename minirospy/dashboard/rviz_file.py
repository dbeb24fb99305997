"""The YAML of .rviz files: text -> plain values -> text that RViz reads. Pure."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

import yaml

from minirospy.errors import RvizFileError

__all__ = ["MOST_CHARACTERS", "format_rviz", "parse_rviz"]

MOST_CHARACTERS = 1_000_000
"""RViz's own files have some ten thousand."""

_MANAGER = "Visualization Manager"
_MOST_DEPTH = 50


class _Loader(yaml.SafeLoader):
    """Reads numbers, booleans and null; what else YAML 1.1 guesses (dates, octal numbers) stays text, as in RViz."""

    yaml_implicit_resolvers = {}


_Loader.add_implicit_resolver("tag:yaml.org,2002:bool", re.compile(r"^(?:true|false)$"), list("tf"))
_Loader.add_implicit_resolver("tag:yaml.org,2002:null", re.compile(r"^(?:~|null|)$"), ["~", "n", ""])
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:int", re.compile(r"^-?(?:0|[1-9][0-9]{0,14})$"), list("-0123456789")
)
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^-?(?:[0-9]+\.[0-9]*(?:[eE][-+]?[0-9]{1,3})?|[0-9]+[eE][-+][0-9]{1,3})$"),
    list("-0123456789"),
)


class _Dumper(yaml.SafeDumper):
    """Writes lists one step to the right of their name, as RViz does, and ``~`` for nothing."""

    def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:
        return super().increase_indent(flow, False)


_Dumper.add_representer(type(None), lambda dumper, _: dumper.represent_scalar("tag:yaml.org,2002:null", "~"))


def parse_rviz(text: str, name: str = "the file") -> dict[str, object]:
    """Return the contents of a .rviz file, of values that JSON has. Raise RvizFileError with ``name`` and the line."""
    if len(text) > MOST_CHARACTERS:
        raise RvizFileError(name, 0, f"more than {MOST_CHARACTERS} characters")
    try:
        # Aliases would let a small text become a large one.
        depth = 0
        for event in yaml.parse(text, Loader=yaml.SafeLoader):
            line = event.start_mark.line + 1 if event.start_mark else 0
            if isinstance(event, yaml.AliasEvent):
                raise RvizFileError(name, line, f"a file of RViz has no aliases (*{event.anchor})")
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if depth > _MOST_DEPTH:
                raise RvizFileError(name, line, "nested too deeply")
        value = yaml.load(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise RvizFileError(name, line, f"not YAML: {error.problem}") from None
    except (yaml.YAMLError, ValueError) as error:
        raise RvizFileError(name, 0, f"not YAML: {str(error).splitlines()[0]}") from None
    except (LookupError, AttributeError, TypeError):
        # What the library raises for tags such as !!bool and !!timestamp on other text.
        raise RvizFileError(name, 0, "not YAML: a tag (!!) does not fit its value") from None

    if not isinstance(value, dict) or not isinstance(value.get(_MANAGER), dict):
        raise RvizFileError(name, 0, f'not a file of RViz: it has no "{_MANAGER}"')
    return _with_text_keys(value)


def _with_text_keys(value: Mapping[object, object]) -> dict[str, object]:
    return {
        key if isinstance(key, str) else yaml.safe_dump(key).splitlines()[0]: _plain(each)
        for key, each in value.items()
    }


def _plain(value: object) -> object:
    if isinstance(value, dict):
        return _with_text_keys(value)
    if isinstance(value, list):
        return [_plain(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    # What a tag of the text makes: sets, dates, bytes.
    return value if value is None or isinstance(value, str | int | float) else str(value)


def format_rviz(config: Mapping[str, object]) -> str:
    """Return the text of a .rviz file."""
    return yaml.dump(
        dict(config),
        Dumper=_Dumper,
        default_flow_style=False,
        sort_keys=True,
        allow_unicode=True,
        width=10_000,
    )
