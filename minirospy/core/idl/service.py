"""Convert a service handler's return value to the response."""

from __future__ import annotations

from typing import cast

from minirospy.base.errors import ServiceException
from minirospy.core.idl.protocols import Message

__all__ = ["to_response"]


def to_response(response_class: type[Message], returned: object) -> Message:
    """Return a response of ``response_class`` created from a handler's return value.

    The handler may return a response, a dictionary of some of its fields, a list or tuple of all its field values, or the
    value of its only field. If the value does not match, raise ServiceException with rospy's message.
    """
    # Compare the types' names: a type may have several classes, for example from a reloaded module or another generator.
    if getattr(type(returned), "_type", None) == response_class._type:
        return cast("Message", returned)
    if returned is None:
        raise ServiceException("service handler returned None")
    try:
        if isinstance(returned, dict):
            return response_class(**returned)
        values = returned if isinstance(returned, list | tuple) else [returned]
        return response_class(*values)
    except (TypeError, AttributeError) as error:
        what = "wrong number of values" if isinstance(returned, list | tuple) else "invalid value"
        raise ServiceException(f"handler returned {what}: {error}") from error
