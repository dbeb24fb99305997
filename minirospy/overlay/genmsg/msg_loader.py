"""genmsg.msg_loader, provided by minirospy."""

from genmsg.base import COMMENTCHAR, CONSTCHAR, EXT_MSG, EXT_SRV, IODELIM, SEP
from genmsg.msgs import (
    DURATION,
    DURATION_MSG,
    HEADER,
    HEADER_FULL_NAME,
    TIME,
    TIME_MSG,
    is_valid_msg_field_name,
)
from minirospy.ros.genmsg.genmsg.msg_loader import (
    MsgContext,
    MsgNotFound,
    get_msg_file,
    get_srv_file,
    load_depends,
    load_msg_by_type,
    load_msg_from_file,
    load_msg_from_string,
    load_srv_by_type,
    load_srv_from_file,
    load_srv_from_string,
)

__all__ = [
    "COMMENTCHAR", "CONSTCHAR", "DURATION", "DURATION_MSG", "EXT_MSG", "EXT_SRV", "HEADER", "HEADER_FULL_NAME", "IODELIM",
    "SEP", "TIME", "TIME_MSG", "MsgContext", "MsgNotFound", "get_msg_file", "get_srv_file", "is_valid_msg_field_name",
    "load_depends", "load_msg_by_type", "load_msg_from_file", "load_msg_from_string", "load_srv_by_type",
    "load_srv_from_file", "load_srv_from_string",
]  # fmt: skip
