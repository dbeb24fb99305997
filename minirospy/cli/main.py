"""`minirospy VERB`: every command under one name. A verb's module is imported when the verb is used."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import minirospy
from minirospy.base.errors import UsageError
from minirospy.base.suggestions import did_you_mean
from minirospy.cli.registry import COMMANDS, find_verb
from minirospy.command.command import run

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the given verb; return the exit status as minirospy.command.command defines it."""
    words = list(sys.argv[1:] if argv is None else argv)
    return run("minirospy", lambda: _dispatch(words))


def _dispatch(words: list[str]) -> int:
    if not words or words[0] in ("-h", "--help"):
        print(_help())
        return 0 if words else 2
    if words[0] in ("-V", "--version"):
        print(f"minirospy {minirospy.__version__}")
        return 0

    entry = find_verb(words[0])
    if entry is None:
        hint = did_you_mean(words[0], (each.verb for each in COMMANDS if each.verb))
        raise UsageError(f"unknown command `minirospy {words[0]}`{hint} (`minirospy -h` shows what there is)")
    return entry.load_main()(words[1:])


def _help() -> str:
    shown = [entry for entry in COMMANDS if entry.verb and entry.summary]
    width = max(len(entry.verb) for entry in COMMANDS)
    lines = [f"  minirospy {entry.verb:{width}}  {entry.summary}" for entry in shown]
    title = f"minirospy {minirospy.__version__}: ROS 1 for any computer with Python"
    return "\n".join([title, "", *lines, "", "`minirospy VERB -h` prints more about each."])
