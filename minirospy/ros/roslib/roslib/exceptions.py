"""roslib.exceptions: the base class of roslib's errors."""

__all__ = ["ROSLibException"]


class ROSLibException(Exception):
    """Base class of roslib's errors."""
