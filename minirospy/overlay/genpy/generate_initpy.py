"""genpy.generate_initpy, provided by minirospy: the ``__init__`` of a folder of generated modules."""

from minirospy.ros.genpy.genpy.generate_initpy import write_module, write_modules

__all__ = ["write_module", "write_modules"]
