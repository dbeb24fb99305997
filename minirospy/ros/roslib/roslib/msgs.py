"""roslib.msgs: queries about message types, and genmsg's functions under their former names."""

from minirospy.core.idl.load import Catalogue
from minirospy.ros.genmsg.genmsg.msgs import (
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
from minirospy.ros.genmsg.genmsg.msgs import bare_msg_type as base_msg_type
from minirospy.workspace.packages import Packages

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
]

EXT = ".msg"
SEP = "/"


class MsgSpecException(Exception):
    """A definition cannot be read."""


def list_msg_types(package: str, include_depends: bool) -> list[str]:
    """Return the names of a package's message files, without the package; ``include_depends`` applies only to rosbuild."""
    return sorted(Catalogue({package: Packages().find(package)}).files(package, "msg"))
