"""rosmaster.exceptions: the error that rosmaster's classes raise."""

__all__ = ["InternalException"]


class InternalException(Exception):
    """An internal error of the master."""
