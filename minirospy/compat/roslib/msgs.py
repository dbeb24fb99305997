"""roslib.msgs, filled in by minirospy: of genmsg's names under those of old, what programs ask of types."""

from minirospy.idl.load import Catalogue
from minirospy.workspace.packages import Packages

__all__ = ["EXT", "SEP", "list_msg_types"]

EXT = ".msg"
SEP = "/"


def list_msg_types(package: str, include_depends: bool) -> list[str]:
    """The names of the message files of a package, without it; ``include_depends`` is of rosbuild."""
    return sorted(Catalogue({package: Packages().find(package)}).files(package, "msg"))
