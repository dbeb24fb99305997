"""rosbag: record, play, inspect, repair and rewrite bags.

Source: http://wiki.ros.org/rosbag/Commandline. Output and exit statuses are those of ROS, for example 0 for an unknown
verb. Each verb has its own module, and an entry in the table FAMILY.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from minirospy.base.errors import UsageError
from minirospy.base.suggestions import did_you_mean
from minirospy.command.command import INTERRUPTED, complain
from minirospy.command.verbs import Family, HelpStatus
from minirospy.ros.rosbag.commands import (
    rosbag_convert,
    rosbag_export,
    rosbag_info,
    rosbag_play,
    rosbag_record,
    rosbag_rewrite,
)
from minirospy.ros.rosbag.parts import migration_verbs

__all__ = ["FAMILY", "main"]

FAMILY = Family(
    "rosbag",
    "",
    (
        *rosbag_info.VERBS,
        *migration_verbs(),
        *rosbag_rewrite.VERBS,
        rosbag_convert.VERB,
        rosbag_export.VERB,
        rosbag_play.VERB,
        rosbag_record.VERB,
    ),
    interrupted=INTERRUPTED,
    summary="record, play and change bags",
    help_status=HelpStatus(0, 0, 0, 0),
    wording={},
)
"""The verbs. `rosbag -h` lists those that ROS also has, in alphabetical order."""

_ABOUT = """\
Usage: rosbag <subcommand> [options] [args]

A bag is a file format in ROS for storing ROS message data. The rosbag command can record, replay and manipulate bags.
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    words = list(sys.argv[1:] if argv is None else argv)
    if {"-h", "--help"} & set(words):
        words = ["help", *(word for word in words if word not in ("-h", "--help"))]
    if not words or words[0] == "help":
        words = [*words[1:2], "-h"] if words[1:] else []
    if words[:1] == ["record"]:
        words = list(rosbag_record.without_split_size(words))
    if words and FAMILY.find(words[0]):
        return FAMILY.main(words)
    if not words:
        print(_ABOUT)
        print(_verbs())
        print("For additional information, see http://wiki.ros.org/rosbag\n")
        return 0

    hint = did_you_mean(words[0], map(FAMILY.verb_name, FAMILY.verbs))
    error = UsageError(f"unknown command `rosbag {words[0]}`{hint} (`rosbag -h` shows what there is)")
    return complain("rosbag", error, 0, f"Unknown command: '{words[0]}'\n{_verbs()}")


def _verbs() -> str:
    lines = {FAMILY.verb_name(verb): f"\t{verb.summary}" for verb in FAMILY.verbs} | {"help": ""}
    return "\n".join(["Available subcommands:", *(f"   {name}  {lines[name]}" for name in sorted(lines)), ""])
