"""rosbag.migration, provided by minirospy: messages of types that have changed."""

from minirospy.ros.rosbag.rosbag.migration import (
    BagMigrationException,
    MessageMigrator,
    MessageUpdateRule,
    RuleChain,
    ScaffoldNode,
    checkbag,
    checkmessages,
    clean_name,
    constants_from_def,
    fixbag,
    fixbag2,
    get_message_key,
    get_path_key,
    migration_default_value,
    qualified_name,
)

__all__ = [
    "BagMigrationException", "MessageMigrator", "MessageUpdateRule", "RuleChain", "ScaffoldNode", "checkbag",
    "checkmessages", "clean_name", "constants_from_def", "fixbag", "fixbag2", "get_message_key", "get_path_key",
    "migration_default_value", "qualified_name",
]  # fmt: skip
