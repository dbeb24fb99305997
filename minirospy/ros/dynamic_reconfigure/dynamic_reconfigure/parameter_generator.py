"""dynamic_reconfigure.parameter_generator: the names that .cfg files import. Source: http://wiki.ros.org/dynamic_reconfigure."""

import inspect as inspect
import os as os
import re as re
import sys as sys
import textwrap as textwrap
from string import Template

from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure.parameter_generator_catkin import (
    ParameterGenerator,
    bool_t,
    check_description,
    check_name,
    double_t,
    int_t,
    str_t,
)

__all__ = [
    "ParameterGenerator",
    "Template",
    "bool_t",
    "check_description",
    "check_name",
    "double_t",
    "inspect",
    "int_t",
    "os",
    "re",
    "str_t",
    "sys",
    "textwrap",
]
