"""roslaunch.xmlloader, filled in by minirospy."""

from minirospy.compat.roslaunch.config import (
    ArgException,
    Machine,
    Node,
    Param,
    RLException,
    SubstitutionException,
    Test,
    XmlLoader,
    XmlParseException,
)

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
