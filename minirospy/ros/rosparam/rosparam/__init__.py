"""rosparam: parameters in files and on the server. Source: http://wiki.ros.org/rosparam."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn
from xmlrpc.client import Binary

import yaml as yaml

from minirospy.base.errors import MasterUnreachableError, MinirospyError, NotFoundError, ValueTextError
from minirospy.client.params import as_xmlrpc_client, check_sendable
from minirospy.core.wire.xmlrpc_writer import is_numpy
from minirospy.introspect import parameters
from minirospy.introspect.graph import Graph
from minirospy.introspect.values import add_angles, parse_documents, parse_value
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
    "_rosparam_cmd_delete",
    "_rosparam_cmd_get_dump",
    "_rosparam_cmd_list",
    "_rosparam_cmd_set_load",
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
    "print_params",
    "script_resolve_name",
    "set_param",
    "set_param_raw",
    "upload_params",
    "yamlmain",
]

NAME = "rosparam"
NS = "_ns"

# Programs that import rosparam can read deg(90) and rad(pi/2) with PyYAML's own loaders, as in ROS.
for _loader in (yaml.SafeLoader, yaml.FullLoader, yaml.Loader):
    add_angles(_loader)


class RosParamException(Exception):
    """A request about a parameter or file failed."""


class RosParamIOException(RosParamException):
    """The master does not respond."""


class _YamlError(RosParamException, yaml.YAMLError):
    """Invalid YAML; programs catch either of the two base classes."""


def get_param(param: str) -> Any:
    """Return a parameter's value, with bytes and dates in xmlrpc.client's wrappers, as in ROS.

    Raise rosgraph.MasterError if the parameter is not set, or if the name is empty.
    """
    with _graph() as graph:
        name = _resolve(graph, param)
        try:
            return as_xmlrpc_client(parameters.get_parameter(graph, name))
        except NotFoundError as error:
            raise MasterError(f"Parameter [{name}] is not set") from error


def set_param(param: str, value: str, verbose: bool = False) -> None:
    """Set a parameter from a YAML string. Raise RosParamException if the string is not YAML or the parameter cannot be set."""
    try:
        parsed = parse_value(value)
    except ValueTextError as error:
        raise _YamlError(error) from error
    set_param_raw(param, parsed, verbose)


def set_param_raw(param: str, value: object, verbose: bool = False) -> None:
    """Set a parameter to a value; a dictionary does not delete the namespace's other parameters."""
    with _graph() as graph:
        target = graph.resolve(param) if isinstance(param, str) else _resolve(graph, param)
        for name, single in parameters.set_parameter(graph, target, _with_bytes(value)):
            if verbose:
                print(f"set parameter [{name}] to [{single}]")


def _with_bytes(value: object) -> object:
    """Return a value with each Binary replaced by bytes, and numpy's numbers and arrays by Python's."""
    if is_numpy(value):
        return _with_bytes(value.tolist())  # type: ignore[attr-defined]
    if isinstance(value, Binary):
        return value.data
    if isinstance(value, dict):
        return {name: _with_bytes(inner) for name, inner in value.items()}
    return [_with_bytes(inner) for inner in value] if isinstance(value, list) else value


def upload_params(ns: str, values: object, verbose: bool = False) -> None:
    """Set all values below a namespace. Raise RosParamException if the root is set to anything but a dictionary."""
    check_sendable(ns)
    if ns == GLOBALNS and not isinstance(values, dict):
        raise RosParamException("global / can only be set to a dictionary")
    if verbose:
        print_params(values, ns)
    set_param_raw(ns, values)


def delete_param(param: str, verbose: bool = False) -> None:
    """Delete a parameter. Raise rosgraph.MasterError if the parameter is not set, or if the name is empty."""
    with _graph() as graph:
        name = _resolve(graph, param)
        try:
            parameters.delete_parameter(graph, name)
        except NotFoundError as error:
            raise MasterError(f"parameter [{name}] is not set") from error
    if verbose:
        print(f"deleted parameter [{param}]")


def print_params(params: object, ns: str) -> None:
    """Print parameters, one ``name=value`` per line; print a single value alone."""
    if isinstance(params, dict):
        for name, value in parameters.flatten(ns, params):
            print(f"{name}={value}")
    else:
        print(params)


def get_param_server() -> Master:
    """Return the parameter server: the environment's master."""
    return Master("/" + NAME)


def list_params(ns: str) -> list[str]:
    """Return the names of the parameters below a namespace."""
    with _graph() as graph:
        check_sendable(ns)
        return parameters.list_parameters(graph, graph.resolve(ns))


def load_file(
    filename: str, default_namespace: str | None = None, verbose: bool = False
) -> list[tuple[object, str]]:
    """Return [(values, namespace)] for each document in a YAML file; values may have types that parameters do not support.

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
    """Return [(values, namespace)] for each document in a YAML string, which :func:`load_file` read from ``filename``."""
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
    """Write the parameters below a name to a file.

    Raise OSError if the file cannot be written, rosgraph.MasterError if there are no parameters.
    """
    values = get_param(param)
    if verbose:
        print_params(values, param)
    Path(filename).write_text(parameters.dump_parameters(_with_bytes(values)), encoding="utf-8")


def yamlmain(argv: Sequence[str] | None = None) -> None:
    """Run the command; ``argv`` starts with its name. Exit the program on failure, as in ROS."""
    from minirospy.ros.rosparam.commands.rosparam import main

    if status := main(list(sys.argv if argv is None else argv)[1:]):
        sys.exit(status)


# Private functions of ROS that programs call.

_rosparam_cmd_delete = _rosparam_cmd_list = yamlmain


def _rosparam_cmd_get_dump(cmd: str, argv: Sequence[str]) -> None:
    """Run ``rosparam get`` or ``dump``."""
    yamlmain(argv)


_rosparam_cmd_set_load = _rosparam_cmd_get_dump


def _fullusage() -> NoReturn:
    """Print the list of commands, and exit as `rosparam` without arguments does."""
    from minirospy.ros.rosparam.commands.rosparam import main

    sys.exit(main([]))


def _resolve(graph: Graph, param: str) -> str:
    """Return a parameter's global name. An empty name would mean the namespace, and therefore all parameters in it.

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
