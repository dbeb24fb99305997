"""roslib.msgs, provided by minirospy: queries about types, with genmsg's functions under their former names."""

from genmsg.msgs import (
    BUILTIN_TYPES,
    DURATION,
    HEADER,
    PRIMITIVE_TYPES,
    TIME,
    is_builtin,
    is_header_type,
    is_valid_constant_type,
    is_valid_msg_type,
    parse_type,
    resolve_type,
)
from genmsg.msgs import bare_msg_type as base_msg_type

from minirospy.ros.roslib.roslib.msgs import EXT, SEP, MsgSpecException, list_msg_types

__all__ = [
    "BUILTIN_TYPES",
    "DURATION",
    "EXT",
    "HEADER",
    "PRIMITIVE_TYPES",
    "SEP",
    "TIME",
    "MsgSpecException",
    "base_msg_type",
    "is_builtin",
    "is_header_type",
    "is_valid_constant_type",
    "is_valid_msg_type",
    "list_msg_types",
    "parse_type",
    "resolve_type",
]  # fmt: skip
