"""`minirospy VERB`: every command under one name; a verb's module is imported when it is typed."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence
from typing import NamedTuple

import minirospy
from minirospy.cli.command import run
from minirospy.errors import UsageError, did_you_mean

__all__ = ["main"]


class _Verb(NamedTuple):
    module: str
    function: str
    summary: str


_VERBS = {
    "demo": _Verb("demo", "main", "the workshop's button lights its LED, on the virtual board"),
    "master": _Verb("ros.master", "main", "start the master in the foreground (as roscore)"),
    "board": _Verb("board", "main", "see the virtual board, press its buttons"),
    "run": _Verb("ros.rosrun", "main", "run a package's program (as rosrun)"),
    "launch": _Verb("ros.roslaunch", "main", "run a launch file (as roslaunch)"),
    "topic": _Verb("ros.rostopic", "main", "list, echo, publish topics (as rostopic)"),
    "node": _Verb("ros.rosnode", "main", "list, ping, stop nodes (as rosnode)"),
    "service": _Verb("ros.rosservice", "main", "list, call services (as rosservice)"),
    "param": _Verb("ros.rosparam", "main", "get, set parameters (as rosparam)"),
    "msg": _Verb("ros.rosmsg", "main", "show message types (as rosmsg)"),
    "srv": _Verb("ros.rosmsg", "main_srv", "show service types (as rossrv)"),
    "console": _Verb("ros.rosconsole", "main", "levels of loggers, and what nodes log (as rosconsole)"),
    "graph": _Verb("ros.rosgraph", "main", "who sends to whom (as rosgraph)"),
    "clean": _Verb("ros.rosclean", "main", "how much log files take; remove them (as rosclean)"),
    "version": _Verb("ros.rosversion", "main", "the version of a package or of ROS (as rosversion)"),
    "pack": _Verb("ros.rospack", "main", "find packages and their dependencies (as rospack)"),
    "test": _Verb("ros.rostest", "rostest", "run the tests of nodes (as rostest)"),
    "make": _Verb("catkin.make", "catkin_make", "build a workspace (as catkin_make)"),
    "doctor": _Verb("doctor", "main", "what is wrong here, in the network, in the graph (as roswtf)"),
    "shell": _Verb("completion.shell", "main", 'roscd and completion: eval "$(minirospy shell)"'),
    # Without a summary, as shells call it and people do not.
    "complete": _Verb("completion.complete", "main", ""),
}


def main(argv: Sequence[str] | None = None) -> int:
    """The command; exit status as in minirospy.cli.command."""
    words = list(sys.argv[1:] if argv is None else argv)
    return run("minirospy", lambda: _dispatch(words))


def _dispatch(words: list[str]) -> int:
    if not words or words[0] in ("-h", "--help"):
        width = max(map(len, _VERBS))
        lines = [
            f"  minirospy {verb:{width}}  {entry.summary}" for verb, entry in _VERBS.items() if entry.summary
        ]
        print(
            "\n".join([f"minirospy {minirospy.__version__}: ROS 1 for any computer with Python", "", *lines])
        )
        print("\n`minirospy VERB -h` tells more of each.")
        return 0 if words else 2
    if words[0] in ("-V", "--version"):
        print(f"minirospy {minirospy.__version__}")
        return 0
    entry = _VERBS.get(words[0])
    if entry is None:
        hint = did_you_mean(words[0], _VERBS)
        raise UsageError(f"there is no `minirospy {words[0]}`{hint} (`minirospy -h` shows what there is)")
    function = getattr(importlib.import_module(f"minirospy.cli.{entry.module}"), entry.function)
    return int(function(words[1:]))
