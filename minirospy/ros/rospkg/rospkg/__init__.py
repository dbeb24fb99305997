"""rospkg: finds packages and their dependencies."""

__version__ = "1.4.0"
