"""`minirospy complete INDEX WORD...`: print the completions at the cursor, one per line. Called by shells for TAB.

The input consists of a command line's words as the shell stores them (quotes included), and INDEX, the index of the word
at the cursor. The output consists of candidates in the form that the shell inserts: quoted if necessary, with a vertical
tab for each line feed inside (`minirospy complete --one-line INDEX WORD...`: without line feeds; `--powershell`: without
line feeds, words and candidates in PowerShell's syntax). A candidate that ends in ``/`` or ``=`` can be continued; any
other is followed by a space.

Verbs and options are read from the command's own parser, not from a second list, and so are the completers for
arguments and option values: see minirospy.command.parser.Parser.add_argument. Completion never fails with an error, and
waits for a master only as long as a user would. Source: http://wiki.ros.org/rosbash#Tab_completion.
"""

from __future__ import annotations

import contextlib
import os
import re
import sys
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from minirospy.base.errors import MinirospyError
from minirospy.base.escape import has_controls
from minirospy.cli.completion import completers
from minirospy.cli.completion.completers import Completer, Cursor
from minirospy.cli.completion.words import POSIX, POWERSHELL, Shell
from minirospy.cli.registry import COMMANDS, SHELL_FUNCTIONS, Entry, find_script, find_verb
from minirospy.command.parser import completer_of
from minirospy.command.verbs import Family

if TYPE_CHECKING:
    import argparse

    from minirospy.command.parser import Parser
    from minirospy.command.verbs import Command, Verb


__all__ = ["candidates", "main"]

_NUMBER = re.compile(r"-\.?\d")
_SPACES = dict.fromkeys(map(ord, "\n\t"))
_ONE_LINE = "--one-line"
_POWERSHELL = "--powershell"
_OPTIONS = ["-h", "--help", "-V", "--version"]


def main(argv: Sequence[str] | None = None) -> int:
    """Print the completion candidates; always return 0."""
    words = list(sys.argv[1:] if argv is None else argv)
    # Completion runs while the user types, so print nothing instead of an error.
    with contextlib.suppress(Exception):
        shell = POWERSHELL if words[0] == _POWERSHELL else POSIX
        one_line = words[0] in (_ONE_LINE, _POWERSHELL)
        index, *line = words[1:] if one_line else words
        found = candidates(int(index), line, one_line=one_line, shell=shell)
        sys.stdout.reconfigure(errors="surrogateescape")  # type: ignore[union-attr]
        print("\n".join(found), end="", flush=True)
    return 0


def candidates(
    index: int, words: Sequence[str], *, one_line: bool = False, shell: Shell = POSIX
) -> list[str]:
    """Return the candidates for ``words[index]``, as the shell inserts them. With ``one_line``, omit line feeds."""
    if not 0 < index <= len(words):
        return []
    word = shell.read(words[index] if index < len(words) else "")
    command, *before = (_at_home(shell.read(each).text) for each in words[:index])
    command = re.split(r"[/\\]", command)[-1].removesuffix(".exe")
    try:
        found = _of_command(command, before, word.text)
        fitting = (completers.on_one_line(text) if one_line else text for text in found)
        # Drop names with control characters, which the shell would send to the terminal.
        fitting = (text for text in fitting if not has_controls(text.translate(_SPACES)))
        return [shell.write(text, word) for text in dict.fromkeys(fitting) if text.startswith(word.text)]
    except MinirospyError:
        # Offer nothing if the package or type is unknown: the command itself will report that.
        return []


# --- the command and word to complete


def _of_command(command: str, before: list[str], word: str) -> Iterable[str]:
    if command == "minirospy":
        return _of_minirospy(before, word)
    if command in SHELL_FUNCTIONS:
        return _completer(SHELL_FUNCTIONS[command])(Cursor("", tuple(before), word))
    entry = find_script(command)
    return _of_entry(entry, before, word) if entry else ()


def _of_minirospy(before: list[str], word: str) -> Iterable[str]:
    if not before:
        verbs = [entry.verb for entry in COMMANDS if entry.verb and entry.summary]
        return _OPTIONS if word.startswith("-") else verbs
    entry = find_verb(before[0])
    return _of_entry(entry, before[1:], word) if entry else ()


def _of_entry(entry: Entry, before: list[str], word: str) -> Iterable[str]:
    """Return the candidates for the next word of a registered command."""
    if entry.completer:
        return _completer(entry.completer)(Cursor("", tuple(before), word))
    grammar: Command | Family | Verb | None = entry.load_grammar()
    verb = ""
    while isinstance(grammar, Family):
        if not before:
            names = [grammar.verb_name(each) for each in grammar.verbs]
            return _OPTIONS[:2] if word.startswith("-") else names
        verb, *before = before
        grammar = grammar.find(verb)
    return _of_parser(grammar.parser(), verb, before, word) if grammar else ()


def _of_parser(parser: Parser, verb: str, before: list[str], word: str) -> Iterable[str]:
    """Return the candidates for the next word of a command line that ``parser`` would parse."""
    options = {name: action for action in parser._actions for name in action.option_strings}
    given: list[str] = []
    pending: argparse.Action | None = None
    for each in before:
        if each in options:
            # An optional value is always a number, so offer no completions for it.
            pending = options[each] if options[each].nargs not in (0, "?") else None
        elif pending is not None:
            pending = pending if pending.nargs in ("+", "*") else None
        elif (not each.startswith("-") or _NUMBER.match(each)) and ":=" not in each:
            given.append(each)

    cursor = Cursor(verb, tuple(given), word)
    if word.startswith("-") and not _NUMBER.match(word):
        name, assigned, value = word.partition("=")
        if assigned and name in options:
            found = _of_action(options[name], cursor._replace(word=value))
            return [f"{name}={each}" for each in found]
        return [name for name in options if name not in before]
    if pending is not None:
        return _of_action(pending, cursor)

    positionals = [action for action in parser._actions if not action.option_strings]
    at = len(given)
    if positionals and at >= len(positionals) and positionals[-1].nargs in ("+", "*", "..."):
        at = len(positionals) - 1
    return _of_action(positionals[at], cursor) if at < len(positionals) else ()


def _of_action(action: argparse.Action, cursor: Cursor) -> Iterable[str]:
    if action.choices is not None:
        return [str(choice) for choice in action.choices]
    name = completer_of(action)
    return _completer(name)(cursor) if name else ()


def _completer(name: str) -> Completer:
    completer: Completer = getattr(completers, name)
    return completer


# --- quoting


def _at_home(text: str) -> str:
    return os.path.expanduser(text) if text.startswith("~/") else text


if __name__ == "__main__":
    sys.exit(main())
