"""rosmaster.exceptions."""

__all__ = ["InternalException"]


class InternalException(Exception):
    """An internal error of the master."""
