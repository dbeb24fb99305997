"""rospy.impl.transport and tcpros_base: the connection directions in getBusInfo, and TCPROS constants."""

__all__ = ["BIDIRECTIONAL", "INBOUND", "OUTBOUND"]

INBOUND, OUTBOUND, BIDIRECTIONAL = "i", "o", "b"
TCPROS = "TCPROS"
DEFAULT_BUFF_SIZE = 65536
"""The default value for Subscriber's ``buff_size``."""


def __getattr__(name: str) -> object:
    # Programs use these names in annotations. Import them only on use, because their module imports asyncio.
    if name in ("Transport", "DeadTransport"):
        from minirospy.runtime.transport.links import OutLink

        return OutLink
    raise AttributeError(f"module 'rospy.impl.transport' has no attribute {name!r}")
