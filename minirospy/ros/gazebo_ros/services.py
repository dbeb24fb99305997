"""Offer services whose work is done in the simulation's thread, between two steps."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

from minirospy import client as rospy
from minirospy.ros.gazebo_ros.loop import LoopClosed, SimulationLoop
from minirospy.ros.gazebo_ros.physics import SimulationError

__all__ = ["apply", "offer", "offer_directly"]


def offer(loop: SimulationLoop, name: str, kind: Any, handler: Callable[[Any], Any]) -> None:
    """Offer the service ``~name``; the handler runs in the simulation's thread.

    If the handler raises SimulationError, the response has ``success`` false and the error's text.
    """

    def run(request: object) -> object:
        try:
            return _until_closed(lambda each: loop.call(lambda: handler(each)), request)
        except SimulationError as error:  # such as a force that is NaN
            rospy.logerr("%s", error)
            response = kind._response_class()
            if not hasattr(response, "success"):
                raise rospy.ServiceException(str(error)) from None
            response.success, response.status_message = False, str(error)
            return response

    rospy.Service(f"~{name}", kind, run)


def offer_directly(name: str, kind: Any, handler: Callable[[Any], Any]) -> None:
    """Offer the service ``~name``; the handler runs in the service's own thread, and calls the simulation's itself."""
    rospy.Service(f"~{name}", kind, functools.partial(_until_closed, handler))


def apply(loop: SimulationLoop, handler: Callable[[Any], object], request: object) -> None:
    """Do in the simulation's thread what a message asks for."""
    try:
        loop.call(lambda: handler(request))
    except LoopClosed:
        pass
    except SimulationError as error:
        rospy.logerr("%s", error)


def _until_closed(handler: Callable[[Any], Any], request: object) -> object:
    """Call a handler; refuse the request in one line if the simulation ends meanwhile."""
    try:
        return handler(request)
    except LoopClosed as error:
        raise rospy.ServiceException(str(error)) from None
