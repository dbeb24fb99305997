"""dynamic_reconfigure.parameter_generator_catkin, provided by minirospy: what .cfg files describe parameters with. Source: http://wiki.ros.org/dynamic_reconfigure."""

import inspect
import os
import re
import sys
import textwrap
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
