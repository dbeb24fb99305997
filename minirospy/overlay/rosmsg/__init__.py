"""rosmsg, filled in by minirospy: the types that are installed. Source: http://wiki.ros.org/rosmsg."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from minirospy.errors import DefinitionError, NotFoundError
from minirospy.introspect.interfaces import Interfaces, Kind
from minirospy.workspace.packages import Packages

__all__ = [
    "MODE_MSG", "MODE_SRV", "ROSMsgException", "get_msg_text", "get_srv_text", "iterate_packages", "list_msgs",
    "list_srvs", "list_types", "rosmsg_md5", "rosmsg_search", "rosmsgmain",
]  # fmt: skip

MODE_MSG = ".msg"
MODE_SRV = ".srv"


class ROSMsgException(Exception):
    """A type is not there, or its definition does not parse."""


def get_msg_text(type_: str, raw: bool = False, rospack: object = None) -> str:
    """The text of a message type, unfolded, or as it stands in its file. Raises ROSMsgException."""
    return _text(type_, raw, Kind.MESSAGE)


def get_srv_text(type_: str, raw: bool = False, rospack: object = None) -> str:
    """The text of a service type, unfolded, or as it stands in its file. Raises ROSMsgException."""
    return _text(type_, raw, Kind.SERVICE)


def list_msgs(package: str, rospack: object = None) -> list[str]:
    """The message types of a package. Raises ROSMsgException."""
    return list_types(package, MODE_MSG)


def list_srvs(package: str, rospack: object = None) -> list[str]:
    """The service types of a package. Raises ROSMsgException."""
    return list_types(package, MODE_SRV)


def list_types(package: str, mode: str = MODE_MSG, rospack: object = None) -> list[str]:
    """The types of a package. Raises ROSMsgException."""
    try:
        return _interfaces(_kind(mode)).in_package(package)
    except NotFoundError as error:
        raise ROSMsgException(str(error)) from error


def rosmsg_md5(mode: str, type_: str) -> str:
    """The md5sum of a type. Raises ROSMsgException."""
    try:
        return _interfaces(_kind(mode)).md5sum(type_)
    except (NotFoundError, DefinitionError) as error:
        raise ROSMsgException(str(error)) from error


def rosmsg_search(rospack: object, mode: str, base_type: str) -> Iterator[str]:
    """The types of a name without its package."""
    with contextlib.suppress(NotFoundError):
        yield from _interfaces(_kind(mode)).find(base_type)


def iterate_packages(rospack: object, mode: str) -> Iterator[tuple[str, str]]:
    """(name, folder of its definitions) of each package that has any."""
    packages = Packages()
    for name in Interfaces(packages, _kind(mode)).packages():
        yield name, str(packages.find(name) / mode.removeprefix("."))


def rosmsgmain(mode: str = MODE_MSG) -> int:
    """The command on this process's command line. Its exit status."""
    from minirospy.cli import rosmsg

    return rosmsg.main_srv() if mode == MODE_SRV else rosmsg.main()


def _text(type_: str, raw: bool, kind: Kind) -> str:
    interfaces = _interfaces(kind)
    try:
        return interfaces.text(type_) if raw else interfaces.description(type_)
    except (NotFoundError, DefinitionError) as error:
        raise ROSMsgException(str(error)) from error


def _kind(mode: str) -> Kind:
    return Kind.SERVICE if mode == MODE_SRV else Kind.MESSAGE


def _interfaces(kind: Kind) -> Interfaces:
    return Interfaces(Packages(), kind)
