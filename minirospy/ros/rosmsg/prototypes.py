"""Formats messages as YAML, like `rosmsg-proto`: styles, filters, and one element in each array.

Source: the output of ROS's `rosmsg.get_yaml_for_msg`. By default, flat values are in braces only after the first dictionary
or list with more than four entries.
"""

from __future__ import annotations

import contextlib
import inspect
import os
import sys
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, ClassVar

import yaml

from minirospy.base.times import TVal

__all__ = [
    "MAX_DEFAULT_NON_FLOW_ITEMS",
    "RosMsgProtoArgsException",
    "RosMsgProtoException",
    "construct_ordered_mapping",
    "construct_yaml_map_with_ordered_dict",
    "create_names_filter",
    "dump",
    "get_array_type_instance",
    "init_rosmsg_proto",
    "prototype",
    "represent_ordered_mapping",
]

# If a message has more fields, or a list more elements, use the flow style that the caller chose.
MAX_DEFAULT_NON_FLOW_ITEMS = 4
_USAGE_ERROR = getattr(os, "EX_USAGE", 1)
_NUMBERS = {f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)} | {"byte", "char"}
_DEFAULTS: dict[str, object] = {
    **dict.fromkeys([*_NUMBERS, "float32", "float64"], 0),
    "string": "",
    "bool": False,
}
_CLASSES = {"time": "std_msgs/Time", "duration": "std_msgs/Duration", "Header": "std_msgs/Header"}


class RosMsgProtoException(Exception):
    """Raised if the prototype's type or mode does not exist."""


class RosMsgProtoArgsException(Exception):
    """Raised if arguments are missing on the command line."""


class _Dumper(yaml.SafeDumper):
    """Dumps objects with `__slots__`, such as messages, as dictionaries."""

    keeps_order: ClassVar[bool] = False  # if False, fields are sorted by name

    def represent_mapping(self, tag: str, mapping: Any, flow_style: bool | None = None) -> yaml.MappingNode:
        if self.keeps_order:
            return represent_ordered_mapping(self, tag, mapping, flow_style)
        return super().represent_mapping(tag, mapping, flow_style)


def dump(
    message: object,
    prefix: str | None,
    time_offset: TVal | None,
    field_filter: Callable[[Any], Iterable[str]] | None,
    flow_style: bool | None,
    fill_arrays: bool,
) -> str:
    """Format a message, dictionary or list as YAML. `rosmsg.get_yaml_for_msg` documents the arguments."""

    def represent(dumper: Any, value: Any) -> yaml.Node:
        entries: OrderedDict[str, object] = OrderedDict()
        for name in value.__slots__ if field_filter is None else list(field_filter(value)):
            if name.startswith("_"):
                continue
            field = getattr(value, name)
            if type(field) is list and len(field) > MAX_DEFAULT_NON_FLOW_ITEMS:
                dumper.default_flow_style = flow_style
            if time_offset is not None and isinstance(field, TVal):
                field = field - time_offset  # type: ignore[operator]
            elif fill_arrays and field == []:
                field = _filled(value, name)
            if not inspect.ismethod(field) and not inspect.isfunction(field):
                entries[name] = field
        # PyYAML applies this setting to all nodes from here on.
        if len(entries) > MAX_DEFAULT_NON_FLOW_ITEMS:
            dumper.default_flow_style = flow_style
        node: yaml.Node = dumper.represent_dict(entries)
        return node

    class Dumper(_Dumper):
        """A separate class for each call, because PyYAML stores the representers in the class."""

    Dumper.add_representer(OrderedDict, yaml.SafeDumper.represent_dict)
    Dumper.add_representer(None, represent)  # type: ignore[arg-type]
    text = str(yaml.dump(message, Dumper=Dumper, default_flow_style=flow_style == 1, default_style=""))
    if not prefix:
        return text.rstrip("\n")
    return prefix + f"\n{prefix}".join(text.splitlines())


def _filled(message: Any, name: str) -> list[object]:
    """Return a list with one default element for an empty array, or [] if the element's class is unknown."""
    type_ = message._slot_types[message.__slots__.index(name)]
    element = get_array_type_instance(type_, default_package=message._type.partition("/")[0])
    return [] if element is None else [element]


def get_array_type_instance(field_type: str, default_package: str | None = None) -> object:
    """Return the default value of a type (of an array type: of one element), or None if its class does not exist."""
    from minirospy.ros.roslib.roslib.message import get_message_class

    base = field_type.strip().rstrip("[]")
    if base in _DEFAULTS:
        return _DEFAULTS[base]
    name = _CLASSES.get(base, base)
    if "/" not in name:
        if base == "empty" or default_package is None:
            return None
        name = f"{default_package}/{name}"
    found = get_message_class(name)
    return found and found()


def create_names_filter(names: Sequence[str]) -> Callable[[Any], list[str]]:
    """Return a function that returns a message's field names except ``names``."""
    return lambda message: [each for each in message.__slots__ if each not in names]


def init_rosmsg_proto() -> None:
    """Make `get_yaml_for_msg` preserve the field order, like `rosmsg-proto`.

    ROS's function also changes PyYAML for the whole process; with Python 3.10 or later, loading YAML then fails.
    """
    _Dumper.keeps_order = True


