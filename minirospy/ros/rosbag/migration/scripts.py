"""The programs in ROS's package rosbag that migrate messages, run as `rosrun rosbag fixbag.py ...`."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from minirospy.base.errors import DefinitionError, MinirospyError
from minirospy.command.parser import Parser
from minirospy.ros.rosbag.commands.rosbag_info import report
from minirospy.ros.rosbag.commands.rosbag_scripts import Script, copying, fix_each
from minirospy.ros.rosbag.migration import verbs
from minirospy.ros.rosbag.migration.bags import check_classes, fix_bag
from minirospy.ros.rosbag.migration.rules_files import MessageMigrator

if TYPE_CHECKING:
    from minirospy.core.bag.records import Connection

__all__ = ["SCRIPTS"]


def _with_definition_of_md5sum(connection: Connection) -> Connection:
    """Replace the connection's definition with the one that matches its md5sum, if a rule or package contains that one."""
    from minirospy.core.idl.load import get_message_class
    from minirospy.introspect.bags import class_of_connection

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
    status = fix_each(words, usage, "migrate", lambda path, temporary: _migrated(path, temporary, []))
    return status if words else 2


def _migrated(source: str, target: str, rule_files: Sequence[str]) -> bool:
    return not fix_bag(MessageMigrator(rule_files), source, target, report)


def _makerule(words: list[str]) -> int:
    from minirospy.core.idl.load import class_from_text

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
    migrator = verbs.make_migrator(rule_files, noplugins=bool(options["noplugins"]))
    migrations = check_classes(migrator, [old_class])
    if not migrations:
        print("Saved definition is up to date.")
        return 0
    print("The following migrations need to occur:")
    return verbs.write_rules(path, migrator, verbs.print_migrations(migrations))


SCRIPTS: dict[str, Script] = {
    "fix_msg_defs.py": copying(
        "usage: fix_msg_defs.py <inbag> <outbag>", 2, lambda words: _with_definition_of_md5sum
    ),
    "fixbag.py": _fixbag,
    "fixbag_batch.py": _fixbag_batch,
    "makerule.py": _makerule,
}
"""The migration programs, keyed by name."""
