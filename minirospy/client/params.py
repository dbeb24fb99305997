"""The parameter server as rospy has it. Source: http://wiki.ros.org/rospy/Overview/Parameter%20Server."""

from __future__ import annotations

from typing import Any

from minirospy import names
from minirospy.client.process import process
from minirospy.errors import MasterUnreachableError, ROSException, RpcError, RpcRefused

__all__ = [
    "delete_param",
    "get_param",
    "get_param_cached",
    "get_param_names",
    "has_param",
    "search_param",
    "set_param",
]


class _Unspecified:
    """The default of ``default``: None is a value that a caller may want back."""


_UNSPECIFIED = _Unspecified()


def get_param(param_name: str, default: Any = _UNSPECIFIED) -> Any:
    """A parameter's value, or ``default`` where it is not set.

    Raises KeyError where it is not set and there is no default, ROSException where the master fails.
    """
    name = process.resolve(param_name)
    try:
        return process.master.get_param(name)
    except RpcRefused as error:
        if default is _UNSPECIFIED:
            raise KeyError(param_name) from error
        return default
    except (MasterUnreachableError, RpcError) as error:
        raise _failed("get", name, error) from error


get_param_cached = get_param


def set_param(param_name: str, param_value: Any) -> None:
    """Set a parameter; a dictionary sets a whole namespace. Raises ROSException."""
    name = process.resolve(param_name)
    _checked(param_name)
    try:
        process.master.set_param(name, param_value)
    except (MasterUnreachableError, RpcError) as error:
        raise _failed("set", name, error) from error


def has_param(param_name: str) -> bool:
    """Whether a parameter, or a namespace of that name, is set. Raises ROSException."""
    name = process.resolve(param_name)
    try:
        return process.master.has_param(name)
    except (MasterUnreachableError, RpcError) as error:
        raise _failed("look for", name, error) from error


def delete_param(param_name: str) -> None:
    """Delete a parameter. Raises KeyError where it is not set, ROSException where the master fails."""
    name = process.resolve(param_name)
    try:
        process.master.delete_param(name)
    except RpcRefused as error:
        raise KeyError(param_name) from error
    except (MasterUnreachableError, RpcError) as error:
        raise _failed("delete", name, error) from error


def search_param(param_name: str) -> str | None:
    """The nearest parameter of this name, upwards from this node's namespace; None where there is none."""
    if not param_name:
        raise ROSException("search_param: param_name cannot be empty")
    try:
        return process.master.search_param(param_name)
    except (MasterUnreachableError, RpcError) as error:
        raise _failed("search", param_name, error) from error


def get_param_names() -> list[str]:
    """The names of all parameters. Raises ROSException."""
    try:
        return process.master.get_param_names()
    except (MasterUnreachableError, RpcError) as error:
        raise ROSException(f"unable to get parameter names: {error}") from error


def _checked(name: str) -> None:
    if not names.is_legal_name(name):
        import warnings

        warnings.warn(
            f"'{name}' is not a legal ROS graph resource name. This may cause problems with other ROS tools",
            stacklevel=3,
        )


def _failed(verb: str, name: str, error: Exception) -> ROSException:
    return ROSException(f"unable to {verb} parameter [{name}]: {error}")
