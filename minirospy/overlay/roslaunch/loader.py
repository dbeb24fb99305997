"""roslaunch.loader, filled in by minirospy."""

import rosparam as rosparam

from minirospy.compat.roslaunch.config import Param, RLException, XmlParseException
from minirospy.compat.roslaunch.config import XmlParseException as LoadException
from minirospy.compat.roslaunch.loader import convert_value

__all__ = ["LoadException", "Param", "RLException", "XmlParseException", "convert_value"]
