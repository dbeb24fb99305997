"""`minirospy complete INDEX WORD...`: what can stand where the cursor is; one candidate a line. For TAB.

The words of a command line come in as the shell holds them (quotes included), INDEX is the place of the word under
the cursor; candidates go out as the shell is to insert them: quoted where they need it, with a vertical tab for
each line feed inside (`minirospy complete --one-line INDEX WORD...`: with none). One that ends in ``/`` or ``=``
goes on; after any other comes a space.

What an option or an argument is called in its command's parser says what it is completed with: there is no second
table of verbs and options. Nothing here ends in an error, and a master is waited for no longer than a person does.
Source: http://wiki.ros.org/rosbash#Tab_completion.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

from minirospy.cli.command import Parser
from minirospy.cli.sources import BY_HAND, PLAIN, SOURCES, Place, on_one_line
from minirospy.cli.verbs import Family
from minirospy.errors import MinirospyError

if TYPE_CHECKING:
    import argparse


__all__ = ["candidates", "main"]

_NUMBER = re.compile(r"-\d|-\.\d")
_LINE_FEED = "\v"
_ONE_LINE = "--one-line"
_OPTIONS = ["-h", "--help", "-V", "--version"]

_MODULES = {
    **{
        name: (name, "main")
        for name in (
            "roslaunch", "rostopic", "rosnode", "rosservice", "rosparam", "rosmsg", "rosconsole", "rosgraph", "rosclean",
            "rosversion",
        )
    },
    "roscore": ("master", "roscore"),
    "rosmaster": ("master", "rosmaster"),
    "rossrv": ("rosmsg", "main_srv"),
    "rosmsg-proto": ("rosmsg_proto", "main"),
    "roswtf": ("doctor", "roswtf"),
    "rostest": ("rostest", "rostest"),
    "rosunit": ("rostest", "rosunit"),
    "catkin_test_results": ("catkin_test_results", "main"),
    **{
        name: ("catkin", name)
        for name in ("catkin_make", "catkin", "catkin_create_pkg", "catkin_init_workspace")
    },
    **{
        name: ("catkin_tools", name)
        for name in ("catkin_find", "catkin_find_pkg", "catkin_topological_order")
    },
}  # fmt: skip
"""Command -> where its parser is made: a module of this folder, and its entrance."""


class _Asked(Exception):
    """Raised in place of running a command: its family of verbs, or its parser."""

    def __init__(self, answer: Any) -> None:
        super().__init__()
        self.answer = answer


def main(argv: Sequence[str] | None = None) -> int:
    """Print the candidates; the exit status is 0, whatever was typed."""
    words = list(sys.argv[1:] if argv is None else argv)
    # An edge: it runs in the middle of somebody's typing, where a fault's only decent form is silence.
    with contextlib.suppress(Exception):
        one_line = words[0] == _ONE_LINE
        index, *line = words[1:] if one_line else words
        found = candidates(int(index), line, one_line=one_line)
        sys.stdout.reconfigure(errors="surrogateescape")  # type: ignore[union-attr]
        print("".join(f"{text}\n" for text in found), end="", flush=True)
    return 0


def candidates(index: int, words: Sequence[str], *, one_line: bool = False) -> list[str]:
    """What can stand at ``words[index]``, as the shell is to insert it; if so asked, never more than one line."""
    if not 0 < index <= len(words):
        return []
    word, quote = _unquoted(words[index]) if index < len(words) else ("", "")
    before = [_unquoted(each)[0] for each in words[:index]]
    command = re.split(r"[/\\]", before[0])[-1].removesuffix(".exe")
    try:
        found = _of_command(command, before[1:], word)
        fitting = (on_one_line(text) if one_line else text for text in found)
        return [_quoted(text, quote) for text in dict.fromkeys(fitting) if text.startswith(word)]
    except MinirospyError:
        # An unknown package or type: the command itself will say so.
        return []


# --- which command, which of its words


def _of_command(command: str, before: list[str], word: str) -> Iterable[str]:
    if command == "minirospy":
        return _of_minirospy(before, word)
    if command in BY_HAND:
        return BY_HAND[command](Place("", tuple(before), word))
    if command not in _MODULES:
        return ()
    module, function = _MODULES[command]
    return _of_module(command, module, function, before, word)


def _of_minirospy(before: list[str], word: str) -> Iterable[str]:
    from minirospy.cli.family import _VERBS

    if not before:
        return _OPTIONS if word.startswith("-") else [name for name, verb in _VERBS.items() if verb.summary]
    entry = _VERBS.get(before[0])
    if entry is None:
        return ()
    if entry.module in BY_HAND:
        return _of_command(entry.module, before[1:], word)
    return _of_module(entry.module, entry.module, entry.function, before[1:], word)


def _of_module(command: str, module: str, function: str, before: list[str], word: str) -> Iterable[str]:
    """The candidates for a command whose parser, or verbs, its own module makes."""
    takes = _takes(getattr(importlib.import_module(f"minirospy.cli.{module}"), function))
    verb = ""
    if isinstance(takes, Family):
        if not before:
            return ["-h", "--help"] if word.startswith("-") else [each.name for each in takes.verbs]
        command, verb = takes.name, before[0]
        bodies = [each.body for each in takes.verbs if each.name == verb]
        takes, before = (_takes(bodies[0]) if bodies else None), before[1:]
    if isinstance(takes, Parser):
        return _of_parser(takes, command, verb, before, word)
    return ()


def _takes(entrance: Callable[[Sequence[str]], object]) -> Family | Parser | None:
    """What a command takes, from itself: it is stopped where it would read its words."""

    def stop(self: object, *_: object, **__: object) -> None:
        raise _Asked(self)

    doors: tuple[tuple[Any, str], ...] = ((Family, "main"), (Parser, "parse_known_args"))
    kept = [owner.__dict__.get(name) for owner, name in doors]
    silence = io.StringIO()
    try:
        for owner, name in doors:
            setattr(owner, name, stop)
        with contextlib.redirect_stdout(silence), contextlib.redirect_stderr(silence):
            # Of a command that reads its words another way, -h does no harm.
            entrance(["-h"])
    except _Asked as asked:
        answer: Family | Parser = asked.answer
        return answer
    except SystemExit:
        pass
    finally:
        for (owner, name), before in zip(doors, kept, strict=True):
            if before is None:
                delattr(owner, name)
            else:
                setattr(owner, name, before)
    return None


def _of_parser(parser: Parser, command: str, verb: str, before: list[str], word: str) -> Iterable[str]:
    """The candidates for the next word of a parser's command line."""
    options = {name: action for action in parser._actions for name in action.option_strings}
    given: list[str] = []
    pending: argparse.Action | None = None
    for each in before:
        if each in options:
            pending = options[each] if options[each].nargs != 0 else None
        elif pending is not None:
            pending = pending if pending.nargs in ("+", "*") else None
        elif (not each.startswith("-") or _NUMBER.match(each)) and ":=" not in each:
            given.append(each)
    place = Place(verb, tuple(given), word)
    if pending is not None and not word.startswith("-"):
        return _of_action(pending, command, place)
    if word.startswith("-") and not _NUMBER.match(word):
        return [name for name in options if name not in before]
    positionals = [action for action in parser._actions if not action.option_strings]
    at = len(given)
    if positionals and at >= len(positionals) and positionals[-1].nargs in ("+", "*"):
        at = len(positionals) - 1
    return _of_action(positionals[at], command, place) if at < len(positionals) else ()


