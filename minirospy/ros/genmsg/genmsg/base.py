"""genmsg.base: constants of definition files, and the exception for a definition that cannot be parsed."""

from __future__ import annotations

__all__ = [
    "COMMENTCHAR",
    "CONSTCHAR",
    "EXT_MSG",
    "EXT_SRV",
    "IODELIM",
    "MSG_DIR",
    "SEP",
    "SRV_DIR",
    "InvalidMsgSpec",
]

SEP = "/"
MSG_DIR = "msg"
SRV_DIR = "srv"
EXT_MSG = ".msg"
EXT_SRV = ".srv"
CONSTCHAR = "="
COMMENTCHAR = "#"
IODELIM = "---"


class InvalidMsgSpec(Exception):
    """A definition cannot be parsed."""
