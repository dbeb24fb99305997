"""rosbag.migration: migrate messages whose types have changed. Source: http://wiki.ros.org/rosbag/migration."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING

from minirospy.ros.rosbag.migration.bags import check_bag, check_classes, fix_bag
from minirospy.ros.rosbag.migration.rules import (
    BagMigrationException,
    MessageUpdateRule,
    clean_name,
    constants_from_def,
    get_message_key,
    get_path_key,
    migration_default_value,
    qualified_name,
)
from minirospy.ros.rosbag.migration.rules_files import MessageMigrator, Migration, RuleChain, ScaffoldNode
from minirospy.ros.rosbag.rosbag.exceptions import as_ros_errors

if TYPE_CHECKING:
    from minirospy.core.idl.protocols import Message

__all__ = [
    "BagMigrationException",
    "MessageMigrator",
    "MessageUpdateRule",
    "RuleChain",
    "ScaffoldNode",
    "checkbag",
    "checkmessages",
    "clean_name",
    "constants_from_def",
    "fixbag",
    "fixbag2",
    "get_message_key",
    "get_path_key",
    "migration_default_value",
    "qualified_name",
]


def checkbag(migrator: MessageMigrator, inbag: str) -> list[Migration]:
    """Return the migration path and missing rules for each type in a bag that needs migration.

    Raise ROSBagException if the bag cannot be read.
    """
    with as_ros_errors():
        return check_bag(migrator, inbag, _warn)


def checkmessages(migrator: MessageMigrator, messages: Iterable[type[Message]]) -> list[Migration]:
    """Return the migration path and missing rules for each message class that needs migration."""
    return check_classes(migrator, messages)


def fixbag(migrator: MessageMigrator, inbag: str, outbag: str) -> bool:
    """Migrate a bag's messages into a new bag; return whether all could be migrated.

    Raise ROSBagException if the bag cannot be read.
    """
    return not fixbag2(migrator, inbag, outbag)


def fixbag2(migrator: MessageMigrator, inbag: str, outbag: str, force: bool = False) -> list[Migration]:
    """Migrate a bag's messages into a new bag; return the migrations that lack a rule.

    Raise ROSBagException if the bag cannot be read.
    """
    with as_ros_errors():
        return fix_bag(migrator, inbag, outbag, _warn, force=force)


def _warn(line: str) -> None:
    print(line, file=sys.stderr)
