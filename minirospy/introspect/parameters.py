"""Parameters on the parameter server: read, set and delete them, load them from YAML, and dump them as YAML.

Source: http://wiki.ros.org/rosparam, http://wiki.ros.org/ROS/Parameter%20Server%20API.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from minirospy.base.errors import NotFoundError, RpcRefused, ValueTextError
from minirospy.introspect.graph import Graph
from minirospy.introspect.values import check_parameter, format_value, parse_documents

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = [
    "ParameterFile",
    "RootValueError",
    "delete_parameter",
    "dump_parameters",
    "flatten",
    "get_parameter",
    "list_parameters",
    "parse_parameters",
    "set_parameter",
]

_NAMESPACE_KEY = "_ns"


class RootValueError(ValueTextError):
    """Raised on an attempt to set the root namespace to a value that is not a dictionary."""


class ParameterFile(NamedTuple):
    """A document in a parameter file: its values and their namespace.

    ``own_namespace``: the namespace was set by the key ``_ns`` in the document.
    """

    namespace: str
    values: object
    own_namespace: bool


def list_parameters(graph: Graph, namespace: str = "/") -> list[str]:
    """Return the sorted names of the parameters below ``namespace``."""
    prefix = namespace.rstrip("/") + "/"
    return sorted(name for name in graph.master.get_param_names() if name.startswith(prefix))


def get_parameter(graph: Graph, name: str) -> object:
    """Return a parameter's value, or a dictionary for a namespace. ``name`` is a global name.

    Raise NotFoundError if it is not set.
    """
    try:
        return graph.master.get_param(name)
    except RpcRefused:
        raise _not_set(graph, name) from None


def set_parameter(graph: Graph, name: str, value: object) -> list[tuple[str, object]]:
    """Set a parameter. As in rosparam, a dictionary sets each of its entries, and leaves other parameters unchanged.

    Return the individual parameters that were set. Raise ValueTextError if a value cannot be stored as a parameter.
    """
    if name == "/" and not isinstance(value, dict):
        raise ValueTextError(name, "the root holds parameters, it is not one: give a dictionary or a name")
    check_parameter(value, name)
    singles = list(flatten(name, value))
    for single, single_value in singles:
        graph.master.set_param(single, single_value)
    return singles


def delete_parameter(graph: Graph, name: str) -> None:
    """Delete a parameter or a namespace; for the root, delete all parameters. Raise NotFoundError if it is not set."""
    if name == "/":
        # The master's deleteParam rejects the root.
        graph.master.set_param(name, {})
        return
    try:
        graph.master.delete_param(name)
    except RpcRefused:
        raise _not_set(graph, name) from None


def parse_parameters(text: str, where: str, namespace: str) -> list[ParameterFile]:
    """Parse the text of the parameter file ``where``; return its documents, whose namespaces start with ``namespace`` (global).

    Raise ValueTextError if the file is not YAML, or has unnamed values at the root.
    """
    files = []
    for document in parse_documents(text, where):
        if document is None:
            continue
        target, own = namespace, False
        if isinstance(document, dict) and _NAMESPACE_KEY in document:
            own_namespace = str(document.pop(_NAMESPACE_KEY))
            target, own = _join(namespace, own_namespace), True
        if target == "/" and not isinstance(document, dict):
            raise RootValueError(where, "the values have no names: give a namespace to load them into")
        check_parameter(document, target)
        files.append(ParameterFile(target, document, own))
    return files


def dump_parameters(values: object) -> str:
    """Dump ``values`` as the YAML text of a parameter file."""
    text = format_value(values)
    return text if text.endswith("\n") else text + "\n"


def flatten(name: str, value: object) -> Iterator[tuple[str, object]]:
    """Yield (name, value) for each parameter at or below ``name``, in the order in which ``value`` contains them."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from flatten(_join(name, str(key)), inner)
    else:
        yield name, value


def _join(namespace: str, name: str) -> str:
    return name if name.startswith("/") else namespace.rstrip("/") + "/" + name


def _not_set(graph: Graph, name: str) -> NotFoundError:
    return NotFoundError("parameter", name, graph.master.get_param_names())
