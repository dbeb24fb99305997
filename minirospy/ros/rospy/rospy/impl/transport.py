"""rospy.impl.transport and tcpros_base: the connection directions in getBusInfo, and TCPROS constants."""

__all__ = ["BIDIRECTIONAL", "INBOUND", "OUTBOUND"]

INBOUND, OUTBOUND, BIDIRECTIONAL = "i", "o", "b"
TCPROS = "TCPROS"
DEFAULT_BUFF_SIZE = 65536
"""The default value for Subscriber's ``buff_size``."""


def __getattr__(name: str) -> object:
    # Few programs use these classes. Imported on use, so that `import rospy` need not import their module.
    if name in ("DeadTransport", "ProtocolHandler", "Transport"):
        from minirospy.client import tcpros

        return getattr(tcpros, name)
    raise AttributeError(f"module 'rospy.impl.transport' has no attribute {name!r}")
