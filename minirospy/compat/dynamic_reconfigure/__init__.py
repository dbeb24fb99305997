"""dynamic_reconfigure: parameters that change while a node runs. Source: http://wiki.ros.org/dynamic_reconfigure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Protocol

__all__ = [
    "DynamicReconfigureCallbackException",
    "DynamicReconfigureException",
    "DynamicReconfigureParameterException",
    "find_reconfigure_services",
    "get_parameter_names",
]

_SUFFIX = "/set_parameters"


class DynamicReconfigureException(Exception):
    """What goes wrong with dynamic_reconfigure."""


class DynamicReconfigureParameterException(DynamicReconfigureException):
    """A parameter that the server does not have, or a value that it cannot have."""


class DynamicReconfigureCallbackException(DynamicReconfigureException):
    """The server's callback failed, or returned no configuration."""


class ConfigType(Protocol):
    """A module ``package.cfg.NAMEConfig``, which is generated from a .cfg file."""

    defaults: Mapping[str, Any]
    min: Mapping[str, Any]
    max: Mapping[str, Any]
    config_description: Mapping[str, Any]


def find_reconfigure_services() -> list[str]:
    """Return the names of all servers, sorted. Raises ROSServiceIOException where there is no master."""
    from minirospy.compat import rosservice

    names = rosservice.get_service_list()
    return sorted(name[: -len(_SUFFIX)] for name in names if name.endswith(_SUFFIX))


def get_parameter_names(descr: ConfigType) -> Iterable[str]:
    """Return the names of a type's parameters."""
    return descr.defaults.keys()
