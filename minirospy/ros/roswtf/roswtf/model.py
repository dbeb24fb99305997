"""roswtf.model: what a check found."""

from __future__ import annotations

__all__ = ["WtfError", "WtfWarning"]


class WtfError:
    """A fault: its text, the text before its values were inserted, and what the check returned."""

    def __init__(self, msg: str, format_msg: str | None = None, return_val: object = None) -> None:
        self.msg = msg
        self.format_msg = msg if format_msg is None else format_msg
        self.return_val = True if return_val is None else return_val


class WtfWarning(WtfError):
    """Something that may be a fault."""
