"""The programs of ROS's package rosbag other than record and play: `rosrun rosbag topic_renamer.py ...`.

Arguments, output and exit statuses are those of ROS; the connection of each publisher is preserved.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from minirospy.base.errors import BagError, DefinitionError, MinirospyError
from minirospy.command.command import run
from minirospy.command.parser import Parser
from minirospy.ros.rosbag.commands.rosbag_info import report

if TYPE_CHECKING:
    from minirospy.core.bag.records import Connection

__all__ = ["SCRIPTS", "main"]


def main(name: str, argv: Sequence[str] | None = None) -> int:
    """Run the program of this name; return its exit status."""
    words = list(sys.argv[1:] if argv is None else argv)
    return run(name, lambda: SCRIPTS[name](words))


def _copying(
    usage: str, count: int, change: Callable[[list[str]], Callable[[Connection], Connection]]
) -> _Script:
    """Return a program that copies a bag and changes its connections.

    Source and target are its second and fourth argument if it has four, else its first and second.
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


def _with_definition_of_md5sum(connection: Connection) -> Connection:
    """Return the connection with the definition that matches its md5sum, if a rule or an installed package has it."""
    from minirospy.core.idl.load import get_message_class
    from minirospy.introspect.bags import class_of_connection
    from minirospy.ros.rosbag.migration.rules_files import MessageMigrator

    if class_of_connection(connection, lambda line: None)._md5sum == connection.md5sum:
        return connection
    key = connection.type, connection.md5sum
    found, where = MessageMigrator().lookup_type(key), "defined in migration system"
    if found is None:
        found, where = get_message_class(connection.type), "defined on your package path"
    if found is None or found._md5sum != connection.md5sum:
        report(f"WARNING: Type [{key[0]}] with md5sum [{key[1]}] has an unknown definition.\n")
        return connection
    report(f"FOUND: {key[0]} [{key[1]}] was {where}\n")
    return connection._replace(header=connection.header | {"message_definition": found._full_text.encode()})


def _fix_each(words: list[str], usage: str, verb: str, fix: Callable[[str, str], bool]) -> int:
    """Rewrite each bag with ``fix(bag, temporary)``; the original is renamed to BAG.old."""
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

    return _fix_each(words, "usage: fix_md5sums.py bag1 [bag2 bag3 ...]", "migrating file", fix)


def _fixbag(words: list[str]) -> int:
    if len(words) < 2:
        print("usage: fixbag.py <inbag> <outbag> [rulefile1, rulefile2, ...]")
        return 2
    if words[1].rpartition(".")[2] == "bmr":
        report("Second argument should be a bag, not a rule file.")
        return 2
    if not _migrated(words[0], words[1], words[2:]):
        print("Bag could not be migrated.")
        return 1
    print("Bag migrated successfully.")
    return 0


def _fixbag_batch(words: list[str]) -> int:
    usage = "usage: fixbag_batch.py bag1 [bag2 bag3 ...]"
    status = _fix_each(words, usage, "migrate", lambda path, temporary: _migrated(path, temporary, []))
    return status if words else 2


def _migrated(source: str, target: str, rule_files: Sequence[str]) -> bool:
    from minirospy.ros.rosbag.migration.bags import fix_bag
    from minirospy.ros.rosbag.migration.rules_files import MessageMigrator

    return not fix_bag(MessageMigrator(rule_files), source, target, report)


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


def _makerule(words: list[str]) -> int:
    from minirospy.core.idl.load import class_from_text
    from minirospy.ros.rosbag.commands import rosbag_migrate
    from minirospy.ros.rosbag.migration.bags import check_classes

    usage = "makerule.py msg.saved [-a] output_rulefile [rulefile1, rulefile2, ...] [-n]"
    parser = Parser("makerule.py", "", usage, missing="Incorrect number of arguments")
    parser.add_argument("saved")
    parser.add_argument("rulefile")
    parser.add_argument("others", nargs="*")
    parser.add_argument("-a", "--append", action="store_true")
    parser.add_argument("-n", "--noplugins", action="store_true")
    options = parser.parse(words)
    path, others = str(options["rulefile"]), options["others"]
    if os.path.isfile(path) and not options["append"]:
        report(f"The file {path} already exists.  Include -a if you intend to append.")
        return 1
    if not os.path.isfile(path) and options["append"]:
        report(f"The file {path} does not exist, and so -a is invalid.")
        return 1

    with open(str(options["saved"]), encoding="utf-8") as file:
        head, text = file.readline(), file.read()
    match = re.match(r"\[(.*)]:", head)
    if match is None:
        report("Full definition file malformed.  First line should be: '[my_package/my_msg]:'")
        return 0
    try:
        old_class = class_from_text(match[1], text)
    except DefinitionError as error:
        raise MinirospyError(f"Could not generate class from full definition file: {error}") from error

    rule_files = [*(others if isinstance(others, list) else []), *([path] if options["append"] else [])]
    migrator = rosbag_migrate.make_migrator(rule_files, noplugins=bool(options["noplugins"]))
    migrations = check_classes(migrator, [old_class])
    if not migrations:
        print("Saved definition is up to date.")
        return 0
    print("The following migrations need to occur:")
    return rosbag_migrate.write_rules(path, migrator, rosbag_migrate.print_migrations(migrations))


_Script = Callable[[list[str]], int]

SCRIPTS: dict[str, _Script] = {
    "topic_renamer.py": _copying(
        "usage: topic_renamer.py <intopic> <inbag> <outtopic> <outbag>", 4, _renaming
    ),
    "bagsort.py": _copying("usage: bagsort.py <inbag> <outbag>", 2, lambda words: lambda each: each),
    "fastrebag.py": _copying("usage: fastrebag.py <inbag> <outbag>", 2, lambda words: lambda each: each),
    "fix_msg_defs.py": _copying(
        "usage: fix_msg_defs.py <inbag> <outbag>", 2, lambda words: _with_definition_of_md5sum
    ),
    "fix_md5sums.py": _fix_md5sums,
    "fixbag.py": _fixbag,
    "fixbag_batch.py": _fixbag_batch,
    "savemsg.py": _savemsg,
    "makerule.py": _makerule,
}
"""The programs, by name."""
