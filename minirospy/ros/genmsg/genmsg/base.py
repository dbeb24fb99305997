"""genmsg.base: constants for definition files, and the exception raised if a definition cannot be parsed."""

from __future__ import annotations

from minirospy.base.errors import MessageException

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
    "MsgGenerationException",
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
    """Raised if the definition cannot be parsed."""


class MsgGenerationException(MessageException):
    """Raised if no class can be generated from a definition."""
