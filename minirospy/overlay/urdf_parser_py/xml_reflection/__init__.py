"""urdf_parser_py.xml_reflection, provided by minirospy."""

from minirospy.compat.urdf_parser_py.xml_reflection.core import Object as Object
from minirospy.compat.urdf_parser_py.xml_reflection.core import ParseError as ParseError
from minirospy.compat.urdf_parser_py.xml_reflection.core import Path as Path
from minirospy.compat.urdf_parser_py.xml_reflection.core import on_error as on_error
from minirospy.compat.urdf_parser_py.xml_reflection.core import on_error_stderr as on_error_stderr
from urdf_parser_py.xml_reflection import core as core
