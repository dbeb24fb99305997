"""Offer services whose work is done in the simulation's thread, between two steps.

A handler returns the response or, if it has fulfilled the request, only the status message. Otherwise, it raises
:class:`Refused`, and the response has ``success`` false and the text of the error.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from minirospy import client as rospy
from minirospy.ros.gazebo_ros.frames import find_joint, find_link
from minirospy.ros.gazebo_ros.loop import LoopClosed, SimulationLoop
from minirospy.ros.gazebo_ros.physics import SimJoint, SimLink, Simulation, SimulationError

__all__ = ["Refused", "apply", "offer", "offer_directly", "require_joint", "require_link"]

Handler = Callable[[Any], object]


class Refused(Exception):
    """Raised by a handler to refuse a request; ``str()`` is the status message."""


def offer(loop: SimulationLoop, name: str, kind: Any, handler: Handler) -> None:
    """Offer the service ``~name``; the handler runs in the simulation's thread.

    If it raises SimulationError, such as for a force that is NaN, the error is logged, and the request refused.
    """

    def run(request: object) -> object:
        try:
            return loop.call(lambda: handler(request))
        except SimulationError as error:
            rospy.logerr("%s", error)
            if not hasattr(kind._response_class, "success"):
                raise rospy.ServiceException(str(error)) from None
            raise Refused(str(error)) from None

    offer_directly(name, kind, run)


def offer_directly(name: str, kind: Any, handler: Handler) -> None:
    """Offer the service ``~name``. The handler runs in the service's thread and calls the simulation's thread itself."""

    def run(request: object) -> object:
        is_served = True
        try:
            answer = handler(request)
        except Refused as refusal:
            is_served, answer = False, str(refusal)
        except LoopClosed as error:  # the simulation has ended in the meantime
            raise rospy.ServiceException(str(error)) from None
        if answer is None:
            return kind._response_class()
        if isinstance(answer, str):
            return kind._response_class(success=is_served, status_message=answer)
        return answer

    rospy.Service(f"~{name}", kind, run)


def apply(loop: SimulationLoop, handler: Handler, request: object) -> None:
    """Run a message's handler in the simulation's thread. If it raises SimulationError, log the error."""
    try:
        loop.call(lambda: handler(request))
    except (LoopClosed, Refused):
        pass
    except SimulationError as error:
        rospy.logerr("%s", error)


def require_link(simulation: Simulation, name: str, service: str) -> SimLink:
    """Return a link. If it does not exist, raise Refused with a message that starts with ``service``."""
    if (link := find_link(simulation, name)) is None:
        raise Refused(f"{service}: link not found, did you forget to scope the link by model name?")
    return link


def require_joint(simulation: Simulation, name: str, service: str) -> SimJoint:
    """Return a joint. If it does not exist, raise Refused with a message that starts with ``service``."""
    if (joint := find_joint(simulation, name)) is None:
        raise Refused(f"{service}: joint not found")
    return joint