def _of_action(action: argparse.Action, command: str, place: Place) -> Iterable[str]:
    if action.choices is not None:
        return [str(choice) for choice in action.choices]
    source = SOURCES.get(f"{command} {action.dest}") or SOURCES.get(action.dest)
    return source(place) if source else ()


# --- words as shells write them


def _unquoted(word: str) -> tuple[str, str]:
    """A word without its quotes, and the quote that is still open at its end."""
    text: list[str] = []
    quote = ""
    letters = iter(word)
    for letter in letters:
        if letter == "\\" and quote != "'":
            text.append(next(letters, ""))
        elif letter == quote:
            quote = ""
        elif letter in "'\"" and not quote:
            quote = letter
        else:
            text.append(letter)
    return "".join(text), quote


def _quoted(text: str, quote: str) -> str:
    """``text`` in the quotes that were opened, or in double ones where it needs any."""
    if PLAIN.match(text) and not quote:
        return text
    inner = text.replace("\n", _LINE_FEED)
    if quote != "'":
        inner = re.sub(r'(["$`\\])', r"\\\1", inner)
    quote = quote or '"'
    # A folder's quotes stay open: what lies in it comes next.
    return f"{quote}{inner}" if text.endswith("/") else f"{quote}{inner}{quote}"


if __name__ == "__main__":
    sys.exit(main())
