"""roslaunch.substitution_args: resolves `$(find ...)` and the other substitution arguments, together or one by one.

Programs that parse launch files themselves also call the single steps, to collect a string's arguments or to resolve some
kinds of arguments, or they set ``_rospack`` so that ``$(find ...)`` searches other folders. Source:
http://wiki.ros.org/roslaunch/XML#substitution_args.
"""

from __future__ import annotations

import math
import os
import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeAlias

from minirospy.base import names
from minirospy.ros.catkin.catkin.find_in_workspaces import find_in_workspaces
from minirospy.ros.roslaunch.launcher.substitution import convert
from minirospy.ros.rospkg.rospkg.rospack import RosPack
from minirospy.workspace.packages import Packages

__all__ = [
    "ArgException",
    "SubstitutionException",
    "_DictWrapper",
    "_anon",
    "_arg",
    "_collect_args",
    "_dirname",
    "_env",
    "_eval",
    "_eval_anon",
    "_eval_arg",
    "_eval_dict",
    "_eval_dirname",
    "_eval_env",
    "_eval_find",
    "_eval_optenv",
    "_find",
    "_find_executable",
    "_find_resource",
    "_get_executable_path",
    "_get_rospack",
    "_optenv",
    "_resolve_args",
    "_rospack",
    "_sanitize_path",
    "_separate_first_path",
    "_split_command",
    "convert_value",
    "resolve_args",
]

Context: TypeAlias = dict[str, dict[str, str]]
"""The values of args and anonymous names, under the keys ``arg`` and ``anon``; ``filename`` is the launch file."""

Command: TypeAlias = Callable[[str, str, list[str], Context], str]
"""Resolves one kind of argument. Takes the text, the argument in it, the argument's words, and the context."""

_VALID = ["find", "env", "optenv", "dirname", "anon", "arg"]
_MODULE = "roslaunch.substitution_args"

_rospack: RosPack | None = None
"""Finds the packages for ``$(find ...)``. Programs set it in ``_MODULE``, the module that they import."""


class SubstitutionException(Exception):
    """Raised if a substitution argument cannot be resolved."""


class ArgException(SubstitutionException):
    """Raised if an arg is not set."""


def resolve_args(
    arg_str: str,
    context: Context | None = None,
    resolve_anon: bool = True,
    filename: str | None = None,
) -> str:
    """Resolve a string's substitution arguments and return it; ``context`` may hold args as ``{"arg": {name: value}}``.

    Raise SubstitutionException if an argument is invalid, ArgException if an arg is not set, rospkg.ResourceNotFound if a
    package is not found, and any exception that the expression in an ``$(eval ...)`` raises.
    """
    context = {} if context is None else context
    if filename:
        context.setdefault("filename", filename)  # type: ignore[arg-type]
    if not arg_str:
        return arg_str
    if arg_str.startswith("$(eval ") and arg_str.endswith(")"):
        return _eval(arg_str[len("$(eval ") : -1], context)

    first: dict[str, Command] = {
        "env": _env,
        "optenv": _optenv,
        "dirname": _dirname,
        "anon": _anon,
        "arg": _arg,
    }
    resolved = _resolve_args(arg_str, context, resolve_anon, first)
    # Resolve the other arguments first: the path after $(find ...) may contain their results.
    return _resolve_args(resolved, context, resolve_anon, {"find": _find})


def chosen_packages() -> Packages:
    """Return the packages for ``$(find ...)`` to search: those of ``_rospack`` if it is set, else all."""
    rospack = getattr(sys.modules.get(_MODULE), "_rospack", None)
    return Packages() if rospack is None else Packages.below(*map(Path, rospack.get_ros_paths()))


def _resolve_args(arg_str: str, context: Context, resolve_anon: bool, commands: Mapping[str, Command]) -> str:
    """Resolve the kinds of substitution arguments in ``commands``; return the resulting string.

    Raise SubstitutionException if an argument is invalid.
    """
    resolved = arg_str
    for each in _collect_args(arg_str):
        verb, *words = [word for word in each.split(" ") if word] or [""]
        if verb not in _VALID:
            raise SubstitutionException(f"Unknown substitution command [{each}]. Valid commands are {_VALID}")
        if verb in commands:
            resolved = commands[verb](resolved, each, words, context)
    return resolved


