"""roslib.exceptions."""

__all__ = ["ROSLibException"]


class ROSLibException(Exception):
    """The root of roslib's errors."""
