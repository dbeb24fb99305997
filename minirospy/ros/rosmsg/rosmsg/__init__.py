"""rosmsg: information about installed types. Source: http://wiki.ros.org/rosmsg."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, TextIO

from minirospy.base.errors import DefinitionError, NotFoundError
from minirospy.base.times import TVal
from minirospy.introspect.interfaces import Interfaces, Kind, describe
from minirospy.workspace.packages import Packages

if TYPE_CHECKING:
    from minirospy.core.idl.protocols import Message
    from minirospy.ros.genmsg.genmsg.msg_loader import MsgContext
    from minirospy.ros.genmsg.genmsg.msgs import MsgSpec
    from minirospy.ros.rospkg.rospkg.rospack import RosPack

__all__ = [
    "MODE_MSG",
    "MODE_SRV",
    "ROSMsgException",
    "_get_package_paths",
    "_list_resources",
    "_list_types",
    "_msg_filter",
    "get_msg_text",
    "get_srv_text",
    "get_yaml_for_msg",
    "iterate_packages",
    "list_msgs",
    "list_srvs",
    "list_types",
    "rosmsg_cmd_list",
    "rosmsg_cmd_md5",
    "rosmsg_cmd_package",
    "rosmsg_cmd_packages",
    "rosmsg_cmd_show",
    "rosmsg_md5",
    "rosmsg_search",
    "rosmsgmain",
    "spec_to_str",
]

MODE_MSG = ".msg"
MODE_SRV = ".srv"
_WIDE = 4
_KINDS = {MODE_MSG: Kind.MESSAGE, MODE_SRV: Kind.SERVICE}


class ROSMsgException(Exception):
    """A type does not exist, or its definition is invalid."""


def get_msg_text(type_: str, raw: bool = False, rospack: object = None) -> str:
    """Return a message type's definition, expanded or, if ``raw``, as in its file.

    Raise ROSMsgException if the type is unknown.
    """
    return _text(type_, raw, Kind.MESSAGE)


def get_srv_text(type_: str, raw: bool = False, rospack: object = None) -> str:
    """Return a service type's definition, expanded or, if ``raw``, as in its file.

    Raise ROSMsgException if the type is unknown.
    """
    return _text(type_, raw, Kind.SERVICE)


def list_msgs(package: str, rospack: object = None) -> list[str]:
    """Return a package's message types. Raise rospkg.ResourceNotFound if the package does not exist."""
    return list_types(package, MODE_MSG)


def list_srvs(package: str, rospack: object = None) -> list[str]:
    """Return a package's service types. Raise rospkg.ResourceNotFound if the package does not exist."""
    return list_types(package, MODE_SRV)


def list_types(package: str, mode: str = MODE_MSG, rospack: object = None) -> list[str]:
    """Return a package's types.

    Raise rospkg.ResourceNotFound if the package does not exist, ValueError if the mode is unknown.
    """
    from minirospy.ros.rospkg.rospkg.common import ResourceNotFound

    if not isinstance(package, str):
        raise ResourceNotFound(str(package))
    try:
        return _interfaces(_kind(mode)).in_package(package)
    except NotFoundError as error:
        raise ResourceNotFound(package) from error


def rosmsg_md5(mode: str, type_: str) -> str:
    """Return a type's md5sum. Raise ROSMsgException if the type is unknown."""
    try:
        return _interfaces(_kind(mode)).md5sum(type_)
    except (NotFoundError, DefinitionError) as error:
        raise ROSMsgException(str(error)) from error


def rosmsg_search(rospack: object, mode: str, base_type: str) -> Iterator[str]:
    """Yield the full name of each type whose name without the package is ``base_type``."""
    with contextlib.suppress(NotFoundError):
        yield from _interfaces(_kind(mode)).find(base_type)


def iterate_packages(rospack: object, mode: str) -> Iterator[tuple[str, str]]:
    """Yield (name, folder with its definitions) for each package that contains definitions."""
    packages = Packages()
    for name in Interfaces(packages, _kind(mode)).packages():
        yield name, str(packages.find(name) / mode.removeprefix("."))


def spec_to_str(msg_context: MsgContext, spec: MsgSpec, buff: TextIO | None = None, indent: str = "") -> str:
    """Return a genmsg spec as `rosmsg show` prints it, indented by ``indent``; also write it to the stream ``buff``.

    Raise KeyError if a message on which it depends is not in the context.
    """
    from minirospy.ros.genmsg.genmsg.msg_loader import lookup_in, parsed_message

    text = describe(parsed_message(spec), lookup_in(msg_context))
    text = "".join(indent + line for line in text.splitlines(keepends=True))
    if buff is not None:
        buff.write(text)
    return text


