"""urdf_parser_py.xml_reflection: objects that are read from XML and written to XML."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection import core
    from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection.core import (
        Object,
        ParseError,
        Path,
        on_error,
        on_error_stderr,
    )

__all__ = ["Object", "ParseError", "Path", "core", "on_error", "on_error_stderr"]
