"""Commands and verbs, each a parser and a typed function, and families of verbs under one command name.

The parser's arguments have the names of the function's parameters: `Command.run` passes them by name. Thus the parser
can be inspected without running the command, and the function can be called without a command line. A function with many
arguments takes one record that contains them: see :func:`with_options`.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from types import MappingProxyType
from typing import NamedTuple, TypeVar

from minirospy.base.errors import MinirospyError, UsageError
from minirospy.base.names import parse_arguments
from minirospy.base.suggestions import did_you_mean
from minirospy.command.command import NO_MASTER, WordedError, Wording, complain, ros_words, run
from minirospy.command.parser import CommandLineError, Misuse, Parser

__all__ = ["Command", "Family", "HelpStatus", "Verb", "deferred_verb", "with_options"]

_Options = TypeVar("_Options")


class Command(NamedTuple):
    """A command that has no verbs.

    ``interrupted`` is the exit status after Ctrl-C, ``misuse_status`` the status after a usage error.
    """

    name: str
    parser: Callable[[], Parser]
    body: Callable[..., int | None]
    interrupted: int = 0
    wording: Wording = MappingProxyType({})
    misuse_status: int = 2

    def main(self, argv: Sequence[str] | None = None) -> int:
        """Run the command; return the exit status from :func:`minirospy.command.command.run`."""
        words = sys.argv[1:] if argv is None else argv
        return run(self.name, lambda: self._run(words), self.interrupted, self.wording)

    def _run(self, words: Sequence[str]) -> int | None:
        try:
            return _call(self.parser(), self.body, words)
        except CommandLineError as error:
            if self.misuse_status == 2:
                raise
            return complain(self.name, error, self.misuse_status, error.ros_text)


class Verb(NamedTuple):
    """A verb in a family: its name, one line of help, its parser, and the function to call with the parsed arguments.

    Without a line of help, the family's help does not list the verb. In a family that is a node, the function also takes
    ``arguments``, the remapping arguments. ``wording`` contains ROS's messages for this verb's errors.
    """

    name: str
    summary: str
    parser: Callable[[], Parser]
    body: Callable[..., int | None]
    wording: Wording = MappingProxyType({})


def deferred_verb(name: str, summary: str, module: str, attribute: str = "VERB") -> Verb:
    """Return a verb whose module is imported when the verb is used. The family's other verbs start without that import."""

    def verb() -> Verb:
        found: Verb = getattr(import_module(module), attribute)
        return found

    return Verb(name, summary, lambda: verb().parser(), lambda **arguments: verb().body(**arguments))


def with_options(
    options: Callable[..., _Options], body: Callable[[_Options], int | None]
) -> Callable[..., int | None]:
    """Return a function that takes keyword arguments, puts them into an ``options`` object, and passes it to ``body``.

    ``options`` is a class whose fields have the names of the parser's arguments: a NamedTuple, because importing
    dataclasses takes longer than a command runs.
    """

    @functools.wraps(options)  # lets inspect.signature list the fields
    def call(**arguments: object) -> int | None:
        return body(options(**arguments))

    return call


class HelpStatus(NamedTuple):
    """The exit statuses of a family's help: without a verb, for `-h`, for `--help`, and for an unknown verb."""

    none: int = 2
    short: int = 0
    long: int = 0
    unknown: int = 2


class Family(NamedTuple):
    """A command and its verbs. ``headline`` describes the command; ``footer`` points to further help.

    A verb may be a family itself. ``is_node``: launch files start the command as a node (`<node pkg="rostopic"
    type="rostopic" args="pub ..."/>`), with `__name:=` and remappings among its arguments. ``interrupted``: the exit
    status after Ctrl-C. ``wording``: ROS's messages for errors. ``shows_help_on_error``: an unknown verb also prints the
    help on stdout.
    """

    name: str
    headline: str
    verbs: tuple[Verb | Family, ...]
    footer: str = ""
    is_node: bool = False
    interrupted: int = 0
    summary: str = ""
    help_status: HelpStatus = HelpStatus()
    wording: Wording = MappingProxyType({"master": NO_MASTER})
    shows_help_on_error: bool = False

    def main(self, argv: Sequence[str] | None = None) -> int:
        """Run the chosen verb; return the exit status from :func:`minirospy.command.command.run`."""
        words = list(sys.argv[1:] if argv is None else argv)
        return run(self.name, lambda: self._dispatch(words), self.interrupted, self.wording)

    def verb_name(self, verb: Verb | Family) -> str:
        """Return a verb's full name as typed by the user."""
        return verb.name.removeprefix(f"{self.name} ")

    def find(self, name: str) -> Verb | Family | None:
        """Return the verb called ``name``, or None if there is none."""
        return next((verb for verb in self.verbs if self.verb_name(verb) == name), None)

    def help(self) -> str:
        """Return the output of `-h`."""
        lines = [self.headline, ""] if self.headline else []
        lines.append("Commands:")
        lines += [
            f"\t{self.name} {self.verb_name(verb)}\t{verb.summary}" for verb in self.verbs if verb.summary
        ]
        return "\n".join([*lines, "", *([self.footer, ""] if self.footer else [])])

    def _dispatch(self, words: list[str]) -> int | None:
        if not words or words[0] in ("-h", "--help"):
            print(self.help())
            status = self.help_status
            return status.none if not words else status.short if words[0] == "-h" else status.long

        verb = self.find(words[0])
        if isinstance(verb, Family):
            return verb._dispatch(words[1:])
        if verb is None:
            return self._refuse(words[0])
        try:
            if not self.is_node:
                return _call(verb.parser(), verb.body, words[1:])
            arguments = parse_arguments(words[1:])
            return _call(verb.parser(), verb.body, arguments.plain, arguments=arguments)
        except MinirospyError as error:
            ros = ros_words(error, verb.wording)
            if not verb.wording or not ros.text:
                raise
            raise WordedError(error, ros) from error

    def _refuse(self, name: str) -> int:
        """Report that a verb does not exist, and return the exit status."""
        hint = did_you_mean(name, map(self.verb_name, self.verbs))
        error = UsageError(
            f"unknown command `{self.name} {name}`{hint} (`{self.name} -h` shows what there is)"
        )
        if self.shows_help_on_error:
            print(self.help())
        return complain(self.name, error, self.help_status.unknown)


def _call(
    parser: Parser, body: Callable[..., int | None], words: Sequence[str], **others: object
) -> int | None:
    """Parse ``words`` and call ``body`` with the resulting arguments."""
    options = parser.parse(words)
    try:
        return body(**options, **others)
    except Misuse as misuse:
        parser.error(str(misuse), misuse.ros)
