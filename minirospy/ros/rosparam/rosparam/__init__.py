"""rosparam: reads and writes parameters in files and on the server. Source: http://wiki.ros.org/rosparam."""

from __future__ import annotations

import base64
import os
import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from optparse import OptionParser, Values
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn
from xmlrpc.client import Binary

import yaml as yaml

from minirospy.base.errors import MasterUnreachableError, MinirospyError, NotFoundError, ValueTextError
from minirospy.client.params import as_xmlrpc_client, check_sendable
from minirospy.core.wire.xmlrpc_writer import is_numpy
from minirospy.introspect import parameters
from minirospy.introspect.arithmetic import degrees, radians
from minirospy.introspect.graph import Graph
from minirospy.introspect.values import (
    add_angles,
    format_pretty,
    format_value,
    parse_documents,
    parse_value,
)
from minirospy.ros.ros_names import GLOBALNS, get_ros_namespace, ns_join
from minirospy.ros.rosgraph.rosgraph.masterapi import Master, MasterError

if TYPE_CHECKING:
    from minirospy.ros.rosgraph.rosgraph.names import make_caller_id, make_global_ns, script_resolve_name

__all__ = [
    "GLOBALNS",
    "NAME",
    "NS",
    "RosParamException",
    "RosParamIOException",
    "_fullusage",
    "_get_caller_id",
    "_pretty_print",
    "_rosparam_cmd_delete",
    "_rosparam_cmd_get_dump",
    "_rosparam_cmd_get_param",
    "_rosparam_cmd_list",
    "_rosparam_cmd_set_load",
    "_set_optparse_neg_args",
    "construct_angle_degrees",
    "construct_angle_radians",
    "construct_yaml_binary",
    "delete_param",
    "dump_params",
    "get_param",
    "get_param_server",
    "get_ros_namespace",
    "list_params",
    "load_file",
    "load_str",
    "make_caller_id",
    "make_global_ns",
    "ns_join",
    "pattern",
    "print_params",
    "represent_foo",
    "represent_xml_binary",
    "script_resolve_name",
    "set_param",
    "set_param_raw",
    "upload_params",
    "yamlmain",
]

NAME = "rosparam"
NS = "_ns"


class RosParamException(Exception):
    """Raised if a request about a parameter or file failed."""


class RosParamIOException(RosParamException):
    """Raised if the master does not respond."""


class _YamlError(RosParamException, yaml.YAMLError):
    """Raised if the YAML is invalid. Programs catch either of its base classes."""


def get_param(param: str) -> Any:
    """Return a parameter's value. As in ROS, bytes and dates are xmlrpc.client objects.

    Raise rosgraph.MasterError if the parameter is not set, or if the name is empty.
    """
    with _graph() as graph:
        name = _resolve(graph, param)
        try:
            return as_xmlrpc_client(parameters.get_parameter(graph, name))
        except NotFoundError as error:
            raise MasterError(f"Parameter [{name}] is not set") from error


def set_param(param: str, value: str, verbose: bool = False) -> None:
    """Set a parameter from a YAML string. Raise RosParamException if it is not YAML or the parameter cannot be set."""
    try:
        parsed = parse_value(value)
    except ValueTextError as error:
        raise _YamlError(error) from error
    set_param_raw(param, parsed, verbose)


def set_param_raw(param: str, value: object, verbose: bool = False) -> None:
    """Set a parameter to a value. A dictionary is merged, keeping the namespace's other parameters."""
    with _graph() as graph:
        target = graph.resolve(param) if isinstance(param, str) else _resolve(graph, param)
        for name, single in parameters.set_parameter(graph, target, _with_bytes(value)):
            if verbose:
                print(f"set parameter [{name}] to [{single}]")


def _with_bytes(value: object) -> object:
    """Replace Binary in a value with bytes, and numpy numbers and arrays with Python numbers and lists."""
    if is_numpy(value):
        return _with_bytes(value.tolist())  # type: ignore[attr-defined]
    if isinstance(value, Binary):
        return value.data
    if isinstance(value, dict):
        return {name: _with_bytes(inner) for name, inner in value.items()}
    return [_with_bytes(inner) for inner in value] if isinstance(value, list) else value


def upload_params(ns: str, values: object, verbose: bool = False) -> None:
    """Set all values in a namespace. Raise RosParamException if the root is set to a non-dictionary."""
    check_sendable(ns)
    if ns == GLOBALNS and not isinstance(values, dict):
        raise RosParamException("global / can only be set to a dictionary")
    if verbose:
        print_params(values, ns)
    set_param_raw(ns, values)


