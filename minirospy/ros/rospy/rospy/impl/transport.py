"""rospy.impl.transport and tcpros_base: the connection directions in getBusInfo, and TCPROS constants."""

__all__ = ["BIDIRECTIONAL", "INBOUND", "OUTBOUND"]

INBOUND, OUTBOUND, BIDIRECTIONAL = "i", "o", "b"
TCPROS = "TCPROS"
DEFAULT_BUFF_SIZE = 65536
"""The default value for Subscriber's ``buff_size``."""


# Imported on first use: few programs use these classes, and `import rospy` must not load their module.
_CLASSES = ("DeadTransport", "ProtocolHandler", "Transport")


def __dir__() -> list[str]:
    return sorted([*__all__, *_CLASSES])


def __getattr__(name: str) -> object:
    if name in _CLASSES:
        from minirospy.client import tcpros

        return getattr(tcpros, name)
    raise AttributeError(f"module 'rospy.impl.transport' has no attribute {name!r}")
