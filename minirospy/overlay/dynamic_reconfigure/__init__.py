"""dynamic_reconfigure, provided by minirospy: parameters that change while a node runs. Source: http://wiki.ros.org/dynamic_reconfigure."""

from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure import (
    DynamicReconfigureCallbackException,
    DynamicReconfigureException,
    DynamicReconfigureParameterException,
    find_reconfigure_services,
    get_parameter_names,
)

__all__ = [
    "DynamicReconfigureCallbackException",
    "DynamicReconfigureException",
    "DynamicReconfigureParameterException",
    "find_reconfigure_services",
    "get_parameter_names",
]
