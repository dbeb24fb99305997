"""rospy.impl.transport and tcpros_base: the directions of a connection in getBusInfo, and constants of TCPROS."""

__all__ = ["BIDIRECTIONAL", "INBOUND", "OUTBOUND"]

INBOUND, OUTBOUND, BIDIRECTIONAL = "i", "o", "b"
TCPROS = "TCPROS"
DEFAULT_BUFF_SIZE = 65536
"""The default of Subscriber's ``buff_size``."""


def __getattr__(name: str) -> object:
    # Programs use them in annotations. Imported on use, because they import asyncio.
    if name in ("Transport", "DeadTransport"):
        from minirospy.runtime.transport.links import OutLink

        return OutLink
    raise AttributeError(f"module 'rospy.impl.transport' has no attribute {name!r}")
