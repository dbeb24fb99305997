"""Substitution arguments such as ``$(find pkg)``, ``$(arg name)`` and ``$(env VAR)``; conversion of strings to values.

Source: http://wiki.ros.org/roslaunch/XML#substitution_args.
"""

from __future__ import annotations

import builtins
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from minirospy.base import names
from minirospy.workspace.packages import Packages

__all__ = ["Substitution", "SubstitutionError", "convert"]

_PATTERN = re.compile(r"\$\(([^$()]+)\)")
_NESTED = re.compile(r"\$\([^()]*\(")
_EVAL = re.compile(r"\$\(eval (.*)\)\Z", re.DOTALL)
_ONE = {
    "find": "$(find pkg) takes one package",
    "env": "$(env VAR) takes one environment variable",
    "arg": "$(arg name) takes one arg",
    "anon": "$(anon name) takes one name",
}
# Maximum characters produced per load: each level of args that repeat other args can double the size.
_MAX_SUBSTITUTED = 64 * 1024 * 1024
_MAX_SHOWN = 200  # maximum length of a string quoted in an error message
_VERBS = (*_ONE, "optenv", "dirname", "eval")


class SubstitutionError(ValueError):
    """Raised if a substitution cannot be resolved. The message states the reason."""


@dataclass
class Substitution:
    """The values for the substitutions in one file.

    ``used`` contains every arg that was used, in any file. ``unset`` maps each arg declared without a value to the error
    message for using it.
    """

    packages: Packages
    environ: Mapping[str, str]
    file: str
    args: dict[str, str] = field(default_factory=dict)
    anonymous: dict[str, str] = field(default_factory=dict)
    used: set[str] = field(default_factory=set)
    unset: dict[str, str] = field(default_factory=dict)
    given: list[int] = field(default_factory=lambda: [0])
    """The number of characters that substitutions have produced in all files of a load."""

    def apply(self, text: str) -> str:
        """Resolve all substitutions in ``text`` and return the result.

        Raise SubstitutionError if a substitution is invalid or has no value, NotFoundError if a package is not found.
        """
        if "$(" not in text:
            return text
        whole = _EVAL.match(text)
        if whole:
            return self._eval(whole[1])
        if _NESTED.search(text):
            raise SubstitutionError(f"[{_shown(text)}]: a substitution cannot hold another, nor brackets")
        return _PATTERN.sub(lambda match: self._counted(self._one(match[1])), text)

    def _counted(self, text: str) -> str:
        self.given[0] += len(text)
        if self.given[0] > _MAX_SUBSTITUTED:
            raise SubstitutionError(
                f"the substitutions of this launch give more than {_MAX_SUBSTITUTED} characters: "
                "does an arg hold another one several times, and that one a third?"
            )
        return text

    def _one(self, text: str) -> str:
        verb, *words = text.split() or [""]
        if verb in _ONE and len(words) != 1:
            raise SubstitutionError(f"[$({_shown(text)})]: {_ONE[verb]}")
        rules: dict[str, Callable[[], str]] = {
            "find": lambda: str(self.packages.find(words[0])),
            "arg": lambda: self._arg(words[0]),
            "env": lambda: self._env(words[0]),
            "optenv": lambda: self._optenv(*words),
            "anon": lambda: self._anon(words[0]),
            "dirname": self._dirname,
        }
        if verb == "eval":
            raise SubstitutionError(
                f"[$({_shown(text)})]: $(eval ...) must stand alone, and holds an expression"
            )
        if verb not in rules:
            raise SubstitutionError(
                f"Unknown substitution command [{_shown(text)}]: there are {', '.join(_VERBS)}"
            )
        return rules[verb]()

    def _arg(self, name: str) -> str:
        self.used.add(name)
        if name not in self.args:
            if name in self.unset:
                raise SubstitutionError(self.unset[name])
            known = f" (there are: {', '.join(sorted(self.args))})" if self.args else ""
            raise SubstitutionError(f"arg '{name}' is not defined{known}")
        return self.args[name]

    def _env(self, name: str) -> str:
        if name not in self.environ:
            raise SubstitutionError(f"environment variable '{name}' is not set")
        return self.environ[name]

    def _optenv(self, name: str = "", *default: str) -> str:
        if not name:
            raise SubstitutionError("[$(optenv)]: $(optenv VAR default) takes an environment variable")
        return self.environ.get(name, " ".join(default))

    def _optenv_value(self, name: str, default: object = "") -> object:
        """Evaluate ``optenv()`` in an expression: return the variable's value, else the default (possibly a number)."""
        return self.environ.get(name, default)

    def _anon(self, name: str) -> str:
        return self.anonymous.setdefault(name, names.anonymous_name(name))

    def _dirname(self) -> str:
        return str(Path(self.file).resolve().parent)

    def _eval(self, expression: str) -> str:
        """Evaluate a Python expression; return its value as a string. Raise SubstitutionError if it is invalid.

        The expression can run any Python code, as ``<param command=...>`` can run any program.
        """
        if "__" in expression:
            raise SubstitutionError("$(eval ...) may not contain double underscore expressions")

        functions: dict[str, object] = {
            "arg": lambda name: convert(self._arg(name), "auto"),
            "env": self._env,
            "optenv": self._optenv_value,
            "find": lambda package: str(self.packages.find(package)),
            "anon": self._anon,
            "dirname": self._dirname,
            "true": True,
            "false": False,
        }

        scope = _Names(self, {**vars(builtins), **vars(math), **functions})
        try:
            return self._counted(str(eval(expression.strip(), {"__builtins__": {}}, scope)))
        except SubstitutionError:
            raise
        except Exception as error:  # noqa: BLE001 - whatever the expression does wrong
            why = " ".join(str(error).split())
            raise SubstitutionError(f"[{_shown(expression)}] cannot be evaluated: {why}") from None


