"""roslib.srvs: packages' service types, and their definitions."""

from __future__ import annotations

from pathlib import Path

from minirospy.ros.genmsg.genmsg.base import InvalidMsgSpec
from minirospy.ros.genmsg.genmsg.msg_loader import MsgContext, load_srv_from_string
from minirospy.ros.genmsg.genmsg.srvs import SrvSpec
from minirospy.ros.roslib.roslib import packages
from minirospy.ros.roslib.roslib.msgs import MsgSpecException

__all__ = [
    "COMMENTCHAR",
    "EXT",
    "IODELIM",
    "SEP",
    "VERBOSE",
    "SrvSpec",
    "SrvSpecException",
    "get_pkg_srv_specs",
    "is_verbose",
    "list_srv_types",
    "load_from_file",
    "load_from_string",
    "set_verbose",
    "srv_file",
]

COMMENTCHAR = "#"
EXT = ".srv"
IODELIM = "---"
SEP = "/"
VERBOSE = False


class SrvSpecException(MsgSpecException):
    """Raised if a definition cannot be read."""


class _Verbosity:
    is_on = False


def is_verbose() -> bool:
    """Return the value set with :func:`set_verbose`."""
    return _Verbosity.is_on


def set_verbose(v: bool) -> None:
    """Set the value that :func:`is_verbose` returns; it has no other effect."""
    _Verbosity.is_on = bool(v)


def list_srv_types(package: str, include_depends: bool) -> list[str]:
    """Return the names of a package's services, without the package; ``include_depends`` applies only to rosbuild."""
    folder = Path(packages.get_pkg_dir(package) or "", "srv")
    return sorted(path.stem for path in folder.glob(f"*{EXT}"))


def srv_file(package: str, type_: str) -> str:
    """Return the path of a service's definition file, which need not exist.

    Raise InvalidROSPkgException if the package does not exist.
    """
    return packages.resource_file(package, "srv", type_ + EXT)


def get_pkg_srv_specs(package: str) -> tuple[list[tuple[str, SrvSpec]], list[str]]:
    """Return (name, definition) for each of a package's services, and the names of the unreadable files."""
    found, failed = [], []
    for name in list_srv_types(package, False):
        try:
            found.append(load_from_file(srv_file(package, name), package))
        except (InvalidMsgSpec, OSError, UnicodeDecodeError):
            failed.append(f"{package}/{name}")
    return found, failed


def load_from_string(
    text: str, package_context: str = "", full_name: str = "", short_name: str = ""
) -> SrvSpec:
    """Parse a service definition. Raise genmsg.InvalidMsgSpec if it is invalid."""
    return load_srv_from_string(
        MsgContext.create_default(), text, full_name or f"{package_context}/{short_name}"
    )


def load_from_file(file_name: str, package_context: str = "") -> tuple[str, SrvSpec]:
    """Return a service's full name and spec from its definition file.

    Raise genmsg.InvalidMsgSpec if the definition is invalid, OSError if the file cannot be read.
    """
    short_name = Path(file_name).stem
    full_name = f"{package_context}/{short_name}" if package_context else short_name
    text = Path(file_name).read_text(encoding="utf-8")
    return full_name, load_from_string(text, package_context, full_name, short_name)
