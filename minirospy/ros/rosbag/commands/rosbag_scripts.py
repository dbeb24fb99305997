"""The programs of ROS's package rosbag other than record and play, run as `rosrun rosbag topic_renamer.py ...`.

Arguments, output and exit statuses are those of ROS; each publisher keeps its own connection in the bag.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from minirospy.base.errors import BagError, MinirospyError
from minirospy.command.command import run
from minirospy.command.parser import Parser
from minirospy.ros.rosbag.commands.rosbag_info import report
from minirospy.ros.rosbag.parts import migration_scripts

if TYPE_CHECKING:
    from minirospy.core.bag.records import Connection

__all__ = ["SCRIPTS", "Script", "copying", "fix_each", "main"]

Script = Callable[[list[str]], int]


def main(name: str, argv: Sequence[str] | None = None) -> int:
    """Run the program with this name; return its exit status."""
    words = list(sys.argv[1:] if argv is None else argv)
    return run(name, lambda: (SCRIPTS.get(name) or migration_scripts()[name])(words))


def copying(
    usage: str, count: int, change: Callable[[list[str]], Callable[[Connection], Connection]]
) -> Script:
    """Return a program that copies a bag with modifications.

    The bags are its first two arguments or, if there are four, the second and the last.
    """

    def script(words: list[str]) -> int:
        from minirospy.introspect.bags import copy_bag

        if len(words) != count:
            print(usage)
            return 0
        source, target = (words[1], words[3]) if count == 4 else (words[0], words[1])
        if os.path.exists(target) and os.path.samefile(source, target):
            raise MinirospyError(f"[{source}] would be overwritten while it is read: name another bag")
        copy_bag(source, target, change(words))
        return 0

    return script


def _renaming(words: list[str]) -> Callable[[Connection], Connection]:
    def rename(connection: Connection) -> Connection:
        if connection.topic != words[0]:
            return connection
        return connection._replace(topic=words[2], header=connection.header | {"topic": words[2].encode()})

    return rename


def _with_md5sum_of_definition(connection: Connection) -> Connection:
    from minirospy.introspect.bags import class_of_connection

    md5sum: str = class_of_connection(connection, lambda line: None)._md5sum
    return connection._replace(header=connection.header | {"md5sum": md5sum.encode()})


def fix_each(words: list[str], usage: str, verb: str, fix: Callable[[str, str], bool]) -> int:
    """Rewrite each bag with ``fix(bag, temporary)``; the original becomes BAG.old."""
    if not words:
        print(usage)
        return 0

    for path in words:
        print(f"Trying to {verb}: {path}")
        temporary = f"{path}.tmp"
        try:
            if not fix(path, temporary):
                raise MinirospyError("")
        except (BagError, OSError, MinirospyError) as error:
            print(f" Migration failed: {error}" if str(error) else " Migration failed.")
            if os.path.exists(temporary):
                os.remove(temporary)
            continue
        old, number = f"{path}.old", 1
        while os.path.isfile(old):
            number += 1
            old = f"{path}.old{number}"
        os.rename(path, old)
        os.rename(temporary, path)
        print(f" Migration successful.  Original stored as: {old}")
    return 0


def _fix_md5sums(words: list[str]) -> int:
    from minirospy.introspect.bags import copy_bag

    def fix(path: str, temporary: str) -> bool:
        copy_bag(path, temporary, _with_md5sum_of_definition)
        return True

    return fix_each(words, "usage: fix_md5sums.py bag1 [bag2 bag3 ...]", "migrating file", fix)


def _savemsg(words: list[str]) -> int:
    from minirospy.core.idl.load import get_message_class
    from minirospy.introspect.bags import open_reader

    parser = Parser("savemsg.py", "", "savemsg.py [-b <bagfile] type", missing="Message type not specified.")
    parser.add_argument("type")
    parser.add_argument(
        "-b",
        "--bagfiles",
        metavar="BAGFILE",
        help="Save message from a bagfile rather than system definition",
    )
    options = parser.parse(words)
    type_, path = str(options["type"]), options["bagfiles"]
    if path is None:
        found = get_message_class(type_)
        if found is None:
            report(f"Could not find message {type_}.")
        else:
            print(f"[{type_}]:\n{found._full_text}")
        return 0

    with open_reader(str(path)) as reader:
        text = next((each.definition for each in reader.connections.values() if each.type == type_), None)
    if text is None:
        report(f"Could not find message {type_} in bag {path}.")
    else:
        print(f"[{type_}]:\n{text}")
    return 0


SCRIPTS: dict[str, Script] = {
    "topic_renamer.py": copying(
        "usage: topic_renamer.py <intopic> <inbag> <outtopic> <outbag>", 4, _renaming
    ),
    "bagsort.py": copying("usage: bagsort.py <inbag> <outbag>", 2, lambda words: lambda each: each),
    "fastrebag.py": copying("usage: fastrebag.py <inbag> <outbag>", 2, lambda words: lambda each: each),
    "fix_md5sums.py": _fix_md5sums,
    "savemsg.py": _savemsg,
}
"""The programs, keyed by name. Those for migration are in `migration/scripts.py`."""
