"""kdl_parser_py.urdf, provided by minirospy: `treeFromString(text)`."""

from minirospy.ros.kdl_parser_py.kdl_parser_py.urdf import treeFromFile as treeFromFile
from minirospy.ros.kdl_parser_py.kdl_parser_py.urdf import treeFromParam as treeFromParam
from minirospy.ros.kdl_parser_py.kdl_parser_py.urdf import treeFromString as treeFromString
from minirospy.ros.kdl_parser_py.kdl_parser_py.urdf import treeFromUrdfModel as treeFromUrdfModel
