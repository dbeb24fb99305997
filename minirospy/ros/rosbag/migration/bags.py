"""Migrates bags whose message types have changed: finds the required migrations, and writes a migrated bag."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from minirospy.core.bag.compression import NONE
from minirospy.introspect.bags import class_of_connection, naming_full_disk, new_bag, open_reader
from minirospy.ros.rosbag.migration.rules import MessageClass, get_message_key
from minirospy.ros.rosbag.migration.rules_files import MessageMigrator, Migration

__all__ = ["check_bag", "check_classes", "fix_bag"]


def check_classes(migrator: MessageMigrator, classes: Iterable[MessageClass]) -> list[Migration]:
    """Return the migrations that these message classes require, one per class."""
    found = []
    seen = set()
    for each in classes:
        if get_message_key(each) in seen:
            continue
        seen.add(get_message_key(each))
        path = migrator.find_path(each, migrator.find_target(each))
        if path:
            rules = migrator.expand_rules([node.rule for node in path])
            found.append(Migration(path, [rule for rule in rules if not rule.valid]))
    return found


def check_bag(migrator: MessageMigrator, path: str, warn: Callable[[str], object]) -> list[Migration]:
    """Return the migrations that a bag's messages require, in order of first use.

    Raise BagError if the bag is invalid, OSError if the file cannot be read.
    """
    with open_reader(path) as reader:
        connections = list(reader.connections.values())
        first: dict[int, MessageClass] = {}
        for _, _, found in reader.blocks([each.id for each in connections]):
            for rank in dict.fromkeys(each[1] for each in found):
                if rank not in first:
                    first[rank] = class_of_connection(connections[rank], warn)
            if len(first) == len(connections):
                break
    return check_classes(migrator, first.values())


def fix_bag(
    migrator: MessageMigrator, source: str, target: str, warn: Callable[[str], object], *, force: bool = False
) -> list[Migration]:
    """Migrate a bag's messages into a new bag; return the migrations that lack a rule.

    If any rule is missing, write nothing.

    ``force``: write the bag anyway, and copy messages that cannot be migrated. Raise BagError if the bag is invalid,
    OSError if a file cannot be read or written, BagMigrationException if a message cannot be migrated.
    """
    missing = [each for each in check_bag(migrator, source, warn) if each.missing]
    if missing and not force:
        return missing
    with open_reader(source) as reader, naming_full_disk(target), new_bag(target, NONE) as writer:
        connections = list(reader.connections.values())
        classes: dict[int, tuple[MessageClass, MessageClass]] = {}
        numbers: dict[int, int] = {}
        for _, data, found in reader.blocks([each.id for each in connections]):
            for time, rank, _, start, end in found:
                connection = connections[rank]
                if rank not in classes:
                    old = class_of_connection(connection, warn)
                    new = migrator.find_target(old)
                    if new is None or not all(node.rule.valid for node in migrator.find_path(old, new)):
                        warn(f"WARNING: messages of type [{connection.type}] are copied as they are")
                        new = old
                    classes[rank] = old, new
                    fields = {"type": new._type, "md5sum": new._md5sum, "message_definition": new._full_text}
                    header = connection.header | {name: text.encode() for name, text in fields.items()}
                    numbers[rank] = writer.add_connection(connection.topic, header)

                old, new = classes[rank]
                body = data[start:end]
                if old is not new:
                    raw = (connection.type, body, connection.md5sum, None, old)
                    body = migrator.migrate_raw(raw, (new._type, None, new._md5sum, None, new))[1]
                writer.write(numbers[rank], time, body)
    return []
