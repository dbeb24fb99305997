"""rosparam, filled in by minirospy: parameters in files and on the server. Source: http://wiki.ros.org/rosparam."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from minirospy.errors import MasterUnreachableError, MinirospyError
from minirospy.introspect import parameters
from minirospy.introspect.graph import Graph
from minirospy.introspect.values import parse_value

__all__ = [
    "RosParamException", "RosParamIOException", "delete_param", "dump_params", "get_param", "list_params", "load_file",
    "load_str", "set_param", "set_param_raw", "upload_params",
]  # fmt: skip


class RosParamException(Exception):
    """A parameter or file cannot be used as asked."""


class RosParamIOException(RosParamException):
    """The master does not answer."""


def get_param(param: str) -> Any:
    """A parameter's value. Raises RosParamException where it is not set."""
    with _graph() as graph:
        return parameters.get_parameter(graph, graph.resolve(param))


def set_param(param: str, value: str, verbose: bool = False) -> None:
    """Set a parameter from YAML text."""
    with _named():
        parsed = parse_value(value)
    set_param_raw(param, parsed, verbose)


def set_param_raw(param: str, value: Any, verbose: bool = False) -> None:
    """Set a parameter to a value; a dictionary leaves the parameters beside its own."""
    with _graph() as graph:
        for name, single in parameters.set_parameter(graph, graph.resolve(param), value):
            if verbose:
                print(f"set parameter [{name}] to [{single}]")


def upload_params(ns: str, values: Any, verbose: bool = False) -> None:
    """Set all values below a namespace."""
    set_param_raw(ns, values, verbose)


def delete_param(param: str, verbose: bool = False) -> None:
    """Delete a parameter. Raises RosParamException where it is not set."""
    with _graph() as graph:
        parameters.delete_parameter(graph, graph.resolve(param))
    if verbose:
        print(f"deleted parameter [{param}]")


def list_params(ns: str) -> list[str]:
    """The names of the parameters below a namespace."""
    with _graph() as graph:
        return parameters.list_parameters(graph, graph.resolve(ns))


def load_file(filename: str, default_namespace: str | None = None, verbose: bool = False) -> list[Any]:
    """[(values, namespace)] of each document of a parameter file. Raises RosParamException."""
    try:
        text = Path(filename).read_text(encoding="utf-8")
    except OSError as error:
        raise RosParamException(f"file [{filename}] cannot be read: {error.strerror}") from error
    return load_str(text, filename, default_namespace, verbose)


def load_str(
    str: str, filename: str, default_namespace: str | None = None, verbose: bool = False
) -> list[Any]:
    """[(values, namespace)] of each document of a YAML text. Raises RosParamException."""
    with _named():
        files = parameters.parse_parameters(str, filename, default_namespace or "/")
    return [(file.values, file.namespace) for file in files]


def dump_params(filename: str, param: str, verbose: bool = False) -> None:
    """Write the parameters below a name to a file. Raises RosParamException."""
    Path(filename).write_text(parameters.dump_parameters(get_param(param)), encoding="utf-8")


@contextmanager
def _graph() -> Iterator[Graph]:
    with _named(), Graph.open("rosparam") as graph:
        yield graph


@contextmanager
def _named() -> Iterator[None]:
    try:
        yield
    except MasterUnreachableError as error:
        raise RosParamIOException(str(error)) from error
    except MinirospyError as error:
        raise RosParamException(str(error)) from error
