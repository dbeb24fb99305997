"""A topic's links, which programs read from ``impl.connections``. They have the attributes of rospy's transports.

Source: http://docs.ros.org/en/noetic/api/rospy/html/rospy.impl.transport-module.html (class Transport).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from minirospy.runtime.node.slave import connection_text

if TYPE_CHECKING:
    from minirospy.runtime.node.subscription import InLink
    from minirospy.runtime.transport.links import OutLink

__all__ = ["Connection", "connection_to_publisher", "connection_to_subscriber"]


class Connection(NamedTuple):
    """A snapshot of one end of a link.

    ``direction`` is "i" (from a publisher) or "o" (to a subscriber); ``name`` is the topic; ``id`` is unique in the node.
    ``endpoint_id`` is the URI of the publisher's Slave API, or the name of the subscribing node. ``callerid_pub``,
    ``header``, ``type`` and ``md5sum`` have the values that the publisher sent; they are "unknown" or None if this node is
    the publisher. ``stat_bytes`` and ``stat_num_msg`` count the bytes and messages received or sent. ``transport_type`` is
    always TCPROS; :meth:`get_transport_info` names a Unix socket.
    """

    link: InLink | OutLink
    name: str
    direction: str
    endpoint_id: str
    id: int
    transport_type: str
    stat_bytes: int
    stat_num_msg: int
    callerid_pub: str = "unknown"
    header: dict[str, str] | None = None
    type: str | None = None
    md5sum: str | None = None
    is_latched: bool = False
    done: bool = False

    def get_transport_info(self) -> str:
        """Return the link's description in the format of getBusInfo in the Slave API."""
        return connection_text(self.link)

    def close(self) -> None:
        """Close the link. A subscriber reconnects if the publisher is still registered."""
        self.link.close()


def connection_to_publisher(link: InLink, topic: str) -> Connection:
    """Return the subscriber's end of a link, as a Connection."""
    header = dict(link.header)
    return Connection(
        link,
        topic,
        "i",
        link.uri,
        link.number,
        "TCPROS",
        link.received_bytes,
        link.received,
        callerid_pub=header.get("callerid", "unknown"),
        header=header,
        type=header.get("type"),
        md5sum=header.get("md5sum"),
        is_latched=header.get("latching") == "1",
        done=link.closed,
    )


def connection_to_subscriber(link: OutLink, topic: str) -> Connection:
    """Return the publisher's end of a link, as a Connection."""
    return Connection(link, topic, "o", link.peer, link.number, "TCPROS", link.sent_bytes, link.sent)
