"""roslib.msgs: queries about types, with genmsg's functions under their former names."""

from minirospy.core.idl.load import Catalogue
from minirospy.workspace.packages import Packages

__all__ = ["EXT", "SEP", "MsgSpecException", "list_msg_types"]

EXT = ".msg"
SEP = "/"


class MsgSpecException(Exception):
    """A definition cannot be read."""


def list_msg_types(package: str, include_depends: bool) -> list[str]:
    """Return the names of a package's message files, without the package; ``include_depends`` is for rosbuild."""
    return sorted(Catalogue({package: Packages().find(package)}).files(package, "msg"))
