"""roslib.exceptions: the base class of roslib's errors."""

__all__ = ["ROSLibException"]


class ROSLibException(Exception):
    """The base class of roslib's errors."""
