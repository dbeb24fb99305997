"""genmsg.msgs, provided by minirospy: types, fields and constants of messages."""

from genmsg.base import EXT_MSG, MSG_DIR, SEP, InvalidMsgSpec
from minirospy.ros.genmsg.genmsg.msgs import (
    BUILTIN_TYPES,
    DURATION,
    DURATION_MSG,
    HEADER,
    HEADER_FULL_NAME,
    PRIMITIVE_TYPES,
    TIME,
    TIME_MSG,
    Constant,
    Field,
    MsgSpec,
    bare_msg_type,
    is_builtin,
    is_header_type,
    is_valid_constant_type,
    is_valid_msg_field_name,
    is_valid_msg_type,
    parse_type,
    resolve_type,
)

__all__ = [
    "BUILTIN_TYPES", "DURATION", "DURATION_MSG", "EXT_MSG", "HEADER", "HEADER_FULL_NAME", "MSG_DIR", "PRIMITIVE_TYPES",
    "SEP", "TIME", "TIME_MSG", "Constant", "Field", "InvalidMsgSpec", "MsgSpec", "bare_msg_type", "is_builtin",
    "is_header_type", "is_valid_constant_type", "is_valid_msg_field_name", "is_valid_msg_type", "parse_type", "resolve_type",
]  # fmt: skip
