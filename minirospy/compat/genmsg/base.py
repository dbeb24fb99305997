"""genmsg.base: the signs and names of definition files."""

__all__ = ["COMMENTCHAR", "CONSTCHAR", "EXT_MSG", "EXT_SRV", "IODELIM", "MSG_DIR", "SEP", "SRV_DIR"]

SEP = "/"
MSG_DIR = "msg"
SRV_DIR = "srv"
EXT_MSG = ".msg"
EXT_SRV = ".srv"
CONSTCHAR = "="
COMMENTCHAR = "#"
IODELIM = "---"
