"""genmsg.base, filled in by minirospy."""

from minirospy.idl.genmsg import InvalidMsgSpec, MsgGenerationException

__all__ = [
    "COMMENTCHAR", "CONSTCHAR", "EXT_MSG", "EXT_SRV", "IODELIM", "MSG_DIR", "SEP", "SRV_DIR", "InvalidMsgSpec",
    "MsgGenerationException",
]  # fmt: skip

SEP = "/"
MSG_DIR = "msg"
SRV_DIR = "srv"
EXT_MSG = ".msg"
EXT_SRV = ".srv"
CONSTCHAR = "="
COMMENTCHAR = "#"
IODELIM = "---"