def construct_ordered_mapping(self: Any, node: Any, deep: bool = False) -> OrderedDict[Any, Any]:
    """Convert a YAML node to an OrderedDict; use as a PyYAML loader's `construct_mapping`."""
    if not isinstance(node, yaml.MappingNode):
        error = f"expected a mapping node, but found {node.id}"
        raise yaml.constructor.ConstructorError(None, None, error, node.start_mark)
    found: OrderedDict[Any, Any] = OrderedDict()
    for key_node, value_node in node.value:
        key = self.construct_object(key_node, deep=deep)
        try:
            hash(key)
        except TypeError:
            raise yaml.constructor.ConstructorError(
                "while constructing a mapping", node.start_mark, "found unhashable key", key_node.start_mark
            ) from None
        found[key] = self.construct_object(value_node, deep=deep)
    return found


def construct_yaml_map_with_ordered_dict(self: Any, node: yaml.Node) -> Iterator[OrderedDict[Any, Any]]:
    """Yield an OrderedDict, then fill it; use as a PyYAML constructor."""
    data: OrderedDict[Any, Any] = OrderedDict()
    yield data
    data.update(self.construct_mapping(node))


def represent_ordered_mapping(
    self: Any, tag: str, mapping: Any, flow_style: bool | None = None
) -> yaml.MappingNode:
    """Return a YAML node that preserves the dictionary's order; use as a PyYAML dumper's `represent_mapping`."""
    pairs: list[tuple[yaml.Node, yaml.Node]] = []
    node = yaml.MappingNode(tag, pairs, flow_style=flow_style)
    if self.alias_key is not None:
        self.represented_objects[self.alias_key] = node
    for key, value in mapping.items() if hasattr(mapping, "items") else mapping:
        pairs.append((self.represent_data(key), self.represent_data(value)))
    if flow_style is None:
        is_flat = all(isinstance(each, yaml.ScalarNode) and not each.style for pair in pairs for each in pair)
        default = self.default_flow_style
        node.flow_style = is_flat if default is None else default
    return node


def prototype(args: list[str] | None) -> str | None:
    """Return the output of `rosmsg-proto` for these arguments (default: this process's).

    On an error, print it to stderr and exit; with ``-s``, return None.
    """
    init_rosmsg_proto()
    parser = _option_parser()
    options, words = parser.parse_args(args)
    try:
        if len(words) < 2:
            raise RosMsgProtoArgsException("Insufficient arguments")
        for mark, text in (
            ("::", "rosmsgproto does not understand C++-style namespaces (i.e. '::')."),
            (".", f"invalid message type '{words[1]}'."),
        ):
            if mark in words[1]:
                if not options.silent:
                    parser.error(f"{text}\nPlease refer to msg/srv types as 'package_name/Type'.")
                break
        excluded = options.exclude_slots
        text = dump(
            _instance(f".{words[0]}", words[1]),
            options.prefix,
            None,
            create_names_filter(excluded.split(",")) if excluded.strip() else None,
            options.flow_style,
            not options.empty_arrays,
        )
    except (RosMsgProtoException, RosMsgProtoArgsException, ValueError) as error:
        if options.silent:
            return None
        is_value = isinstance(error, ValueError)
        sys.stderr.write(f"Invalid type: '{error}'" if is_value else str(error))
        sys.exit(1 if isinstance(error, RosMsgProtoException) else _USAGE_ERROR)
    return text if options.no_hyphens else f'"{text}"'


def _instance(mode: str, name: str) -> object:
    """Return a message, or a service request, with default values."""
    from minirospy.ros.roslib.roslib.message import get_message_class, get_service_class

    if "/" not in name:
        name = _only_type(mode, name)
    if mode == ".srv":
        service = get_service_class(name)
        if service is None:
            raise RosMsgProtoException(f"Unknown service class: {name}")
        return service._request_class()
    if mode != ".msg":
        raise RosMsgProtoException(f"Invalid mode: {mode}")
    message = get_message_class(name)
    if message is None:
        raise RosMsgProtoException(f"Unknown message class: {name}")
    return message()


def _only_type(mode: str, name: str) -> str:
    """Return the full name of the only type named ``name``."""
    from minirospy.base.errors import NotFoundError
    from minirospy.introspect.interfaces import Interfaces, Kind
    from minirospy.workspace.packages import Packages

    if mode not in (".msg", ".srv"):
        raise ValueError(f"Unknown mode for iterate_packages: {mode}")
    found: list[str] = []
    with contextlib.suppress(NotFoundError):
        found = list(Interfaces(Packages(), Kind(mode[1:])).find(name))
    if len(found) != 1:
        raise RosMsgProtoException(f"{'Ambiguous' if found else 'Unknown'} message name {name}")
    return found[0]


def _option_parser() -> Any:
    from optparse import OptionParser

    parser = OptionParser(
        usage="usage: rosmsgproto msg/srv [options]",
        description="Produces output or a msg or service request, intended for tab completion support.",
    )
    parser.add_option(
        "-f",
        "--flow_style",
        type="int",
        help="if 1 always use brackets, if 0 never use brackets. Default is a heuristic mix.",
    )
    parser.add_option(
        "-e",
        "--empty-arrays",
        default=False,
        action="store_true",
        help="if true flexible size arrays are not filled with default instance",
    )
    parser.add_option(
        "-s", "--silent", default=False, action="store_true", help="if true suppresses all error messages"
    )
    parser.add_option(
        "-p", "--prefix", default="", help="prefix to print before each line, can be used for indent"
    )
    parser.add_option(
        "-H", "--no-hyphens", default="", action="store_true", help="if true output has no outer hyphens"
    )
    parser.add_option(
        "-x", "--exclude-slots", default="", help="comma separated list of slot names not to print"
    )
    return parser
