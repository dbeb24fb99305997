"""rosmsg: information about installed types. Source: http://wiki.ros.org/rosmsg."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from optparse import OptionParser, Values
from typing import TYPE_CHECKING, Any, TextIO

from minirospy.base.errors import DefinitionError, NotFoundError
from minirospy.base.times import TVal
from minirospy.introspect.interfaces import Interfaces, Kind, describe
from minirospy.ros.rosmsg.prototypes import (
    MAX_DEFAULT_NON_FLOW_ITEMS,
    RosMsgProtoArgsException,
    RosMsgProtoException,
    construct_ordered_mapping,
    construct_yaml_map_with_ordered_dict,
    create_names_filter,
    dump,
    get_array_type_instance,
    init_rosmsg_proto,
    represent_ordered_mapping,
)
from minirospy.ros.rosmsg.prototypes import prototype as rosmsg_cmd_prototype
from minirospy.workspace.packages import Packages

if TYPE_CHECKING:
    from minirospy.ros.genmsg.genmsg.msg_loader import MsgContext
    from minirospy.ros.genmsg.genmsg.msgs import MsgSpec
    from minirospy.ros.rospkg.rospkg.rospack import RosPack

__all__ = [
    "MAX_DEFAULT_NON_FLOW_ITEMS",
    "MODE_MSG",
    "MODE_SRV",
    "ROSMsgException",
    "RosMsgProtoArgsException",
    "RosMsgProtoException",
    "_get_package_paths",
    "_list_resources",
    "_list_types",
    "_msg_filter",
    "_stdin_arg",
    "construct_ordered_mapping",
    "construct_yaml_map_with_ordered_dict",
    "create_names_filter",
    "fullusage",
    "get_array_type_instance",
    "get_msg_text",
    "get_srv_text",
    "get_yaml_for_msg",
    "init_rosmsg_proto",
    "iterate_packages",
    "list_msgs",
    "list_srvs",
    "list_types",
    "represent_ordered_mapping",
    "rosmsg_cmd_list",
    "rosmsg_cmd_md5",
    "rosmsg_cmd_package",
    "rosmsg_cmd_packages",
    "rosmsg_cmd_prototype",
    "rosmsg_cmd_show",
    "rosmsg_debug",
    "rosmsg_md5",
    "rosmsg_search",
    "rosmsgmain",
    "spec_to_str",
]

MODE_MSG = ".msg"
MODE_SRV = ".srv"
_KINDS = {MODE_MSG: Kind.MESSAGE, MODE_SRV: Kind.SERVICE}


class ROSMsgException(Exception):
    """Raised if a type does not exist or its definition is invalid."""


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
    """Return a type's md5sum. Raise OSError if the type is unknown."""
    try:
        return _interfaces(Kind.MESSAGE if mode == MODE_MSG else Kind.SERVICE).md5sum(type_)
    except (NotFoundError, DefinitionError) as error:
        raise OSError(f"cannot load [{type_}]") from error


def rosmsg_debug(rospack: object, mode: str, type_: str, raw: bool = False) -> None:
    """Print a type's definition like `rosmsg show`. Raise ROSMsgException if the type or mode is unknown."""
    if mode not in _KINDS:
        raise ROSMsgException(f"Invalid mode for debug: {mode}")
    print(_text(type_, raw, _KINDS[mode]))


def rosmsg_search(rospack: object, mode: str, base_type: str) -> Iterator[str]:
    """Yield the full names of types named ``base_type`` in all packages."""
    with contextlib.suppress(NotFoundError):
        yield from _interfaces(_kind(mode)).find(base_type)


def iterate_packages(rospack: object, mode: str) -> Iterator[tuple[str, str]]:
    """Yield (name, definitions folder) for each package that contains definitions."""
    packages = Packages()
    for name in Interfaces(packages, _kind(mode, "iterate_packages")).packages():
        yield name, str(packages.find(name) / mode.removeprefix("."))


def spec_to_str(msg_context: MsgContext, spec: MsgSpec, buff: TextIO | None = None, indent: str = "") -> str:
    """Format a genmsg spec like `rosmsg show`, indented by ``indent``; also write it to the stream ``buff``.

    Raise KeyError if one of its dependencies is not in the context.
    """
    from minirospy.ros.genmsg.genmsg.msg_loader import lookup_in, parsed_message

    text = describe(parsed_message(spec), lookup_in(msg_context))
    text = "".join(indent + line for line in text.splitlines(keepends=True))
    if buff is not None:
        buff.write(text)
    return text


