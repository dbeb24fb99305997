"""rosmaster.exceptions."""

__all__ = ["InternalException"]


class InternalException(Exception):
    """A fault of the master itself."""
