"""roslaunch.xmlloader, provided by minirospy: launch files into a configuration."""

from minirospy.compat.roslaunch.core import Machine, Node, Param, RLException, Test
from minirospy.compat.roslaunch.substitution_args import ArgException, SubstitutionException
from minirospy.compat.roslaunch.xmlloader import XmlLoader, XmlParseException

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
