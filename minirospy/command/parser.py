"""Command-line parsing: an argument parser whose usage, help and errors are printed as ROS prints them.

Most of ROS's commands use optparse: `Usage: ...`, `Options:`, `rostopic: error: ...`. Scripts and ROS's own tests match
these lines, so a :class:`Parser` with ROS's usage prints exactly these lines; minirospy's additions follow on separate
lines.
"""

from __future__ import annotations

import argparse
import itertools
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NoReturn

from minirospy.base import names
from minirospy.base.errors import UsageError
from minirospy.base.suggestions import did_you_mean

if TYPE_CHECKING:
    from re import Pattern

__all__ = [
    "AssignmentParser",
    "CommandLineError",
    "Misuse",
    "Parser",
    "attach_completer",
    "completer_of",
    "integer",
    "split_assignments",
]

_COMPLETER = "minirospy_completer"
_HELP_COLUMN = 24
_OWN_OPTIONS = "Options of minirospy"


class CommandLineError(UsageError):
    """A command line that a parser rejected; ``ros_text`` is ROS's message, including the usage."""

    def __init__(self, text: str, ros_text: str = "") -> None:
        super().__init__(text)
        self.ros_text = ros_text


class Misuse(UsageError):
    """Arguments that can be parsed but are invalid or contradict each other; ``ros`` is ROS's message.

    A command's function raises it, and the command's parser adds the usage.
    """

    def __init__(self, text: str, ros: str = "") -> None:
        super().__init__(text)
        self.ros = ros


class _Help(argparse.HelpFormatter):
    """Formats help to the width of the terminal.

    By default, argparse gets the width from shutil, whose import takes longer than argparse's own.
    """

    def __init__(self, prog: str, *args: int, **kwargs: Any) -> None:
        try:
            width = os.get_terminal_size(sys.__stdout__.fileno()).columns if sys.__stdout__ else 80
        except (OSError, ValueError):
            width = 80
        super().__init__(prog, *args, **{"width": max(width, 40) - 2, **kwargs})


class _Accepted(argparse.Action):
    """An option that is accepted for compatibility and has no effect."""

    def __init__(self, option_strings: Sequence[str], dest: str, nargs: int | str = 0, **kwargs: Any) -> None:
        super().__init__(option_strings, dest, nargs=nargs, **{**kwargs, "default": argparse.SUPPRESS})

    def __call__(self, *_: object) -> None:
        pass


