"""dynparam: read and change the parameters of a node's dynamic_reconfigure server, from the terminal or a launch file.

Source: http://wiki.ros.org/dynamic_reconfigure#dynparam_command-line_tool. The output is identical to that of ROS.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from minirospy import client as rospy
from minirospy.base.errors import MinirospyError, UsageError
from minirospy.base.yaml_text import safe_load
from minirospy.command.command import NO_MASTER
from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Command
from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure import (
    DynamicReconfigureCallbackException,
    DynamicReconfigureParameterException,
    Values,
    find_reconfigure_services,
)

if TYPE_CHECKING:
    from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure.encoding import Config

__all__ = ["COMMANDS", "main"]

_USAGE = """dynparam is a command-line tool for getting, setting, and
deleting parameters of a dynamically configurable node.

Commands:
\tdynparam set                  configure node
\tdynparam set_from_parameters  copy configuration from parameter server
\tdynparam get                  get node configuration
\tdynparam load                 load configuration from file
\tdynparam dump                 dump configuration to file
\tdynparam list                 list configurable nodes

Type dynparam <command> -h for more detailed usage, e.g. 'dynparam get -h'
"""
_NO_NODE = "invalid arguments. Please specify a node name"
_NO_VALUES = (
    "invalid arguments. Please specify either a node name, parameter name and parameter value, "
    "or a node name and a YAML dictionary"
)
_SET_USAGE = """%prog set [options] node parameter value
   or: %prog set [options] node values

Examples:
  dynparam set wge100_camera camera_url foo
  dynparam set wge100_camera "{'camera_url':'foo', 'brightness':58}" """
_FROM_PARAMETERS_USAGE = """%prog set_from_parameters [options] node

Example command line:
  dynparam set_from_parameters wge100_camera _camera_url:=foo

Example launch file:
  <launch>
    <node name="$(anon adjust-wge100_camera)" pkg="dynamic_reconfigure" type="dynparam" args="set_from_parameters wge100_camera">
      <param name="camera_url" value="foo" />
      <param name="brightness" value="58" />
    </node>
  </launch>"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status. ``argv`` does not include the program's name."""
    words = rospy.myargv(["dynparam", *(sys.argv[1:] if argv is None else argv)])[1:]
    command = COMMANDS.get(words[0]) if words else None
    if command is None:
        print(_USAGE)
        return 1
    return command.main(words[1:])


def _parser(verb: str, usage: str = "", *more: str, missing: Mapping[str, str] | None = None) -> Parser:
    """Return the parser for ``dynparam VERB``, whose arguments are a node's name and the arguments named in ``more``."""
    parser = Parser(
        f"dynparam {verb}",
        ros_usage=(usage or f"%prog {verb} [options] node{''.join(f' {each}' for each in more)}").replace(
            "%prog", "dynparam"
        ),
        missing={"node": _NO_NODE, **(missing or {})},
        surplus="too many arguments",
    )
    parser.add_argument("node", help="the node, or the namespace of its server", completer="nodes")
    for name in more:
        parser.add_argument(name, completer="files")
    parser.add_argument("-t", "--timeout", type=float, default=None, help="timeout in secs")
    return parser


def _list_parser() -> Parser:
    return Parser("dynparam list", ros_usage="dynparam list", surplus="too many arguments")


def _list() -> None:
    _check_master()
    for name in find_reconfigure_services():
        print(name)


def _get(node: str, timeout: float | None) -> None:
    values = _values_of(node, timeout)
    if values is not None:
        print(values)


def _set_parser() -> Parser:
    parser = Parser(
        "dynparam set",
        ros_usage=_SET_USAGE.replace("%prog", "dynparam"),
        missing=_NO_VALUES,
        surplus="too many arguments",
    )
    parser.add_argument("node", help="the node, or the namespace of its server", completer="nodes")
    parser.add_argument(
        "name", help="the parameter, or several values as a YAML dictionary", completer="nothing"
    )
    parser.add_argument("value", nargs="?", help="the parameter's value", completer="nothing")
    parser.add_argument("-t", "--timeout", type=float, default=None, help="timeout in secs")
    return parser