def _collect_args(arg_str: str) -> list[str]:
    """Return a string's substitution arguments without ``$(`` and ``)``.

    Raise SubstitutionException if the syntax is invalid.
    """
    found = []
    for match in re.finditer(r"\$\(([^)]*)(\)?)", arg_str):
        inside, is_closed = match.groups()
        wrong = re.search(r"[$(]", inside)
        if wrong and wrong[0] == "$":
            raise SubstitutionException(f"Dollar signs '$' cannot be inside of substitution args [{arg_str}]")
        if wrong:
            raise SubstitutionException(f"Invalid left parenthesis '(' in substitution args [{arg_str}]")
        if inside and is_closed:
            found.append(inside)
    return found


def _eval_env(name: str) -> str:
    if name not in os.environ:
        raise SubstitutionException(f"environment variable '{name}' is not set")
    return os.environ[name]


def _env(resolved: str, a: str, args: list[str], context: Context) -> str:
    if len(args) != 1:
        raise SubstitutionException(f"$(env var) command only accepts one argument [{a}]")
    return resolved.replace(f"$({a})", _eval_env(args[0]))


def _eval_optenv(name: str, default: object = "") -> object:
    return os.environ.get(name, default)


def _optenv(resolved: str, a: str, args: list[str], context: Context) -> str:
    if not args:
        raise SubstitutionException(f"$(optenv var) must specify an environment variable [{a}]")
    return resolved.replace(f"$({a})", str(_eval_optenv(args[0], " ".join(args[1:]))))


def _eval_anon(id: str, anons: dict[str, str]) -> str:
    if id not in anons:
        anons[id] = names.anonymous_name(id)
    return anons[id]


def _anon(resolved: str, a: str, args: list[str], context: Context) -> str:
    if not args:
        raise SubstitutionException(f"$(anon var) must specify a name [{a}]")
    if len(args) > 1:
        raise SubstitutionException(f"$(anon var) may only specify one name [{a}]")
    return resolved.replace(f"$({a})", _eval_anon(args[0], context.setdefault("anon", {})))


def _eval_dirname(filename: object) -> str:
    if not filename:
        raise SubstitutionException("Cannot substitute $(dirname), no file/directory information available.")
    return os.path.abspath(os.path.dirname(str(filename)))


def _dirname(resolved: str, a: str, args: list[str], context: Context) -> str:
    return resolved.replace(f"$({a})", _eval_dirname(context.get("filename")))


def _eval_arg(name: str, args: Mapping[str, str]) -> str:
    if name not in args:
        raise ArgException(name)
    return args[name]


def _arg(resolved: str, a: str, args: list[str], context: Context) -> str:
    if not args:
        raise SubstitutionException(f"$(arg var) must specify a variable name [{a}]")
    if len(args) > 1:
        raise SubstitutionException(f"$(arg var) may only specify one arg [{a}]")
    return resolved.replace(f"$({a})", _eval_arg(args[0], context.setdefault("arg", {})))


def _get_rospack() -> RosPack:
    module = sys.modules.get(_MODULE)
    rospack = getattr(module, "_rospack", None)
    if rospack is None:
        rospack = RosPack()
        if module is not None:
            module._rospack = rospack  # type: ignore[attr-defined]
    assert hasattr(rospack, "get_path"), "_rospack is not a RosPack"
    found: RosPack = rospack
    return found


def _eval_find(pkg: str) -> str:
    return _get_rospack().get_path(pkg)


