"""Substitution arguments: ``$(find pkg)``, ``$(arg name)``, ``$(env VAR)`` and their kin.

Source: http://wiki.ros.org/roslaunch/XML#substitution_args.
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from minirospy import names
from minirospy.workspace.packages import Packages

__all__ = ["Substitution", "SubstitutionError", "convert"]

_PATTERN = re.compile(r"\$\(([^)]*)\)")
_EVAL = re.compile(r"^\$\(eval (.*)\)$", re.DOTALL)
_ALLOWED = (
    ast.Expression, ast.BoolOp, ast.BinOp, ast.UnaryOp, ast.Compare, ast.IfExp, ast.Call, ast.Name, ast.Load,
    ast.Constant, ast.List, ast.Tuple, ast.Dict, ast.Subscript, ast.Slice, ast.boolop, ast.operator, ast.unaryop,
    ast.cmpop,
)  # fmt: skip
_LONGEST_EXPRESSION = 1000


class SubstitutionError(ValueError):
    """A substitution that cannot be made; the text says why."""


@dataclass
class Substitution:
    """What the substitutions of one file stand for."""

    packages: Packages
    environ: Mapping[str, str]
    file: str
    args: dict[str, str] = field(default_factory=dict)
    anonymous: dict[str, str] = field(default_factory=dict)

    def apply(self, text: str) -> str:
        """``text`` with every substitution made. Raises SubstitutionError, NotFoundError."""
        if "$(" not in text:
            return text
        whole = _EVAL.match(text)
        if whole:
            return str(self._eval(whole[1]))
        if "$(eval" in text:
            raise SubstitutionError("$(eval ...) must stand alone: it takes the whole attribute")
        return _PATTERN.sub(lambda match: self._one(match[1]), text)

    def _one(self, text: str) -> str:
        verb, *words = text.split()
        rules: dict[str, Callable[[list[str]], str]] = {
            "find": lambda words: str(self._find(*words)),
            "arg": lambda words: self._arg(*words),
            "env": lambda words: self._env(*words),
            "optenv": lambda words: self.environ.get(words[0], " ".join(words[1:])),
            "anon": lambda words: self._anon(*words),
            "dirname": lambda words: self._dirname(),
        }
        if verb not in rules:
            raise SubstitutionError(
                f"unknown substitution [$({text})]; there are {', '.join(rules)} and eval"
            )
        try:
            return rules[verb](words)
        except (TypeError, IndexError):
            raise SubstitutionError(f"[$({text})] has a wrong number of words") from None

    def _find(self, package: str) -> Path:
        return self.packages.find(package)

    def _arg(self, name: str) -> str:
        if name not in self.args:
            known = f" (there are: {', '.join(sorted(self.args))})" if self.args else ""
            raise SubstitutionError(f"arg '{name}' is not defined{known}")
        return self.args[name]

    def _env(self, name: str) -> str:
        if name not in self.environ:
            raise SubstitutionError(f"environment variable '{name}' is not set")
        return self.environ[name]

    def _anon(self, name: str) -> str:
        return self.anonymous.setdefault(name, names.anonymous_name(name))

    def _dirname(self) -> str:
        return str(Path(self.file).resolve().parent)

    def _eval(self, expression: str) -> Any:
        """A Python expression of numbers, texts, lists, args and a few functions; nothing else."""
        if len(expression) > _LONGEST_EXPRESSION:
            raise SubstitutionError("the $(eval ...) is too long")
        functions: dict[str, Any] = {
            "arg": lambda name: convert(self._arg(name), "auto"),
            "env": self._env,
            "optenv": lambda name, default="": self.environ.get(name, default),
            "find": lambda package: str(self._find(package)),
            "anon": self._anon,
            "dirname": self._dirname,
            "true": True,
            "false": False,
            **{kind.__name__: kind for kind in (str, int, float, bool, len, min, max, abs, round, list)},
            **{name: value for name, value in vars(math).items() if not name.startswith("_")},
        }
        scope = functions | {name: convert(value, "auto") for name, value in self.args.items()}
        try:
            tree = ast.parse(expression.strip(), mode="eval")
        except (SyntaxError, ValueError) as error:
            raise SubstitutionError(f"[{expression}] is not an expression: {error}") from None
        for node in ast.walk(tree):
            if not isinstance(node, _ALLOWED) or (
                isinstance(node, ast.Call) and not isinstance(node.func, ast.Name)
            ):
                raise SubstitutionError(f"[{expression}] holds what $(eval ...) does not allow")
            if isinstance(node, ast.Pow):
                raise SubstitutionError(f"[{expression}]: use pow(), not **")
        try:
            return eval(compile(tree, "<eval>", "eval"), {"__builtins__": {}}, scope)
        except Exception as error:  # noqa: BLE001 - whatever the expression does wrong
            raise SubstitutionError(f"[{expression}] cannot be evaluated: {error}") from None


def convert(text: str, type_: str) -> Any:
    """A parameter's text as a value of ``type_``: str, int, double, bool, yaml, or auto. Raises ValueError."""
    kind = type_.lower()
    if kind in ("", "auto"):
        return _guess(text)
    if kind in ("str", "string"):
        return text
    if kind == "int":
        return int(text)
    if kind in ("double", "float"):
        return float(text)
    if kind in ("bool", "boolean"):
        if text.strip().lower() not in ("true", "1", "false", "0"):
            raise ValueError(f"{text} is not a bool")
        return text.strip().lower() in ("true", "1")
    if kind == "yaml":
        import yaml

        try:
            return yaml.safe_load(text)
        except yaml.YAMLError as error:
            raise ValueError(f"not YAML: {' '.join(str(error).split())}") from None
    raise ValueError(f"unknown type '{type_}': there are str, int, double, bool, yaml and auto")


def _guess(text: str) -> Any:
    try:
        return float(text) if "." in text else int(text)
    except ValueError:
        pass
    lowered = text.lower()
    if lowered in ("true", "false"):
        return lowered == "true"
    return text