def get_yaml_for_msg(msg: Message, prefix: str = "", *, flow_style_: bool | None = None) -> str:
    """Return a message as YAML with sorted fields, and ``prefix`` before each line.

    With ``flow_style_``, put everything in braces. By default, flat values are in braces if a message or array has more
    than four entries, to save lines.
    """
    import yaml

    plain = _plain(msg)
    style = flow_style_ if flow_style_ is not None else None if _width(plain) > _WIDE else False
    text = yaml.safe_dump(plain, default_flow_style=style).rstrip("\n")
    return "\n".join(prefix + line for line in text.split("\n"))


def rosmsgmain(mode: str = MODE_MSG) -> int:
    """Run the command with this process's arguments. Return its exit status."""
    from minirospy.ros.rosmsg.commands import rosmsg

    return rosmsg.main_srv() if mode == MODE_SRV else rosmsg.main()


def rosmsg_cmd_list(mode: str, full: object, argv: Sequence[str] | None = None) -> int:
    """Run ``rosmsg list`` or ``rossrv list``."""
    return _run(mode, ["list", *(argv or sys.argv[1:])[1:]])


def rosmsg_cmd_packages(mode: str, full: object, argv: Sequence[str] | None = None) -> int:
    """Run ``rosmsg packages`` or ``rossrv packages``."""
    return _run(mode, ["packages", *(argv or sys.argv[1:])[1:]])


def rosmsg_cmd_md5(mode: str, full: object) -> int:
    """Run ``rosmsg md5`` or ``rossrv md5`` with this process's arguments."""
    return _run(mode, ["md5", *sys.argv[2:]])


def rosmsg_cmd_package(mode: str, full: object) -> int:
    """Run ``rosmsg package`` or ``rossrv package`` with this process's arguments."""
    return _run(mode, ["package", *sys.argv[2:]])


def rosmsg_cmd_show(mode: str, full: object, alias: str = "show") -> int:
    """Run ``rosmsg show`` or ``rossrv show`` with this process's arguments."""
    return _run(mode, ["show", *sys.argv[2:]])


def _run(mode: str, words: Sequence[str]) -> int:
    from minirospy.ros.rosmsg.commands import rosmsg

    return rosmsg.main_srv(words) if mode == MODE_SRV else rosmsg.main(words)


def _list_resources(path: str, rfilter: Callable[[str], bool] = os.path.isfile) -> list[str]:
    """Return the names in a folder whose path ``rfilter`` accepts; none if the folder does not exist."""
    if not os.path.isdir(path):
        return []
    return [name for name in os.listdir(path) if rfilter(os.path.join(path, name))]


def _msg_filter(ext: str) -> Callable[[str], bool]:
    """Return a predicate that tells whether a path is a file with this extension."""
    return lambda path: os.path.isfile(path) and path.endswith(ext)


def _list_types(path: str, subdir: str, ext: str) -> list[str]:
    """Return the sorted names of the types that a folder's files define; ``subdir`` has no effect, as in ROS."""
    return sorted(name[: -len(ext)] for name in _list_resources(path, _msg_filter(ext)))


def _plain(value: object) -> object:
    """Convert a value to YAML's dictionaries, lists and scalars."""
    if isinstance(value, TVal):
        return {"secs": value.secs, "nsecs": value.nsecs}
    if hasattr(value, "__slots__"):
        return {name: _plain(getattr(value, name)) for name in value.__slots__}
    return [_plain(each) for each in value] if isinstance(value, list | tuple) else value


def _width(plain: object) -> int:
    """Return the number of entries in the longest dictionary or list."""
    inner = list(plain.values()) if isinstance(plain, dict) else plain if isinstance(plain, list) else []
    return max(len(inner), *map(_width, inner), 0)


def _get_package_paths(pkgname: str, rospack: RosPack) -> list[str]:
    """Return the folders that contain a package's definitions, for programs that load them with genmsg."""
    return [rospack.get_path(pkgname)]


def _text(type_: str, raw: bool, kind: Kind) -> str:
    if not isinstance(type_, str):
        raise ROSMsgException(f"Invalid type [{type_}]: it is not text")
    interfaces = _interfaces(kind)
    try:
        return interfaces.text(type_) if raw else interfaces.description(type_)
    except (NotFoundError, DefinitionError) as error:
        raise ROSMsgException(str(error)) from error


def _kind(mode: str) -> Kind:
    try:
        return _KINDS[mode]
    except KeyError:
        raise ValueError(f"Unknown mode: {mode}") from None


def _interfaces(kind: Kind) -> Interfaces:
    return Interfaces(Packages(), kind)