def delete_param(param: str, verbose: bool = False) -> None:
    """Delete a parameter. Raise rosgraph.MasterError if it is not set or its name is empty."""
    with _graph() as graph:
        name = _resolve(graph, param)
        try:
            parameters.delete_parameter(graph, name)
        except NotFoundError as error:
            raise MasterError(f"parameter [{name}] is not set") from error
    if verbose:
        print(f"deleted parameter [{param}]")


def print_params(params: object, ns: str) -> None:
    """Print parameters as ``name=value`` lines, or only the value if there is no name."""
    if isinstance(params, dict):
        for name, value in parameters.flatten(ns, params):
            print(f"{name}={value}")
    else:
        print(params)


def get_param_server() -> Master:
    """Return a proxy for the parameter server, the environment's master."""
    return Master("/" + NAME)


def list_params(ns: str) -> list[str]:
    """Return the names of the parameters in a namespace."""
    with _graph() as graph:
        check_sendable(ns)
        return parameters.list_parameters(graph, graph.resolve(ns))


def load_file(
    filename: str, default_namespace: str | None = None, verbose: bool = False
) -> list[tuple[object, str]]:
    """Return [(values, namespace)] for each document in a YAML file. Values may have types that parameters do not support.

    ``-`` or an empty name means stdin. Raise RosParamException if the file cannot be read; for invalid YAML, the exception
    is also a yaml.YAMLError.
    """
    if not filename or filename == "-":
        if verbose:
            print("reading parameters from stdin")
        return load_str(sys.stdin.read(), filename, default_namespace, verbose)
    path = Path(filename)
    if not path.exists():
        raise RosParamException(f"file [{filename}] does not exist")
    if verbose:
        print(f"reading parameters from [{filename}]")
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or "it is not UTF-8 text"
        raise RosParamException(f"file [{filename}] cannot be read: {why}") from error
    return load_str(text, filename, default_namespace, verbose)


def load_str(
    str: str | bytes, filename: str, default_namespace: str | None = None, verbose: bool = False
) -> list[tuple[object, str]]:
    """Return [(values, namespace)] for each document in a YAML string that came from ``filename``."""
    text = str.decode() if isinstance(str, bytes) else str
    try:
        documents = list(parse_documents(text, filename))
    except ValueTextError as error:
        raise _YamlError(error) from error
    loaded = []
    for document in documents:
        namespace = default_namespace or get_ros_namespace()
        if isinstance(document, dict) and NS in document:
            namespace = ns_join(namespace, document.pop(NS))
        if document is not None:
            loaded.append((document, namespace))
    return loaded


def dump_params(filename: str, param: str, verbose: bool = False) -> None:
    """Write a namespace's parameters to a file.

    Raise OSError if the file cannot be written, rosgraph.MasterError if there are no parameters.
    """
    values = get_param(param)
    if verbose:
        print_params(values, param)
    Path(filename).write_text(parameters.dump_parameters(_with_bytes(values)), encoding="utf-8")


def yamlmain(argv: Sequence[str] | None = None) -> None:
    """Run the command and, as in ROS, exit the program if it fails. ``argv`` starts with the command's name."""
    from minirospy.ros.rosparam.commands.rosparam import main

    if status := main(list(sys.argv if argv is None else argv)[1:]):
        sys.exit(status)


# Programs call the following private functions of ROS's rosparam.


def _run_verb(name: str, argv: Sequence[str]) -> None:
    from minirospy.command.called import Raised, call_verb
    from minirospy.ros.rosparam.commands.rosparam import FAMILY

    call_verb(FAMILY, [name, *argv[2:]], Raised(RosParamException, RosParamIOException))


def _rosparam_cmd_list(argv: Sequence[str]) -> None:
    """Run ``rosparam list``."""
    _run_verb("list", argv)


def _rosparam_cmd_delete(argv: Sequence[str]) -> None:
    """Run ``rosparam delete``. Raise RosParamException if the parameter is not set."""
    _run_verb("delete", argv)


def _rosparam_cmd_get_dump(cmd: str, argv: Sequence[str]) -> None:
    """Run ``rosparam get`` or ``dump``.

    If the parameter is not set, `get` raises RosParamException, and `dump` rosgraph.MasterError, as in ROS.
    """
    try:
        _run_verb(cmd, argv)
    except RosParamException as error:
        cause = error.__cause__
        if cmd == "dump" and NotFoundError in (type(cause), type(cause and cause.__cause__)):
            raise MasterError(str(error)) from error
        raise


def _rosparam_cmd_set_load(cmd: str, argv: Sequence[str]) -> None:
    """Run ``rosparam set`` or ``load``. Raise RosParamException if a file or value cannot be used."""
    _run_verb(cmd, argv)


