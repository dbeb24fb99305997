"""Client authentication by a MAC, which rosauth's node checks. Source: http://wiki.ros.org/rosauth."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from minirospy.base.times import Time
from minirospy.web.rosbridge.protocol import Auth
from minirospy.web.rosbridge.types import service_class

if TYPE_CHECKING:
    from minirospy.aio.node import Node

__all__ = ["SERVICE", "authenticate"]

SERVICE = "authenticate"
"""Name, in the server's namespace, of the service that `rosrun rosauth ros_mac_authentication` provides."""


async def authenticate(node: Node, event: Auth) -> bool:
    """Return whether rosauth's node accepts a client. Raise ServiceException if the call fails."""
    class_: Any = service_class("rosauth/Authentication")
    response = await node.call(
        SERVICE,
        class_,
        event.mac,
        event.client,
        event.dest,
        event.rand,
        _time(event.time),
        event.level,
        _time(event.end),
    )
    return bool(response.authenticated)


def _time(seconds: float) -> Time:
    return Time(int(seconds), int(seconds % 1 * 1e9))
