"""genmsg.base, provided by minirospy."""

from minirospy.ros.genmsg.genmsg.base import (
    COMMENTCHAR,
    CONSTCHAR,
    EXT_MSG,
    EXT_SRV,
    IODELIM,
    MSG_DIR,
    SEP,
    SRV_DIR,
    InvalidMsgSpec,
)
from minirospy.ros.genmsg.genmsg.msg_loader import MsgGenerationException

__all__ = [
    "COMMENTCHAR", "CONSTCHAR", "EXT_MSG", "EXT_SRV", "IODELIM", "MSG_DIR", "SEP", "SRV_DIR", "InvalidMsgSpec",
    "MsgGenerationException",
]  # fmt: skip
