"""Calls to the Master API and the Slave API: tables of methods and their parameters, and the dispatcher that checks them.

Pure: calls a method by name with its arguments, and returns ``[status code, message, value]``. Source:
http://wiki.ros.org/ROS/Master_API, http://wiki.ros.org/ROS/Slave_API; the error messages for invalid arguments are
rosmaster's.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from typing import NamedTuple

from minirospy.base import names
from minirospy.base.errors import MinirospyError, RpcFault
from minirospy.base.escape import has_controls
from minirospy.base.steps import Steps

__all__ = [
    "ERROR",
    "FAILURE",
    "SUCCESS",
    "Answer",
    "CallRefused",
    "Dispatcher",
    "Method",
    "Parameter",
    "anything",
    "api_uri",
    "global_key",
    "global_name",
    "node_name",
    "parameter_key",
    "parameters",
    "plain_key",
    "some",
    "subgraph",
    "text",
    "type_name",
    "uris",
]

SUCCESS, FAILURE, ERROR = 1, 0, -1  # status codes in a response

Answer = list[object]  # ``[status code, message, value]``

_MAX_CHARACTERS = 4096  # maximum length of a name, a type or a URI

_MAX_URIS = 20_000
"""Maximum number of URIs in a list, because checking them blocks the node for some milliseconds.

No master lists as many for one topic.
"""


class CallRefused(MinirospyError):
    """An argument is invalid; ``str()`` is the message in the response."""


class Parameter(NamedTuple):
    """A method's parameter: ``read(value, name, caller_id)`` returns the argument or raises CallRefused."""

    name: str
    read: Callable[[object, str, str], object]


class Method(NamedTuple):
    """A method: the function to call with the caller_id and the arguments, and the value to return if the call is refused."""

    function: Callable[..., Answer | Steps[Answer]]
    refused: object
    parameters: tuple[Parameter, ...] = ()
    optional: int = 0  # number of trailing parameters that may be omitted


class Dispatcher:
    """Checks the arguments of calls and calls the methods. A response may be computed in steps."""

    def __init__(
        self,
        methods: dict[str, Method],
        *,
        refusals: tuple[type[Exception], ...] = (),
    ) -> None:
        """Create the dispatcher. If a method raises one of the exceptions in ``refusals``, treat it like CallRefused."""
        self.methods = methods
        self._refusals: tuple[type[Exception], ...] = (CallRefused, *refusals)

    def dispatch(self, name: str, args: Sequence[object]) -> object:
        """Return the response to one call, or the steps that compute it. Raise RpcFault if the method is unknown."""
        method = self.methods.get(name)
        if method is None:
            return self._dispatch_system(name, args)

        if not args:
            return [ERROR, "missing required caller_id parameter", method.refused]
        most = len(method.parameters) + 1
        if not most - method.optional <= len(args) <= most:
            return [ERROR, "Error: bad call arity", method.refused]

        caller_id = args[0]
        if not isinstance(caller_id, str):
            return [ERROR, "caller_id must be a string", method.refused]

        try:
            if len(caller_id) > _MAX_CHARACTERS:
                raise CallRefused(f"the caller_id has more than {_MAX_CHARACTERS} characters")
            if has_controls(caller_id):
                raise CallRefused("caller_id contains illegal chars")
            answer = method.function(
                caller_id,
                *[
                    parameter.read(value, parameter.name, caller_id)
                    for parameter, value in zip(method.parameters, args[1:], strict=False)
                ],
            )
        except self._refusals as refusal:
            return [ERROR, str(refusal), method.refused]
        return answer if isinstance(answer, list) else self._finish(answer, method.refused)

    def _finish(self, steps: Steps[Answer], refused: object) -> Steps[Answer]:
        try:
            return (yield from steps)
        except self._refusals as refusal:
            return [ERROR, str(refusal), refused]

    def _dispatch_system(self, name: str, args: Sequence[object]) -> object:
        """Call ``system.multicall`` or ``system.listMethods`` (http://xmlrpc-c.sourceforge.net/introspection.html)."""
        if name == "system.listMethods":
            return sorted(self.methods)
        if name == "system.multicall":
            if len(args) != 1 or not isinstance(args[0], list):
                raise RpcFault(1, "system.multicall takes a list of structs of methodName and params")
            return self._call_many(args[0])
        raise RpcFault(1, f"<class 'Exception'>:method \"{name[:_MAX_CHARACTERS]}\" is not supported")

    def _call_many(self, calls: list[object]) -> Steps[list[object]]:
        answers = []
        for call in calls:
            answers.append((yield from self._call_one_of_many(call)))
            yield None
        return answers

    def _call_one_of_many(self, call: object) -> Steps[object]:
        match call:
            case {"methodName": "system.multicall"}:
                return _fault("system.multicall inside itself")
            case {"methodName": str(name), "params": list(args)}:
                try:
                    answer = self.dispatch(name, args)
                    return [(yield from answer) if isinstance(answer, Generator) else answer]
                except RpcFault as fault:
                    return {"faultCode": fault.code, "faultString": fault.text}
            case _:
                return _fault("a call is a struct of methodName and params")


