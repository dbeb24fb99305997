"""genpy.generator, provided by minirospy: Python modules of definitions, written by its own compiler."""

from minirospy.ros.genpy.genpy.generator import (
    Generator,
    MsgGenerator,
    SrvGenerator,
    _remap_reserved,
    compute_outfile_name,
    compute_pkg_type,
    compute_resource_name,
    make_python_safe,
    msg_generator,
    srv_generator,
)

__all__ = [
    "Generator",
    "MsgGenerator",
    "SrvGenerator",
    "compute_outfile_name",
    "compute_pkg_type",
    "compute_resource_name",
    "make_python_safe",
    "msg_generator",
    "srv_generator",
]