class Parser(argparse.ArgumentParser):
    """An argument parser whose error messages end with the command that prints the help.

    ``ros_usage`` is ROS's usage. If it is set, options and positional arguments may alternate, as with optparse, and help
    and errors are formatted like optparse's. ``missing`` and ``surplus`` are ROS's messages for a missing or a surplus
    argument; ``missing`` may be a dict by argument name. ``about`` and ``ros_epilog`` are ROS's texts above and below the
    options. ``ros_argparse``: the program's name in ROS's errors if ROS itself uses argparse; help and errors are then
    formatted like argparse's.
    """

    def __init__(
        self,
        prog: str,
        description: str = "",
        ros_usage: str = "",
        *,
        missing: str | Mapping[str, str] = "",
        surplus: str = "",
        about: str = "",
        ros_epilog: str = "",
        ros_argparse: str = "",
        intermixed: bool | None = None,
        **kwargs: Any,
    ) -> None:
        super().__init__(prog, description=description, **{"formatter_class": _Help, **kwargs})
        if ros_argparse:
            self.usage = ros_usage

        self.ros_usage = ros_usage
        self._missing = missing
        self._surplus = surplus
        self._about = about
        self._ros_epilog = ros_epilog
        self._ros_argparse = ros_argparse
        self._intermixed = bool(ros_usage) if intermixed is None else intermixed
        self.register("action", "accepted", _Accepted)

    def add_argument(self, *names: str, completer: str = "", **kwargs: Any) -> argparse.Action:
        """Add an argument, like argparse's method.

        ``completer`` is the name of a function of minirospy.cli.completion.completers, which is imported only for tab
        completion.
        """
        action = super().add_argument(*names, **kwargs)
        if completer:
            attach_completer(action, completer)
        return action

    def accept(
        self,
        *names: str,
        help: str = "accepted, without effect",
        completer: str = "nothing",
        group: argparse._ArgumentGroup | None = None,
        **kwargs: Any,
    ) -> None:
        """Add a ROS option that has no effect here; ``nargs`` is 0 by default."""
        action = (group or self).add_argument(*names, action="accepted", help=help, **kwargs)
        if action.nargs != 0:
            attach_completer(action, completer)

    def own_options(self) -> argparse._ArgumentGroup:
        """Return the group of options that ROS's command does not have; they are printed after ROS's help."""
        for group in self._action_groups:
            if group.title == _OWN_OPTIONS:
                return group
        group = self.add_argument_group(_OWN_OPTIONS)
        group.register("action", "accepted", _Accepted)
        return group

    def parse(self, words: Sequence[str]) -> dict[str, object]:
        """Return a dict from argument name to value, to pass to the command's function.

        Raise CommandLineError if they are invalid.
        """
        parsed = self.parse_intermixed_args(words) if self._intermixed else self.parse_args(words)
        return vars(parsed)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        self._check_options(args)
        return super().parse_known_args(args, namespace)

    def parse_known_intermixed_args(self, args: Any = None, namespace: Any = None) -> Any:
        self._check_options(args)
        return super().parse_known_intermixed_args(args, namespace)

    def error(self, message: str, ros: str = "") -> NoReturn:
        """Raise CommandLineError with ``message``. ``ros`` is ROS's message if it differs."""
        ros_text = ""
        if self._ros_argparse:
            ros_text = f"{self.format_usage()}{self._ros_argparse}: error: {ros or _without_hint(message)}"
        elif self.ros_usage:
            tool = self.prog.partition(" ")[0]
            ros_text = f"{self.usage_line()}\n\n{tool}: error: {ros or self._ros_message(message)}"
        raise CommandLineError(f"{message} (`{self.prog} -h` shows what there is)", ros_text)

    def format_help(self) -> str:
        if self._ros_argparse:
            return self._ros_argparse_help()
        return self._ros_help() if self.ros_usage else super().format_help()

    def usage_line(self) -> str:
        """Return ROS's usage, which is the first line of its error messages."""
        return f"Usage: {self.ros_usage}"

    def _check_options(self, args: Sequence[str] | None) -> None:
        """Report an unknown long option before a missing argument: the option may have consumed the argument."""
        if any(action.nargs == argparse.REMAINDER for action in self._actions):
            return  # the remaining words are another program's options
        for word in itertools.takewhile("--".__ne__, sys.argv[1:] if args is None else args):
            option = word.partition("=")[0]
            if option.startswith("--") and not any(
                known.startswith(option) for known in self._option_string_actions
            ):
                hint = did_you_mean(option, self._option_string_actions, 1)
                self.error(
                    f"unrecognized arguments: {word}{hint}",
                    "" if self._ros_argparse else f"no such option: {option}",
                )

    def _ros_message(self, message: str) -> str:
        """Return the message that optparse, or ROS's command, prints instead of argparse's ``message``."""
        import re

        if match := re.match(r"unrecognized arguments: (-\S)", message):
            return f"no such option: {match[1]}"
        if self._surplus and message.startswith("unrecognized arguments"):
            return self._surplus
        if match := re.match(r"the following arguments are required: (\w+)", message):
            missing = self._missing if isinstance(self._missing, str) else self._missing.get(match[1], "")
            return missing or message
        pattern: Pattern[str]
        for pattern, text in (
            (
                re.compile(r"argument (\S+?)(/\S+)?: expected one argument"),
                r"\1 option requires 1 argument",
            ),
            (
                re.compile(r"argument (\S+?)(/\S+)?: invalid int value: (.*)"),
                r"option \1: invalid integer value: \3",
            ),
            (
                re.compile(r"argument (\S+?)(/\S+)?: invalid float value: (.*)"),
                r"option \1: invalid floating-point value: \3",
            ),
        ):
            if pattern.match(message):
                return pattern.sub(text, message)
        return re.sub(r"^argument \S+: ", "", message)

    # --- help in optparse's form

    def _ros_argparse_help(self) -> str:
        """Return help formatted like argparse's, with ROS's text above the arguments and minirospy's text at the end."""
        own, self.description = self.description, self._about
        try:
            return super().format_help() + ("\n" + _filled(own) if own else "")
        finally:
            self.description = own

    def _ros_help(self) -> str:
        """Return ROS's help byte for byte, followed by minirospy's additions."""
        groups = [group for group in self._action_groups if group.title != _OWN_OPTIONS]
        options = [action for group in groups for action in group._group_actions if action.option_strings]
        parts = [f"{self.usage_line()}\n"]
        if self._about:
            parts.append(_filled(self._about))
        parts.append(_ros_options("Options:", options))

        if self._ros_epilog:
            parts.append(_filled(self._ros_epilog))

        own = next((group._group_actions for group in self._action_groups if group.title == _OWN_OPTIONS), [])
        if own:
            parts.append(_ros_options(f"{_OWN_OPTIONS}:", own))
        arguments = [action for action in self._actions if not action.option_strings and action.help]
        rows = [(action.metavar or action.dest, action.help or "") for action in arguments]
        shown = [(str(name), text) for name, text in rows if text != argparse.SUPPRESS]
        if shown:
            parts.append(_rows("Arguments:", shown))
        parts += [_filled(text) for text in (self.description, self.epilog) if text]
        return "\n".join(parts)


