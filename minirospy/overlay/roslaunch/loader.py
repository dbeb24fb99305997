"""roslaunch.loader, provided by minirospy."""

import rosparam as rosparam

from minirospy.compat.roslaunch.core import Param, RLException
from minirospy.compat.roslaunch.loader import convert_value
from minirospy.compat.roslaunch.xmlloader import XmlParseException
from minirospy.compat.roslaunch.xmlloader import XmlParseException as LoadException

__all__ = ["LoadException", "Param", "RLException", "XmlParseException", "convert_value"]