def _rosparam_cmd_get_param(param: str, pretty: bool = False, verbose: bool = False) -> None:
    """Print a parameter, like `rosparam get`. Raise RosParamException if the parameter is not set."""
    if verbose:
        print(f"getting parameter [{param}]")
    try:
        value = get_param(param)
    except MasterError as error:
        raise RosParamException(str(error)) from error
    print((format_pretty if pretty else format_value)(_with_bytes(value)))


def _pretty_print(value: dict[str, object], indent: str = "") -> None:
    """Print a dictionary, like `rosparam get -p`. Print multi-line strings unchanged."""
    if value:
        print(format_pretty(_with_bytes(value), indent))


def _set_optparse_neg_args(parser: OptionParser, argv: Sequence[str]) -> tuple[Values, list[str]]:
    """Parse a `rosparam set` command line, whose values may be negative numbers; return the options and values."""
    values: list[str] = []
    options: list[str] = []
    takes_value = False
    for word in argv[2:]:
        if takes_value and word.startswith("-"):
            parser.error("-t and --textfile options require an argument")
        is_value = not word.startswith("-") or word[1:2].isdecimal()
        (values if is_value and not takes_value else options).append(word)
        takes_value = word in ("-t", "--textfile", "-b", "--binfile")
    return parser.parse_args(options)[0], values


def _get_caller_id() -> str:
    """Return this process's caller id for calls to the master."""
    from minirospy.ros.rosgraph.rosgraph.names import make_caller_id

    return make_caller_id(f"rosparam-{os.getpid()}")


pattern = re.compile(r"^rad\([^\)]*\)$")
"""The second of ROS's two patterns for angles. Programs use this name."""


def construct_angle_degrees(loader: Any, node: Any) -> float | str:
    """Convert a YAML node such as `deg(90)` or `90` to radians. Raise RosParamException if it is not a number."""
    value = loader.construct_scalar(node)
    try:
        return degrees(value)
    except (ValueError, SyntaxError, ArithmeticError):
        raise _YamlError(f"invalid degree value: {value}") from None


def construct_angle_radians(loader: Any, node: Any) -> float | str:
    """Evaluate a YAML node such as `rad(pi/2)`.

    Raise RosParamException if the expression is invalid. Only operators and functions of numbers are evaluated, whereas ROS
    runs the expression as Python code.
    """
    value = loader.construct_scalar(node).strip()
    try:
        return radians(value)
    except (ValueError, SyntaxError, ArithmeticError):
        raise _YamlError(f"invalid radian expression: {value}") from None


def construct_yaml_binary(loader: Any, node: Any) -> Binary:
    """Return a YAML node's bytes as an xmlrpc.client.Binary."""
    return Binary(loader.construct_yaml_binary(node))


def represent_xml_binary(loader: Any, data: Binary) -> Any:
    """Return the YAML node for an xmlrpc.client.Binary."""
    encoded = base64.b64encode(data.data).decode()
    return loader.represent_scalar("tag:yaml.org,2002:binary", encoded, style="|")


def represent_foo(loader: Any, data: str) -> Any:
    """Return a YAML node with the tag `#`."""
    return loader.represent_scalar("#", data)


# As in ROS, importing rosparam makes PyYAML's loaders read deg(90) and rad(pi/2), and return bytes as Binary.
for _loader in (yaml.SafeLoader, yaml.FullLoader, yaml.Loader):
    add_angles(_loader)
    _loader.add_constructor("!degrees", construct_angle_degrees)
    _loader.add_constructor("!radians", construct_angle_radians)
    _loader.add_constructor("tag:yaml.org,2002:binary", construct_yaml_binary)
yaml.add_representer(Binary, represent_xml_binary)


def _fullusage() -> NoReturn:
    """Print the list of commands and exit, like `rosparam` without arguments."""
    from minirospy.ros.rosparam.commands.rosparam import main

    sys.exit(main([]))


def _resolve(graph: Graph, param: str) -> str:
    """Return a parameter's global name. Raise MasterError if the name is empty, which would mean the whole namespace.

    A value that is not a string raises the same error as in ROS, which sends the value to the master: TypeError if XML-RPC
    does not support its type.
    """
    if not isinstance(param, str):
        check_sendable(param)
        raise MasterError(f"parameter [{param}] is not a string")
    if not param:
        raise MasterError("ERROR: parameter [key] must be specified and non-empty")
    return graph.resolve(param)


@contextmanager
def _graph() -> Iterator[Graph]:
    with _named(), Graph.open("rosparam") as graph:
        yield graph


@contextmanager
def _named() -> Iterator[None]:
    try:
        yield
    except MasterUnreachableError as error:
        raise RosParamIOException(error.ros_text) from error
    except MinirospyError as error:
        raise RosParamException(str(error)) from error
