"""genmsg.msgs: the types that a definition may name without a package."""

__all__ = ["DURATION", "DURATION_MSG", "HEADER", "TIME", "TIME_MSG"]

HEADER = "Header"
TIME = "time"
DURATION = "duration"
TIME_MSG = "uint32 secs\nuint32 nsecs"
DURATION_MSG = "int32 secs\nint32 nsecs"
