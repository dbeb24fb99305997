"""roslaunch.loader, provided by minirospy."""

import rosparam as rosparam

from minirospy.ros.roslaunch.roslaunch.core import Param, RLException
from minirospy.ros.roslaunch.roslaunch.loader import convert_value
from minirospy.ros.roslaunch.roslaunch.xmlloader import XmlParseException
from minirospy.ros.roslaunch.roslaunch.xmlloader import XmlParseException as LoadException

__all__ = ["LoadException", "Param", "RLException", "XmlParseException", "convert_value"]
