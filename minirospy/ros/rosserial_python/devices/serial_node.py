"""serial_node.py: connects a device on a serial port, or devices that connect over TCP (`serial_node.py tcp [PORT]`).

Parameters: ~port (/dev/ttyUSB0), ~baud (57600), ~tcp_port and ~fork_server (default: those of /rosserial_embeddedlinux),
~fix_pyserial_for_test. Source: http://wiki.ros.org/rosserial_python.
"""

from __future__ import annotations

import sys
import time

from minirospy import client as rospy
from minirospy.ros.rosserial_python.devices.client import SerialClient
from minirospy.ros.rosserial_python.devices.ports import PortError
from minirospy.ros.rosserial_python.devices.server import RosSerialServer

__all__ = ["main", "message_info_service"]

_RETRY_SECONDS = 1.0
_TCP_PORT = 11411
_OTHER = "/rosserial_embeddedlinux"


def main() -> int:
    """Run the node until it shuts down; return 1 if it cannot start, else 0."""
    try:
        rospy.init_node("serial_node")
        rospy.loginfo("ROS Serial Python Node")
        return _run(rospy.myargv()[1:])
    except rospy.ROSInterruptException:
        return 0


def _run(words: list[str]) -> int:
    port = words[0] if words else str(rospy.get_param("~port", "/dev/ttyUSB0"))
    try:
        baud = int(rospy.get_param("~baud", 57600))
        tcp_port = int(words[1] if len(words) > 1 else _param("tcp_port", _TCP_PORT))  # type: ignore[call-overload]
    except (TypeError, ValueError) as error:
        rospy.logerr("~baud and the port of TCP are whole numbers: %s", error)
        return 1
    if port == "tcp":
        return _serve(RosSerialServer(tcp_port, bool(_param("fork_server", False))))
    try:
        _follow(port, baud, bool(rospy.get_param("~fix_pyserial_for_test", False)))
    except ImportError as error:
        print(f"serial_node: ERROR: {error}", file=sys.stderr)
        return 1
    return 0


def _param(name: str, default: object) -> object:
    """Return a private parameter. If it is not set, return the one of rosserial_embeddedlinux, which older launch files set."""
    return rospy.get_param(f"~{name}", rospy.get_param(f"{_OTHER}/{name}", default))


def _serve(server: RosSerialServer) -> int:
    rospy.loginfo("Waiting for socket connections on port %d", server.tcp_portnum)
    try:
        server.listen()
    except OSError as error:
        rospy.logerr("the port %d of TCP cannot be had: %s", server.tcp_portnum, error.strerror or error)
        return 1
    rospy.loginfo("All done")
    return 0


def _follow(port: str, baud: int, uses_handshake: bool) -> None:
    while not rospy.is_shutdown():
        rospy.loginfo("Connecting to %s at %d baud", port, baud)
        client = SerialClient(port, baud, fix_pyserial_for_test=uses_handshake)
        try:
            client.run()
        except PortError as error:
            if not rospy.is_shutdown():
                rospy.logwarn("%s", error)
                time.sleep(_RETRY_SECONDS)
        finally:
            client.close()


def message_info_service() -> int:
    """Run message_info_service, which only logs that it is obsolete; return the exit status."""
    try:
        rospy.init_node("message_info_service")
        rospy.logwarn(
            "The message info service node is no longer needed and will be removed in a future release of rosserial."
        )
        rospy.spin()
    except rospy.ROSInterruptException:
        pass
    return 0
