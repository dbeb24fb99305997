"""rosmaster.validators, provided by minirospy: what calls require of their arguments."""

from minirospy.ros.rosmaster.rosmaster.validators import (
    ANYTYPE,
    ROSRPC,
    TYPE_SEPARATOR,
    ParameterInvalid,
    empty_or_valid_name,
    global_name,
    is_api,
    is_service,
    is_topic,
    non_empty,
    non_empty_str,
    not_none,
    valid_name,
    valid_name_validator_resolved,
    valid_name_validator_unresolved,
    valid_type_name,
)

__all__ = [
    "ANYTYPE",
    "ROSRPC",
    "TYPE_SEPARATOR",
    "ParameterInvalid",
    "empty_or_valid_name",
    "global_name",
    "is_api",
    "is_service",
    "is_topic",
    "non_empty",
    "non_empty_str",
    "not_none",
    "valid_name",
    "valid_name_validator_resolved",
    "valid_name_validator_unresolved",
    "valid_type_name",
]
