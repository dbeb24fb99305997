"""dynamic_reconfigure: parameters that change while a node runs. Source: http://wiki.ros.org/dynamic_reconfigure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Protocol, TypeAlias, TypedDict

__all__ = [
    "DynamicReconfigureCallbackException",
    "DynamicReconfigureException",
    "DynamicReconfigureParameterException",
    "find_reconfigure_services",
    "get_parameter_names",
]

_SUFFIX = "/set_parameters"

Value: TypeAlias = bool | int | float | str  # a parameter's value

Values: TypeAlias = Mapping[str, Any]
"""Values by parameter name; ``groups``, if present, contains the tree of groups or their states."""

GroupTree: TypeAlias = Mapping[str, Any]
"""A group with its ID, name, state, parameters and subgroups, either from a type's description or decoded."""


class Entry(TypedDict, total=False):
    """A parameter or a constant, as defined in a .cfg file and stored in the generated module."""

    name: str
    type: str
    ctype: str
    cconsttype: str
    description: str
    srcfile: str
    srcline: int
    # set for constants only
    value: Value
    # set for parameters only
    default: Value | None
    min: Value | None
    max: Value | None
    level: int
    edit_method: str


class DynamicReconfigureException(Exception):
    """The base class of dynamic_reconfigure's errors."""


class DynamicReconfigureParameterException(DynamicReconfigureException):
    """Raised if the server does not have the parameter, or the value is invalid."""


class DynamicReconfigureCallbackException(DynamicReconfigureException):
    """Raised if the server's callback failed, or returned no configuration."""


class ConfigType(Protocol):
    """A module ``package.cfg.NAMEConfig``, generated from a .cfg file."""

    defaults: Mapping[str, Value]
    min: Mapping[str, Value]
    max: Mapping[str, Value]
    config_description: GroupTree


def find_reconfigure_services() -> list[str]:
    """Return the names of all servers, sorted. Raise ROSServiceIOException if the master is unreachable."""
    from minirospy.ros.rosservice import rosservice

    names = rosservice.get_service_list()
    return sorted(name[: -len(_SUFFIX)] for name in names if name.endswith(_SUFFIX))


def get_parameter_names(descr: ConfigType) -> Iterable[str]:
    """Return a configuration type's parameter names."""
    return descr.defaults.keys()
