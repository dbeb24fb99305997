"""The topics on which rosbridge_server reports its clients: /client_count and /connected_clients, both latched.

Source: http://wiki.ros.org/rosbridge_server, and the output of the real rosbridge_websocket in branch ros1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from minirospy.aio.handle import serialized
from minirospy.aio.node import Node
from minirospy.aio.topics import Publisher
from minirospy.core.idl.protocols import Message

if TYPE_CHECKING:
    from minirospy.web.rosbridge.session import RosbridgeSession

__all__ = ["ClientTopics"]


class ClientTopics:
    """Publishes the number of clients, and their addresses and connection times, after each change."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._sessions: Sequence[RosbridgeSession] = ()
        self._count: Publisher[Message] | None = None
        self._clients: Publisher[Message] | None = None

    async def start(self) -> None:
        """Start to publish the clients.

        Raise MasterUnreachableError if the master does not respond, RpcError if the call fails.
        """
        from rosbridge_msgs.msg import ConnectedClients
        from std_msgs.msg import Int32

        self._count = await self._node.advertise("client_count", Int32, queue_size=10, latch=True)
        self._clients = await self._node.advertise(
            "connected_clients", ConnectedClients, queue_size=10, latch=True
        )
        self._publish()

    async def close(self) -> None:
        """Stop publishing. Idempotent."""
        publishers = self._count, self._clients
        self._count = self._clients = None
        for publisher in publishers:
            if publisher:
                await publisher.close()

    def changed(self, sessions: Sequence[RosbridgeSession]) -> None:
        """Publish the new list of connected clients, given the open sessions."""
        self._sessions = sessions
        self._publish()

    def _publish(self) -> None:
        from rosbridge_msgs.msg import ConnectedClient, ConnectedClients
        from std_msgs.msg import Int32

        if self._count and self._clients and not self._node.is_shutdown:
            clients = [
                ConnectedClient(ip_address=session.client.name, connection_time=session.connected)
                for session in self._sessions
            ]
            self._clients.publish_raw(serialized(ConnectedClients(clients=clients)))
            self._count.publish_raw(serialized(Int32(data=len(clients))))