def _fault(text: str) -> dict[str, object]:
    return {"faultCode": 1, "faultString": text}


# --- parameter types


def anything(value: object, name: str, caller_id: str) -> object:
    """Return the value unchanged; any value is valid."""
    return value


def some(value: object, name: str, caller_id: str) -> object:
    """Return the value unchanged. Raise CallRefused if it is false, such as 0, None or an empty string."""
    if not value:
        raise CallRefused(f"ERROR: parameter [{name}] must be specified and non-empty")
    return value


def text(value: object, name: str, caller_id: str) -> str:
    """Return a non-empty string."""
    if not isinstance(value, str) or not value:
        raise CallRefused(f"ERROR: parameter [{name}] must be a non-empty string")
    return value


def global_name(value: object, name: str, caller_id: str) -> str:
    """Return a topic or service name, resolved relative to the caller."""
    resolved = node_name(value, name, caller_id)
    if resolved == "/":
        raise CallRefused(f"ERROR: parameter [{name}] cannot be the global namespace")
    return resolved


def node_name(value: object, name: str, caller_id: str) -> str:
    """Return a node name, resolved relative to the caller."""
    found = _short_text(value, name)
    # Accept most illegal names, as rosmaster does, because many robots have topics with a dash.
    if ":" in found or " " in found or has_controls(found):
        raise CallRefused(f"ERROR: parameter [{name}] contains illegal chars")
    return _resolve(found, caller_id)


def parameter_key(value: object, name: str, caller_id: str) -> str:
    """Return a parameter name, resolved relative to the caller. Like rosmaster, allow any characters."""
    return _resolve(plain_key(value, name, caller_id), caller_id)


def plain_key(value: object, name: str, caller_id: str) -> str:
    """Return a parameter name without resolving it."""
    if not isinstance(some(value, name, caller_id), str):
        raise CallRefused(f"ERROR: parameter [{name}] must be a string")
    return _short_text(value, name)


def type_name(value: object, name: str, caller_id: str) -> str:
    """Return a type ``pkg/Name``, or ``*``."""
    found = _short_text(value, name)
    if found != "*" and (found.count("/") != 1 or has_controls(found)):
        raise CallRefused(f"ERROR: parameter [{name}] is not a valid package resource name")
    return found


def api_uri(value: object, name: str, caller_id: str) -> str:
    """Return the URI of a node's API or a service."""
    if not isinstance(value, str) or not value:
        raise CallRefused(f"ERROR: parameter [{name}] is not an XMLRPC URI")
    found = _short_text(value, name)
    if not found.startswith(("http://", "rosrpc://")):
        raise CallRefused(f"ERROR: parameter [{name}] is not an RPC URI")
    if " " in found or has_controls(found):
        # Reject control characters, because the URI is used in requests and in log lines.
        raise CallRefused(f"ERROR: parameter [{name}] contains illegal chars")
    return found


def subgraph(value: object, name: str, caller_id: str) -> str:
    """Return a namespace, resolved relative to the caller; "" is the whole graph."""
    if not isinstance(value, str):
        raise CallRefused(f"ERROR: parameter [{name}] must be a string")
    return names.resolve(_short_text(value, name), caller_id) if value else ""


def global_key(value: object, name: str, caller_id: str) -> str:
    """Return a parameter's name, which must be global."""
    found = text(value, name, caller_id)
    if found[0] != "/":
        raise CallRefused(f"ERROR: parameter [{name}] must be a globally referenced name")
    return found


def uris(value: object, name: str, caller_id: str) -> list[str]:
    """Return a list of URIs."""
    if not isinstance(value, list):
        raise CallRefused(f"ERROR: param [{name}] must be a list")
    if len(value) > _MAX_URIS:
        raise CallRefused(f"ERROR: param [{name}] has more than {_MAX_URIS} URIs")
    if not all(isinstance(uri, str) for uri in value):
        raise CallRefused(f"ERROR: param [{name}] must be a list of strings")
    for uri in value:
        scheme, separator, rest = uri.partition("://")
        if not (scheme and separator and rest.partition("/")[0]):
            raise CallRefused(f"ERROR: param [{name}] does not contain valid URLs [{uri}]")
    return value


def _short_text(value: object, name: str) -> str:
    if not isinstance(value, str) or not value:
        raise CallRefused(f"ERROR: parameter [{name}] must be a non-empty string")
    if len(value) > _MAX_CHARACTERS:
        raise CallRefused(f"ERROR: parameter [{name}] has more than {_MAX_CHARACTERS} characters")
    return value


def _resolve(name: str, caller_id: str) -> str:
    if name[0] == "/" and name[-1] != "/" and "//" not in name:
        return name
    return names.resolve(name, caller_id)


def parameters(**readers: Callable[[object, str, str], object]) -> tuple[Parameter, ...]:
    """Return a method's parameters. Each keyword is a parameter's name; its value is the parameter's reader."""
    return tuple(Parameter(name, read) for name, read in readers.items())