def _shown(text: str) -> str:
    """Format a string for an error message: on one line, with at most ``_MAX_SHOWN`` characters."""
    text = " ".join(text[: _MAX_SHOWN + 1].split()) if "\n" in text else text
    return text if len(text) <= _MAX_SHOWN else f"{text[:_MAX_SHOWN]}..."


class _Names(dict[str, object]):
    """The names available in an expression: Python's built-ins, those from ``math``, and the args."""

    def __init__(self, substitution: Substitution, known: dict[str, object]) -> None:
        super().__init__(known)
        self._substitution = substitution

    def __missing__(self, name: str) -> object:
        if name not in self._substitution.args and name not in self._substitution.unset:
            raise KeyError(name)
        return convert(self._substitution._arg(name), "auto")


def convert(text: str, type_: str) -> object:
    """Convert a parameter's text to ``type_``: str, int, double, bool, yaml or auto.

    Raise ValueError if the type is unknown or the text does not match it.
    """
    kind = type_.strip().lower()
    if kind in ("", "auto"):
        return _guess(text)
    if kind in ("str", "string"):
        return text
    if kind == "int":
        return int(text)
    if kind == "double":  # ROS rejects "float"
        return float(text)
    if kind in ("bool", "boolean"):
        if text.strip().lower() not in ("true", "1", "false", "0"):
            raise ValueError(f"{text} is not a 'bool' type")
        return text.strip().lower() in ("true", "1")
    if kind == "yaml":
        import yaml

        from minirospy.base.yaml_text import fast_loader, load

        try:
            try:
                loaded: object = load(text, fast_loader())
            except yaml.scanner.ScannerError:
                # Like ROS's pure-Python loader, also accept a colon directly before a bracket.
                loaded = load(text, yaml.SafeLoader)
        except yaml.YAMLError as error:
            why = " ".join(str(getattr(error, "problem", None) or error).split())
            raise ValueError(f"not YAML: {why}") from None
        return loaded
    raise ValueError(f"Unknown type '{type_}': there are str, int, double, bool, yaml and auto")


def _guess(text: str) -> object:
    try:
        if "." in text:
            return float(text)
        # ROS, unlike Python, rejects underscores in an int.
        if "_" not in text:
            return int(text)
    except ValueError:
        pass
    lowered = text.lower()
    if lowered in ("true", "false"):
        return lowered == "true"
    return text