def get_yaml_for_msg(
    msg: object,
    prefix: str | None = "",
    time_offset: TVal | None = None,
    current_time: object = None,
    field_filter: Callable[[Any], Iterable[str]] | None = None,
    flow_style_: bool | None = None,
    fill_arrays_: bool = False,
) -> str:
    """Format a message as YAML with sorted fields and ``prefix`` at the start of each line.

    ``time_offset`` is subtracted from times. ``field_filter`` returns the names of a message's fields to print.
    ``flow_style_``: write everything in braces. By default, flat values are in braces after the first message or array
    with more than four entries, to save lines. ``fill_arrays_``: put one element into each empty array.
    """
    return dump(msg, prefix, time_offset, field_filter, flow_style_, fill_arrays_)


def rosmsgmain(mode: str = MODE_MSG) -> int:
    """Run the command with this process's arguments and return its exit status."""
    from minirospy.ros.rosmsg.commands import rosmsg

    return rosmsg.main_srv() if mode == MODE_SRV else rosmsg.main()


def fullusage(mode: str) -> str:
    """Return `rosmsg`'s or `rossrv`'s list of commands."""
    command = f"ros{mode[1:]}"
    word = "Message" if mode == MODE_MSG else "Service"
    verbs = (
        ("show", f"Show {word.lower()} description"),
        ("info", f"Alias for {command} show"),
        ("list", f"List all {word.lower()}s"),
        ("md5", f"Display {word.lower()} md5sum"),
        ("package", f"List {word.lower()}s in a package"),
        ("packages", f"List packages that contain {word.lower()}s"),
    )
    return "\n".join(
        (
            f"{command} is a command-line tool for displaying information about ROS {word} types.\n",
            "Commands:",
            *(f"\t{command} {verb}\t{text}" for verb, text in verbs),
            f"\nType {command} <command> -h for more detailed usage\n",
        )
    )


def rosmsg_cmd_list(mode: str, full: object, argv: Sequence[str] | None = None) -> None:
    """Run ``rosmsg list`` or ``rossrv list``. Raise ValueError if the mode is unknown."""
    _parse(OptionParser(f"usage: ros{mode[1:]} list"), argv)
    print("\n".join(_interfaces(_kind(mode, "iterate_packages")).all()))


def rosmsg_cmd_packages(mode: str, full: object, argv: Sequence[str] | None = None) -> None:
    """Run ``rosmsg packages`` or ``rossrv packages``. Raise ValueError if the mode is unknown."""
    parser = OptionParser(f"usage: ros{mode[1:]} packages")
    _add_single_line(parser, "packages")
    options, _ = _parse(parser, argv)
    found = _interfaces(_kind(mode, "iterate_packages")).packages()
    print((" " if options.single_line else "\n").join(found))


def rosmsg_cmd_md5(mode: str, full: object) -> None:
    """Run ``rosmsg md5`` or ``rossrv md5`` with this process's arguments."""
    _, name = _stdin_arg(OptionParser(f"usage: ros{mode[1:]} md5 <{full}>"), full)
    found = [name] if "/" in name else list(rosmsg_search(None, mode, name))
    for type_ in found:
        try:
            label = "" if "/" in name else f"[{type_}]: "
            print(label + rosmsg_md5(mode, type_))
        except OSError:
            print(f"Cannot locate [{type_}]", file=sys.stderr)
    if not found:
        print(f"No messages matching the name [{name}]", file=sys.stderr)


def rosmsg_cmd_package(mode: str, full: object) -> None:
    """Run ``rosmsg package`` or ``rossrv package`` with this process's arguments.

    Raise rospkg.ResourceNotFound if the package does not exist.
    """
    parser = OptionParser(f"usage: ros{mode[1:]} package <package>")
    _add_single_line(parser, "msgs")
    options, package = _stdin_arg(parser, full)
    print((" " if options.single_line else "\n").join(list_types(package, mode)))


