"""rospkg: where packages are, and what they need."""

__version__ = "1.4.0"