class AssignmentParser(Parser):
    """A parser that, like roslaunch's, accepts NAME:=VALUE between the other arguments."""

    def parse(self, words: Sequence[str]) -> dict[str, object]:
        """Return a dict from argument name to value, with the assignments as ``args``.

        Raise CommandLineError if they are invalid.
        """
        plain, assigned = split_assignments(words)
        return {**super().parse(plain), "args": assigned}


def split_assignments(words: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """Return the arguments without the assignments, and a dict of the assigned values.

    Drop special names such as __ns, which nodes read themselves.
    """
    return [word for word in words if ":=" not in word], names.parse_launch_arguments(words)


def integer(name: str) -> Callable[[str], int]:
    """Return a function that parses an integer. ``name`` is the word for the value in ROS's error message."""

    def read(text: str) -> int:
        try:
            return int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{name} must be an integer") from None

    return read


def attach_completer(action: argparse.Action, completer: str) -> None:
    """Attach a completer, given by name, to an argument; see :meth:`Parser.add_argument`."""
    setattr(action, _COMPLETER, completer)


def completer_of(action: argparse.Action) -> str:
    """Return the name of an argument's completer, or "" if it has none."""
    return str(getattr(action, _COMPLETER, ""))


def _without_hint(message: str) -> str:
    """Return ``message`` as argparse wrote it, without the suggestions appended to it."""
    return message.partition("; did you mean ")[0]


def _width() -> int:
    """Return the width that optparse uses for help."""
    columns = os.environ.get("COLUMNS", "")
    return int(columns) - 2 if columns.isdecimal() else 78


def _filled(text: str) -> str:
    import textwrap

    return textwrap.fill(text, _width()) + "\n"


def _ros_options(title: str, actions: Iterable[argparse.Action]) -> str:
    """Format a section of the help: options such as ``-b BAGFILE, --bag=BAGFILE``, each with its help next to or below it."""
    rows = []
    for action in actions:
        if action.help == argparse.SUPPRESS:
            continue
        value = (
            ""
            if action.nargs == 0
            else str(action.dest.upper() if action.metavar is None else action.metavar)
        )
        names = sorted(action.option_strings, key=lambda name: name.startswith("--"))
        shown = [
            (f"{name}={value}" if name.startswith("--") else f"{name} {value}") if value else name
            for name in names
        ]
        rows.append((", ".join(shown), action.help or ""))
    return _rows(title, rows)


def _rows(title: str, rows: Sequence[tuple[str, str]]) -> str:
    import textwrap

    column = min(max(len(name) for name, _ in rows) + 4, _HELP_COLUMN)
    lines = [title]
    for name, text in rows:
        wrapped = textwrap.wrap(text, max(_width() - column, 11)) or [""]
        if len(name) > column - 4:
            lines.append(f"  {name}")
            lines += [" " * column + each for each in wrapped]
        else:
            lines.append(f"  {name:{column - 4}}  {wrapped[0]}".rstrip())
            lines += [" " * column + each for each in wrapped[1:]]
    return "\n".join(lines) + "\n"