def rosmsg_cmd_show(mode: str, full: object, alias: str = "show") -> int | None:
    """Run ``rosmsg show`` or ``rossrv show`` with this process's arguments. Return 1 if there is no such type.

    Raise ROSMsgException if a name with a package is unknown.
    """
    command = f"ros{mode[1:]}"
    parser = OptionParser(f"usage: {command} {alias} [options] <{full}>")
    parser.add_option(
        "-r", "--raw", default=False, action="store_true", help="show raw message text, including comments"
    )
    parser.add_option("-b", "--bag", help="show message from .bag file", metavar="BAGFILE")
    options, name = _stdin_arg(parser, full)
    name = name.removesuffix(mode)

    hint = "Please refer to msg/srv types as 'package_name/Type'."
    if "::" in name:
        parser.error(f"{command} does not understand C++-style namespaces (i.e. '::').\n{hint}")
    elif "." in name:
        parser.error(f"invalid message type '{name}'.\n{hint}")

    if options.bag:
        from minirospy.ros.rosbag.commands.read_from_bag import show_bag

        if not os.path.exists(options.bag):
            raise ROSMsgException(f"ERROR: bag file [{options.bag}] does not exist")
        with contextlib.suppress(NotFoundError):
            show_bag(options.bag, name, raw=options.raw)
        return None
    if "/" in name:
        rosmsg_debug(None, mode, name, options.raw)
        return None
    found = list(rosmsg_search(None, mode, name))
    for type_ in found:
        print(f"[{type_}]:")
        rosmsg_debug(None, mode, type_, options.raw)
    if not found:
        print(f"Could not find msg '{name}'", file=sys.stderr)
        return 1
    return None


def _add_single_line(parser: OptionParser, listed: str) -> None:
    parser.add_option(
        "-s",
        dest="single_line",
        default=False,
        action="store_true",
        help=f"list all {listed} on a single line",
    )


def _parse(parser: OptionParser, argv: Sequence[str] | None) -> tuple[Values, list[str]]:
    """Parse a command line that starts with the verb (default: this process's)."""
    return parser.parse_args(list(sys.argv[1:] if argv is None else argv)[1:])


def _stdin_arg(parser: OptionParser, full: object) -> tuple[Values, str]:
    """Return the options and the single name on this process's command line; without a name, read it from stdin."""
    options, words = parser.parse_args(sys.argv[2:])
    if len(words) > 1:
        parser.error(f"you may only specify one {full}")
    if words:
        return options, words[0]
    for line in sys.stdin:
        if line.strip():
            return options, line.strip()
    raise EOFError("no name on standard input")  # ROS would loop forever


def _list_resources(path: str, rfilter: Callable[[str], bool] = os.path.isfile) -> list[str]:
    """Return the names of a folder's entries whose paths ``rfilter`` accepts, or [] if the folder does not exist."""
    if not os.path.isdir(path):
        return []
    return [name for name in os.listdir(path) if rfilter(os.path.join(path, name))]


def _msg_filter(ext: str) -> Callable[[str], bool]:
    """Return a predicate that tells whether a path is a file with this extension."""
    return lambda path: os.path.isfile(path) and path.endswith(ext)


def _list_types(path: str, subdir: str, ext: str) -> list[str]:
    """Return the sorted names of the types defined in a folder. As in ROS, ``subdir`` has no effect."""
    return sorted(name[: -len(ext)] for name in _list_resources(path, _msg_filter(ext)))


def _get_package_paths(pkgname: str, rospack: RosPack) -> list[str]:
    """Return the folders with a package's definitions, for programs that load them with genmsg."""
    return [rospack.get_path(pkgname)]


def _text(type_: str, raw: bool, kind: Kind) -> str:
    if not isinstance(type_, str):
        raise ROSMsgException(f"Invalid type [{type_}]: it is not text")
    interfaces = _interfaces(kind)
    try:
        return interfaces.text(type_) if raw else interfaces.description(type_)
    except (NotFoundError, DefinitionError) as error:
        from minirospy.ros.rosmsg.commands.rosmsg import reason_not_shown

        raise ROSMsgException(reason_not_shown(kind, type_)) from error


def _kind(mode: str, function: str = "list_types") -> Kind:
    try:
        return _KINDS[mode]
    except KeyError:
        raise ValueError(f"Unknown mode for {function}: {mode}") from None


def _interfaces(kind: Kind) -> Interfaces:
    return Interfaces(Packages(), kind)