def _set(node: str, name: str, value: str | None, timeout: float | None) -> None:
    values = {name: value} if value is not None else _dictionary(name)
    _connect()
    try:
        _change(node, values, timeout)
    except rospy.ROSException:
        print(f"couldn't set parameters at node {node}")


def _dictionary(text: str) -> Values:
    import yaml

    try:
        values = safe_load(text)
    except yaml.YAMLError as error:
        raise UsageError(f"the values are not YAML: {' '.join(str(error).split())}") from error
    if not isinstance(values, dict):
        raise Misuse(f"{text!r} is not a YAML dictionary, such as \"{{'brightness': 58}}\"", _NO_VALUES)
    return values


def _set_from_parameters(node: str, timeout: float | None) -> None:
    _connect()
    values = rospy.get_param("~", None)
    if not values:
        print("error updating parameters: no parameters found on parameter server", file=sys.stderr)
        return
    _change(node, values, timeout)


def _load(node: str, file: str, timeout: float | None) -> None:
    values: dict[str, object] = {}
    for document in _documents(file):
        if not isinstance(document, dict):
            raise MinirospyError(f"{file} holds {document!r}, which is not a dictionary of values")
        values.update(document)
    _connect()
    _change(node, values, timeout)


def _documents(file: str) -> list[object]:
    """Return the documents in a YAML file. Raise MinirospyError if the file is not valid YAML."""
    from minirospy.introspect.configurations import configuration_documents

    try:
        return configuration_documents(Path(file).read_text(encoding="utf-8"))
    except MinirospyError as error:
        raise MinirospyError(f"{file} is {error}") from error
    except UnicodeDecodeError as error:
        raise MinirospyError(f"{file} is not YAML: {' '.join(str(error).split())}") from error


def _dump(node: str, file: str, timeout: float | None) -> None:
    import yaml

    values = _values_of(node, timeout)
    if values is None:
        print(f"couldn't get parameters from node {node}")
        return
    Path(file).write_text(yaml.safe_dump(_plain(values)), encoding="utf-8")


def _plain(value: object) -> object:
    """Convert a configuration to plain dicts, which YAML dumps without tags."""
    return {key: _plain(each) for key, each in value.items()} if isinstance(value, dict) else value


def _connect() -> None:
    """Initialize a node. Raise MasterUnreachableError if there is no master; ROS would silently wait for one."""
    _check_master()
    rospy.init_node("dynparam", anonymous=True)


def _check_master() -> None:
    from minirospy.introspect.graph import Graph

    with Graph.open("dynparam") as graph:
        graph.state()


def _values_of(node: str, timeout: float | None) -> Config | None:
    from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure.client import Client

    _connect()
    return Client(node, timeout=timeout).get_configuration(timeout=timeout)


def _change(node: str, values: Values, timeout: float | None) -> None:
    """Change a node's values; print an error if a value is invalid.

    Raise ROSException if the node does not appear in time, MinirospyError if its server fails.
    """
    from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure.client import Client

    client = Client(node, timeout=timeout)
    try:
        client.update_configuration(values)
    except DynamicReconfigureParameterException as error:
        print(f"error updating parameters: {error}")
    except DynamicReconfigureCallbackException as error:
        raise MinirospyError(f"{node}: {error}: {error.__cause__}") from error


_WORDING = {"master": NO_MASTER}

COMMANDS = {
    "list": Command("dynparam list", _list_parser, _list, wording=_WORDING),
    "get": Command("dynparam get", lambda: _parser("get"), _get, wording=_WORDING),
    "set": Command("dynparam set", _set_parser, _set, wording=_WORDING),
    "set_from_parameters": Command(
        "dynparam set_from_parameters",
        lambda: _parser("set_from_parameters", _FROM_PARAMETERS_USAGE),
        _set_from_parameters,
        wording=_WORDING,
    ),
    "load": Command(
        "dynparam load",
        lambda: _parser(
            "load", "", "file", missing={"file": "invalid arguments. Please specify an input file"}
        ),
        _load,
        wording=_WORDING,
    ),
    "dump": Command(
        "dynparam dump",
        lambda: _parser(
            "dump", "", "file", missing={"file": "invalid arguments. Please specify an output file"}
        ),
        _dump,
        wording=_WORDING,
    ),
}
