"""Advice for a topic or service whose class argument has the wrong kind, such as a service class, a module or an instance."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

__all__ = ["advice_for_callback", "advice_for_message_class", "advice_for_service_class"]


def advice_for_callback(
    error: BaseException, function: Callable[..., object], message: Any, *, has_args: bool
) -> str:
    """Return a hint for a callback that has the wrong parameters, or that uses the message as if it were one of its fields.

    Return an empty string if the error has another cause.
    """
    if isinstance(error, TypeError):
        import inspect  # imported here because it takes 4 ms, and only a faulty callback needs it

        given = "the message and callback_args" if has_args else "the message"
        try:
            inspect.signature(function).bind(*((message, None) if has_args else (message,)))
        except TypeError:
            name = getattr(function, "__name__", "callback")
            parameters = "message, args" if has_args else "message"
            return f"a callback gets {given}: def {name}({parameters})"
        except ValueError:
            return ""
        if list(message.__slots__) == ["data"] and type(message).__name__ in str(error):
            return f"the value of a {message._type} is its field: message.data"
    # Compare with id(), because `is` would make mypy narrow the message's type to object.
    if isinstance(error, AttributeError) and id(error.obj) == id(message):
        return f"a {message._type} has the fields {', '.join(message.__slots__)}"
    return ""


def advice_for_message_class(given: object) -> str:
    """Return what is wrong with an argument that is not a message class."""
    if hasattr(given, "_request_class"):
        return (
            f"{getattr(given, '_type', given)} is a service type; a topic needs a message type (rosmsg list)"
        )
    if isinstance(given, ModuleType):
        return f"{given.__name__} is a module; name a class of it: from {given.__name__} import String"
    if isinstance(given, str):
        return f"{given!r} is a string; pass the class: from std_msgs.msg import String"
    if hasattr(given, "_md5sum") and not isinstance(given, type):
        name = type(given).__name__
        return f"this is a message; pass its class: {name}, not {name}()"
    return "it must be a class from a .msg module, as std_msgs.msg.String"


def advice_for_service_class(given: object) -> str:
    """Return what is wrong with an argument that is not a service class."""
    name = getattr(given, "__name__", "")
    if isinstance(given, ModuleType):
        return f"{name} is a module; name a class of it: from {name} import SetBool"
    if isinstance(given, str):
        return f"{given!r} is a string; pass the class: from std_srvs.srv import SetBool"
    if hasattr(given, "_md5sum"):
        service = name.removesuffix("Request").removesuffix("Response")
        if service != name:
            return f"{name} is half of a service; pass {service}"
        return (
            f"{getattr(given, '_type', name)} is a message type; a service needs a service type (rossrv list)"
        )
    return "it must be a class from a .srv module, as std_srvs.srv.SetBool"
