"""kdl_parser_py.urdf, provided by minirospy: `treeFromString(text)`."""

from minirospy.compat.kdl_parser_py.urdf import treeFromFile as treeFromFile
from minirospy.compat.kdl_parser_py.urdf import treeFromParam as treeFromParam
from minirospy.compat.kdl_parser_py.urdf import treeFromString as treeFromString
from minirospy.compat.kdl_parser_py.urdf import treeFromUrdfModel as treeFromUrdfModel
