"""roslaunch.xmlloader, filled in by minirospy."""

from minirospy.launch.config import XmlLoader, XmlParseException

__all__ = ["XmlLoader", "XmlParseException"]
