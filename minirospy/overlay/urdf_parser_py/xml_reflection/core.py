"""urdf_parser_py.xml_reflection.core, provided by minirospy."""

from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection.core import Object as Object
from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection.core import ParseError as ParseError
from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection.core import Path as Path
from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection.core import on_error as on_error
from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection.core import on_error_stderr as on_error_stderr
from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection.core import to_yaml as to_yaml
from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection.core import xml_string as xml_string
