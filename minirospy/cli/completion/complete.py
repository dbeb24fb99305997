"""`minirospy complete INDEX WORD...`: what can stand where the cursor is; a line feed between two. For TAB.

The words of a command line come in as the shell holds them (quotes included), INDEX is the place of the word under
the cursor; candidates go out as the shell is to insert them: quoted where they need it, with a vertical tab for
each line feed inside (`minirospy complete --one-line INDEX WORD...`: with none). One that ends in ``/`` or ``=``
goes on; after any other comes a space.

Verbs and options are asked of the command's own parser: there is no second list of them. What an argument, or an
option's value, is completed with, its name in that parser says: see :data:`COMPLETED_WITH`. Nothing here ends in an
error, and a master is waited for no longer than a person does. Source: http://wiki.ros.org/rosbash#Tab_completion.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from minirospy.cli.command import Parser
from minirospy.cli.completion import completers
from minirospy.cli.completion.completers import Place, Source, Text
from minirospy.cli.verbs import Family
from minirospy.errors import MinirospyError

if TYPE_CHECKING:
    import argparse


__all__ = ["BY_HAND", "COMPLETED_WITH", "ENTRANCES", "candidates", "main"]

ENTRANCES = {
    "roscore": "ros.master:roscore", "rosmaster": "ros.master:rosmaster", "roslaunch": "ros.roslaunch:main",
    "roslaunch-deps": "ros.roslaunch_deps:main", "roslaunch-logs": "ros.roslaunch_logs:main", "rosdep": "ros.rosdep:main",
    "rostopic": "ros.rostopic:main", "rosnode": "ros.rosnode:main", "rosservice": "ros.rosservice:main",
    "rosparam": "ros.rosparam:main", "rosmsg": "ros.rosmsg:main", "rossrv": "ros.rosmsg:main_srv",
    "rosmsg-proto": "ros.rosmsg_proto:main", "rosconsole": "ros.rosconsole:main", "rosgraph": "ros.rosgraph:main",
    "rosclean": "ros.rosclean:main", "rosversion": "ros.rosversion:main", "roswtf": "doctor:roswtf",
    "rostest": "ros.rostest:rostest", "rosunit": "ros.rostest:rosunit", "catkin": "catkin.make:catkin",
    "catkin_make": "catkin.make:catkin_make", "catkin_make_isolated": "catkin.make:catkin_make_isolated",
    "catkin_create_pkg": "catkin.make:catkin_create_pkg", "catkin_init_workspace": "catkin.make:catkin_init_workspace",
    "catkin_find": "catkin.find:catkin_find", "catkin_find_pkg": "catkin.find:catkin_find_pkg",
    "catkin_topological_order": "catkin.find:catkin_topological_order",
    "catkin_test_results": "catkin.test_results:main",
}  # fmt: skip
"""Command -> where its parser is made: ``module:function`` of this folder, as in pyproject.toml."""

BY_HAND: dict[str, Source] = {
    "roscd": completers.package_folders,
    "rospd": completers.package_folders,
    "rosls": completers.package_folders,
    "rosed": completers.package_file,
    "roscat": completers.package_file,
    "roscp": completers.package_file_and_target,
    "rosmv": completers.package_file_and_target,
    "rosrun": completers.rosrun_words,
    "rospack": completers.rospack_words,
    "rosstack": completers.rosstack_words,
}
"""Commands that read their words without a parser."""

COMPLETED_WITH: dict[Source, str] = {
    # of the graph, as it is now
    completers.topics: "topic topics rostopic.namespace",
    completers.topic_type: "rostopic.type",
    completers.message_text: "rostopic.args",
    completers.nodes: "node nodes rosnode.namespace",
    completers.machines: "machine",
    completers.services: "service rosservice.namespace",
    completers.request_text: "rosservice.args",
    completers.parameters: "parameter rosparam.namespace",
    completers.parameter_value: "rosparam.value",
    completers.loggers: "logger",
    # of the packages
    completers.message_types: "type",
    completers.service_types: "rosservice.type rossrv.type",
    completers.prototype_types: "rosmsg-proto.type",
    completers.package_names: "package packages pkg only_pkg_with_deps dependencies catkin_deps "
    "blacklist whitelist start_with",
    completers.package_path: "catkin_find.path",
    completers.build_targets: "targets",
    completers.launch_words: "roslaunch.what rostest.what",
    completers.launch_nodes: "roslaunch.args roslaunch.find_node",
    completers.launch_files: "others roslaunch-deps.files",
    # of this computer
    completers.files: "file files textfile binfile bag pid arguments",
    completers.folders: "build devel directory extend folder from_paths install_space pkgdir results_base_dir source "
    "test_results_dir workspace",
    # what there is to choose from
    completers.pins: "pin",
    completers.shells: "shell",
    completers.kinds: "mode",
    # numbers, names to be made up, expressions
    completers.nothing: "ahead allow author boost_comps catkin_make_args child cmake_args count dependency_types description "
    "exclude_slots filter j jobs keys left license load_average maintainer make_args mem_limit name numworkers os p "
    "parallel_packages pkg_version port prefix presses rate results_filename rosdistro run_id server_uri sigint_timeout "
    "sigterm_timeout size skip_keys sys_deps time_limit timeout width window",
}
"""Source -> what arguments and options are called (argparse's ``dest``) that it completes; ``command.name``: of that one."""

_SOURCES = {name: source for source, names in COMPLETED_WITH.items() for name in names.split()}

_NUMBER = re.compile(r"-\.?\d")
_VARIABLE = re.compile(r"\$(\w+)|\$\{(\w+)\}")
_LINE_FEED = "\v"
_ONE_LINE = "--one-line"
_OPTIONS = ["-h", "--help", "-V", "--version"]
_PLAIN = re.compile(r"[\w@%+=:,./~-]*\Z")
"""What no shell reads as more than a word."""


class _Word(NamedTuple):
    """A word without its quotes; the one that is still open at its end was opened at ``text[at:]``."""

    text: str
    quote: str
    at: int


class _Asked(Exception):
    """Raised in place of running a command: its family of verbs, or its parser."""

    def __init__(self, answer: Family | Parser) -> None:
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
        print("\n".join(found), end="", flush=True)
    return 0


def candidates(index: int, words: Sequence[str], *, one_line: bool = False) -> list[str]:
    """What can stand at ``words[index]``, as the shell is to insert it; if so asked, never more than one line."""
    if not 0 < index <= len(words):
        return []
    word = _unquoted(words[index] if index < len(words) else "")
    command, *before = (_at_home(_unquoted(each).text) for each in words[:index])
    command = re.split(r"[/\\]", command)[-1].removesuffix(".exe")
    try:
        found = _of_command(command, before, word.text)
        fitting = (completers.on_one_line(text) if one_line else text for text in found)
        return [_quoted(text, word) for text in dict.fromkeys(fitting) if text.startswith(word.text)]
    except MinirospyError:
        # An unknown package or type: the command itself will say so.
        return []


# --- which command, which of its words


def _of_command(command: str, before: list[str], word: str) -> Iterable[str]:
    if command == "minirospy":
        return _of_minirospy(before, word)
    if command in BY_HAND:
        return BY_HAND[command](Place("", tuple(before), word))
    if command not in ENTRANCES:
        return ()
    module, _, function = ENTRANCES[command].partition(":")
    return _of_module(command, module, function, before, word)


def _of_minirospy(before: list[str], word: str) -> Iterable[str]:
    from minirospy.cli.main import _VERBS

    if not before:
        return _OPTIONS if word.startswith("-") else [name for name, verb in _VERBS.items() if verb.summary]
    entry = _VERBS.get(before[0])
    if entry is None:
        return ()
    name = entry.module.rpartition(".")[2]
    if name in BY_HAND:
        return _of_command(name, before[1:], word)
    return _of_module(name, entry.module, entry.function, before[1:], word)


def _of_module(command: str, module: str, function: str, before: list[str], word: str) -> Iterable[str]:
    """The candidates for a command whose parser, or verbs, its own module makes."""
    takes = _takes(getattr(importlib.import_module(f"minirospy.cli.{module}"), function))
    verb = ""
    while isinstance(takes, Family):
        if not before:
            return _OPTIONS[:2] if word.startswith("-") else [each.name for each in takes.verbs]
        command, verb, *before = takes.name, *before
        bodies = [each.body for each in takes.verbs if each.name == verb]
        takes = _takes(bodies[0]) if bodies else None
    return _of_parser(takes, command, verb, before, word) if takes else ()


def _takes(entrance: Callable[[Sequence[str]], object]) -> Family | Parser | None:
    """What a command takes, from itself: it is stopped where it would read its words."""

    def stop(self: Any, *_: object, **__: object) -> None:
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
        return asked.answer
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
            # An option that may stand alone has a number: no candidate of what follows.
            pending = options[each] if options[each].nargs not in (0, "?") else None
        elif pending is not None:
            pending = pending if pending.nargs in ("+", "*") else None
        elif (not each.startswith("-") or _NUMBER.match(each)) and ":=" not in each:
            given.append(each)
    place = Place(verb, tuple(given), word)
    if word.startswith("-") and not _NUMBER.match(word):
        name, assigned, value = word.partition("=")
        if assigned and name in options:
            found = _of_action(options[name], command, place._replace(word=value))
            return [f"{name}={each}" for each in found]
        return [name for name in options if name not in before]
    if pending is not None:
        return _of_action(pending, command, place)
    positionals = [action for action in parser._actions if not action.option_strings]
    at = len(given)
    if positionals and at >= len(positionals) and positionals[-1].nargs in ("+", "*", "..."):
        at = len(positionals) - 1
    return _of_action(positionals[at], command, place) if at < len(positionals) else ()


def _of_action(action: argparse.Action, command: str, place: Place) -> Iterable[str]:
    if action.choices is not None:
        return [str(choice) for choice in action.choices]
    source = _SOURCES.get(f"{command}.{action.dest}") or _SOURCES.get(action.dest)
    return source(place) if source else ()


# --- words as shells write them


def _unquoted(word: str) -> _Word:
    """A word without its quotes; $NAME outside of single ones stands for its value."""
    text = ""
    quote = ""
    at = read = 0
    while read < len(word):
        letter = word[read]
        variable = _VARIABLE.match(word, read) if quote != "'" else None
        value = os.environ.get(variable[1] or variable[2]) if variable else None
        read += 1
        if letter == "\\" and quote != "'":
            text += word[read : read + 1]
            read += 1
        elif variable and value is not None:
            text += value
            read = variable.end()
        elif letter == quote:
            quote = ""
        elif letter in "'\"" and not quote:
            quote, at = letter, len(text)
        else:
            text += letter
    return _Word(text, quote, at)


def _at_home(text: str) -> str:
    return os.path.expanduser(text) if text.startswith("~/") else text


def _quoted(text: str, word: _Word) -> str:
    """``text`` as shells read it: in the quotes that were opened; else a :class:`Text` in double ones."""
    if word.quote:
        # A folder's quotes stay open: what lies in it comes next.
        end = "" if text.endswith("/") else word.quote
        return _escaped(text[: word.at]) + word.quote + _inside(text[word.at :], word.quote) + end
    if "\n" in text or (isinstance(text, Text) and not _PLAIN.match(text)):
        return f'"{_inside(text, chr(34))}"'
    return _escaped(text)


def _inside(text: str, quote: str) -> str:
    text = text.replace("\n", _LINE_FEED)
    if quote == "'":
        return text.replace("'", r"'\''")
    # A shell for people puts old commands in place of an exclamation mark, in double quotes too.
    return re.sub(r'(["$`\\])', r"\\\1", text).replace("!", "\"'!'\"")


def _escaped(text: str) -> str:
    return re.sub(r"([^\w@%+=:,./~-])", r"\\\1", text)


if __name__ == "__main__":
    sys.exit(main())
