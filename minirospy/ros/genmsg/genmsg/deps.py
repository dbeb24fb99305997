"""genmsg.deps: finds a definition's dependencies, for build rules. Source: http://docs.ros.org/api/genmsg/html/."""

from __future__ import annotations

from pathlib import PurePath

from minirospy.ros.genmsg.genmsg.msg_loader import (
    MsgContext,
    SearchPath,
    load_depends,
    load_msg_from_file,
    load_srv_from_file,
)
from minirospy.ros.genmsg.genmsg.msgs import MsgSpec
from minirospy.ros.genmsg.genmsg.srvs import SrvSpec

__all__ = [
    "find_msg_dependencies",
    "find_msg_dependencies_with_type",
    "find_srv_dependencies",
    "find_srv_dependencies_with_type",
]


def find_msg_dependencies_with_type(
    pkg_name: str, msg_file: str, search_paths: SearchPath
) -> list[tuple[str, str | None]]:
    """Return (type, file) for each message that the message defined in ``msg_file`` uses.

    Raise InvalidMsgSpec if a definition is invalid, MsgNotFound if a definition is missing.
    """
    context = MsgContext.create_default()
    return _needed(context, load_msg_from_file(context, msg_file, _type(pkg_name, msg_file)), search_paths)


def find_msg_dependencies(pkg_name: str, msg_file: str, search_paths: SearchPath) -> list[str | None]:
    """Return the files that define the messages used by the message in ``msg_file``.

    Raise InvalidMsgSpec if a definition is invalid, MsgNotFound if a definition is missing.
    """
    return [file for _, file in find_msg_dependencies_with_type(pkg_name, msg_file, search_paths)]


def find_srv_dependencies_with_type(
    pkg_name: str, msg_file: str, search_paths: SearchPath
) -> list[tuple[str, str | None]]:
    """Return (type, file) for each message that a service uses.

    Raise InvalidMsgSpec if a definition is invalid, MsgNotFound if a definition is missing.
    """
    context = MsgContext.create_default()
    return _needed(context, load_srv_from_file(context, msg_file, _type(pkg_name, msg_file)), search_paths)


def find_srv_dependencies(pkg_name: str, msg_file: str, search_paths: SearchPath) -> list[str | None]:
    """Return the files that define the messages used by a service.

    Raise InvalidMsgSpec if a definition is invalid, MsgNotFound if a definition is missing.
    """
    return [file for _, file in find_srv_dependencies_with_type(pkg_name, msg_file, search_paths)]


def _type(package: str, file: str) -> str:
    return f"{package}/{PurePath(file).stem}"


def _needed(
    context: MsgContext, spec: MsgSpec | SrvSpec, search_paths: SearchPath
) -> list[tuple[str, str | None]]:
    load_depends(context, spec, search_paths)
    parts = (spec.request, spec.response) if isinstance(spec, SrvSpec) else (spec,)
    names = dict.fromkeys(name for part in parts for name in context.get_all_depends(part.full_name))
    return [(name, context.get_file(name)) for name in names]
