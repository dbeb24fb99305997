"""rospy.impl.transport, filled in by minirospy: the directions of a connection, as getBusInfo tells them."""

from typing import Any

__all__ = ["BIDIRECTIONAL", "INBOUND", "OUTBOUND"]

INBOUND, OUTBOUND, BIDIRECTIONAL = "i", "o", "b"


def __getattr__(name: str) -> Any:
    # For annotations, and for programs into which an editor has imported it. asyncio comes with it.
    if name in ("Transport", "DeadTransport"):
        from minirospy.runtime.links import OutLink

        return OutLink
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