def _find(resolved: str, a: str, args: list[str], context: Context) -> str:
    """Resolve ``$(find PKG)``. If the path after it names a program or file in the package, insert its full path."""
    if len(args) != 1:
        raise SubstitutionException(f"$(find pkg) command only accepts one argument [{a}]")
    before, after = _split_command(resolved, a)
    path, after = _separate_first_path(after)
    path = _sanitize_path(path)
    path = path[1:] if path.startswith(("/", "\\")) else path

    rest = f"{before}$({a}){after}"
    for find in (_find_executable, _find_resource) if path else ():
        try:
            return find(rest, a, [args[0], path], context)
        except SubstitutionException:
            continue
    return before + os.path.join(_get_rospack().get_path(args[0]), path).rstrip("/\\") + after


def _find_executable(
    resolved: str, a: str, args: list[str], _context: Context, source_path_to_packages: object = None
) -> str:
    if len(args) != 2:
        raise SubstitutionException(f"$(find-executable pkg path) command only accepts two argument [{a}]")
    before, after = _split_command(resolved, a)
    path = _sanitize_path(args[1])
    built = find_in_workspaces(["libexec"], project=args[0], first_matching_workspace_only=True)
    found = _get_executable_path(built[0], os.path.basename(path)) if built else None
    found = found or _get_executable_path(_get_rospack().get_path(args[0]), path)
    if not found:
        raise SubstitutionException(f"$(find-executable pkg path) could not find executable [{a}]")
    return before + found + after


def _find_resource(
    resolved: str, a: str, args: list[str], _context: Context, source_path_to_packages: object = None
) -> str:
    if len(args) != 2:
        raise SubstitutionException(f"$(find-resource pkg path) command only accepts two argument [{a}]")
    before, after = _split_command(resolved, a)
    path = _sanitize_path(args[1])
    found = find_in_workspaces(
        ["share"], project=args[0], path=path, first_matching_workspace_only=True, first_match_only=True
    )
    if not found:
        raise SubstitutionException(f"$(find-resource pkg path) could not find path [{a}]")
    return before + found[0] + after


def _split_command(resolved: str, command_with_args: str) -> tuple[str, str]:
    before, _, after = resolved.partition(f"$({command_with_args})")
    return before, after


def _separate_first_path(value: str) -> tuple[str, str]:
    path, space, rest = value.partition(" ")
    return path, space + rest


def _sanitize_path(path: str) -> str:
    return path.replace("/", os.sep).replace("\\", os.sep)


def _get_executable_path(base_path: str, path: str) -> str | None:
    full_path = os.path.join(base_path, path)
    return full_path if os.path.isfile(full_path) and os.access(full_path, os.X_OK) else None


_eval_dict: dict[str, object] = {
    **{name: value for name, value in vars(math).items() if not name.startswith("_")},
    "true": True,
    "false": False,
    "True": True,
    "False": False,
    "env": _eval_env,
    "optenv": _eval_optenv,
    "find": _eval_find,
}
"""The names available in an ``$(eval ...)``, in addition to its args."""


class _DictWrapper:
    """The names available in an expression: functions first, then args."""

    def __init__(self, args: Mapping[str, str], functions: Mapping[str, object]) -> None:
        self._args = args
        self._functions = functions

    def __getitem__(self, key: str) -> object:
        return self._functions[key] if key in self._functions else convert(self._args[key], "auto")


def _eval(s: str, context: Context) -> str:
    """Evaluate a Python expression; return its value as a string.

    Raise SubstitutionException if the expression contains a double underscore, or any exception from the expression.
    """
    anons, args = context.setdefault("anon", {}), context.setdefault("arg", {})
    functions: dict[str, object] = {
        "anon": lambda id: _eval_anon(id, anons),
        "arg": lambda name: convert(_eval_arg(name, args), "auto"),
        "dirname": lambda: _eval_dirname(context["filename"]),
        **_eval_dict,
    }
    if "__" in s:
        raise SubstitutionException("$(eval ...) may not contain double underscore expressions")
    return str(eval(s, {}, _DictWrapper(args, functions)))  # type: ignore[arg-type]


def convert_value(value: str, type_: str) -> object:
    """Convert a parameter's text to ``type_``: str, int, double, bool, yaml or auto.

    Raise ValueError if the type is unknown or the text does not match it.
    """
    return convert(value, type_)
