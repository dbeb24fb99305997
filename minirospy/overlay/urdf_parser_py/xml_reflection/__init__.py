"""urdf_parser_py.xml_reflection, provided by minirospy."""

from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection.core import Object as Object
from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection.core import ParseError as ParseError
from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection.core import Path as Path
from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection.core import on_error as on_error
from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection.core import on_error_stderr as on_error_stderr
from urdf_parser_py.xml_reflection import core as core
