"""roswtf.model: the results of checks."""

from __future__ import annotations

__all__ = ["WtfError", "WtfWarning"]


class WtfError:
    """An error: its message, the message's template and the check's return value."""

    def __init__(self, msg: str, format_msg: str | None = None, return_val: object = None) -> None:
        self.msg = msg
        self.format_msg = msg if format_msg is None else format_msg
        self.return_val = True if return_val is None else return_val


class WtfWarning(WtfError):
    """A possible error."""
