"""roslaunch.xmlloader, provided by minirospy: launch files into a configuration."""

from minirospy.ros.roslaunch.roslaunch.core import Machine, Node, Param, RLException, Test
from minirospy.ros.roslaunch.roslaunch.substitution_args import ArgException, SubstitutionException
from minirospy.ros.roslaunch.roslaunch.xmlloader import XmlLoader, XmlParseException

__all__ = [
    "ArgException",
    "Machine",
    "Node",
    "Param",
    "RLException",
    "SubstitutionException",
    "Test",
    "XmlLoader",
    "XmlParseException",
]
