"""Serves devices that connect over TCP. Source: http://wiki.ros.org/rosserial_python (tcp)."""

from __future__ import annotations

import socket
import threading

from minirospy import client as rospy
from minirospy.ros.rosserial_python.devices.client import SerialClient
from minirospy.ros.rosserial_python.devices.ports import PortError, SocketPort

__all__ = ["RosSerialServer"]

_LOOK_SECONDS = 0.2


class RosSerialServer:
    """Listens on a TCP port. Serves one device at a time or, if ``fork_server``, each device in its own thread."""

    def __init__(self, tcp_portnum: int, fork_server: bool = False) -> None:
        rospy.loginfo("Fork_server is: %s", fork_server)
        self.tcp_portnum = tcp_portnum
        self.fork_server = fork_server

    def listen(self) -> None:
        """Serve devices until the node shuts down. Raise OSError if the port cannot be opened."""
        with socket.create_server(("", self.tcp_portnum), backlog=8) as server:
            server.settimeout(_LOOK_SECONDS)
            rospy.loginfo("Waiting for socket connection")
            while not rospy.is_shutdown():
                try:
                    connection, address = server.accept()
                except TimeoutError:
                    continue
                rospy.loginfo("Established a socket connection from %s on port %s", *address[:2])
                if self.fork_server:
                    threading.Thread(target=self._serve, args=(connection,), daemon=True).start()
                else:
                    self._serve(connection)

    def _serve(self, connection: socket.socket) -> None:
        client = SerialClient(SocketPort(connection))
        try:
            client.run()
        except PortError as error:
            rospy.loginfo("%s", error)
        finally:
            rospy.loginfo("Client has exited, closing socket.")
            client.close()
