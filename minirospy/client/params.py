"""rospy's parameter server functions. Source: http://wiki.ros.org/rospy/Overview/Parameter%20Server."""

from __future__ import annotations

import copy
import functools
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeGuard, TypeVar

from minirospy.base.errors import MasterUnreachableError, ROSException, RpcError, RpcRefused
from minirospy.base.notes import noted
from minirospy.client.identity import warn_of_illegal_name
from minirospy.client.session import current_session
from minirospy.core.graph.parameter_cache import NOT_SET
from minirospy.core.wire.xmlrpc_writer import is_numpy

if TYPE_CHECKING:
    import datetime

__all__ = [
    "UNSPECIFIED",
    "KeptParameters",
    "Unspecified",
    "as_xmlrpc_client",
    "delete_param",
    "get_param",
    "get_param_cached",
    "get_param_names",
    "get_param_server_cache",
    "has_param",
    "search_param",
    "set_param",
]

_NOT_XML = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")
_T = TypeVar("_T")


class Unspecified:
    """The type of the sentinel for "no default given"; None cannot be used, because it is a valid default."""


UNSPECIFIED = Unspecified()


class MasterGoneError(ROSException, ConnectionRefusedError):
    """The master does not respond. rospy raises the socket error, so programs may catch either exception."""

    def __str__(self) -> str:
        return str(self.args[0])


def get_param(param_name: str, default: object = UNSPECIFIED) -> Any:
    """Return a parameter's value, or ``default`` if it is not set.

    As in rospy, bytes and dates are returned as xmlrpc.client.Binary and DateTime.
    Raise KeyError if the parameter is not set and there is no default, ROSException if the master fails.
    """
    value = _get(current_session().resolve(param_name)) if _may_be_name(param_name) else NOT_SET
    if value is not NOT_SET:
        return as_xmlrpc_client(value)
    if default is UNSPECIFIED:
        raise noted(
            KeyError(param_name), f"it is not set; a default: rospy.get_param({param_name!r}, DEFAULT)"
        )
    return default


def get_param_cached(param_name: str, default: object = UNSPECIFIED) -> Any:
    """Return a parameter's value from a cache that the master keeps up to date. Before init_node, query the master."""
    name = current_session().resolve(param_name)
    cache, node = current_session().parameters, current_session().node
    if node is None or current_session().is_shutdown():
        return get_param(param_name, default)

    try:
        value = cache.get(name)
    except LookupError:
        changes = cache.changes
        if name not in node.parameters:
            _ask("get", name, lambda: current_session().master.subscribe_param(node.uri, name))
            node.parameters.add(name)
        value = _get(name)
        with current_session().lock:
            cache.store(name, value, changes)

    if value is not NOT_SET:
        return as_xmlrpc_client(copy.deepcopy(value))
    if default is UNSPECIFIED:
        raise KeyError(param_name)
    return default


def set_param(param_name: str, param_value: object) -> None:
    """Set a parameter; a dictionary sets a whole namespace. Numpy numbers and arrays are sent as numbers and lists.

    Raise TypeError, OverflowError or ValueError if XML-RPC cannot represent a value, ROSException if the master fails.
    """
    name = current_session().resolve(param_name)
    warn_of_illegal_name(param_name)
    try:
        _ask("set", name, lambda: current_session().master.set_param(name, param_value))
    except ROSException:
        check_sendable(param_value)
        raise
    # Discard the cached value here: the master notifies other nodes, but not the node that sets the parameter.
    current_session().parameter_changed(name)


def has_param(param_name: str) -> bool:
    """Return whether a parameter or a namespace with that name is set. Raise ROSException if the master fails."""
    if not _may_be_name(param_name):
        return False
    name = current_session().resolve(param_name)
    return _ask("look for", name, lambda: current_session().master.has_param(name))


def delete_param(param_name: str) -> None:
    """Delete a parameter. Raise KeyError if it is not set, ROSException if the master fails."""
    if not _may_be_name(param_name):
        raise KeyError(param_name)
    name = current_session().resolve(param_name)
    try:
        _ask("delete", name, lambda: current_session().master.delete_param(name))
    except ROSException as error:
        if isinstance(error.__cause__, RpcRefused):
            raise KeyError(param_name) from error
        raise
    current_session().parameter_changed(name)


def search_param(param_name: str) -> str | None:
    """Search for a parameter from this node's namespace upwards; return the full name of the first match, or None.

    Raise ROSException if the master fails, or the name is private.
    """
    name = current_session().identity.mappings.get(param_name, param_name)
    check_sendable(name)
    try:
        return str(_ask("search", name, lambda: current_session().master.call("searchParam", name)))
    except ROSException as error:
        why = error.__cause__
        if isinstance(why, RpcRefused):
            if why.code == -1:
                return None
            raise ROSException(f"cannot search for parameter: {why.text}") from why
        raise


def get_param_names() -> list[str]:
    """Return the names of all parameters. Raise ROSException if the master fails."""
    return _ask("list", "/", current_session().master.get_param_names)


class KeptParameters:
    """The cache that get_param_cached uses, for programs that read it or need notifications of changes.

    Such a program may replace :meth:`update` with its own function.
    """

    def __init__(self) -> None:
        self._notifier: Callable[[str, object], object] | None = None
        current_session().parameter_listeners.append(self._dispatch)

    def get(self, key: str) -> Any:
        """Return a parameter's cached value. Raise KeyError if get_param_cached has not read it before."""
        session = current_session()
        if session.node is None or session.resolve(key) not in session.node.parameters:
            raise KeyError(key)
        return get_param_cached(key)

    def set_notifier(self, notifier: Callable[[str, object], object] | None) -> None:
        """Call ``notifier(key, value)`` when the master reports a change. The value of a deleted parameter is {}."""
        self._notifier = notifier

    def update(self, key: str, value: object) -> None:
        """Handle a change reported by the master."""
        if self._notifier:
            self._notifier(key, value)

    def _dispatch(self, key: str, value: object) -> None:
        self.update(key, value)


@functools.cache
def get_param_server_cache() -> KeptParameters:
    """Return this process's parameter cache."""
    return KeptParameters()


def _get(name: str) -> object:
    """Return the value of the parameter ``name``, or NOT_SET."""
    try:
        return _ask("get", name, lambda: current_session().master.get_param(name))
    except ROSException as error:
        if isinstance(error.__cause__, RpcRefused):
            return NOT_SET
        raise


def _may_be_name(param_name: object) -> bool:
    """Return whether the value can be a parameter name: a string, or None for the node's namespace."""
    return param_name is None or isinstance(param_name, str)


def _ask(verb: str, name: str, call: Callable[[], _T]) -> _T:
    try:
        return call()
    except MasterUnreachableError as error:
        raise MasterGoneError(f"unable to {verb} parameter [{name}]: {error}") from error
    except RpcError as error:
        raise ROSException(f"unable to {verb} parameter [{name}]: {error}") from error


def as_xmlrpc_client(value: object) -> object:
    """Return a value with its bytes and dates wrapped in xmlrpc.client's classes, as from Python's own XML-RPC client."""
    if isinstance(value, dict):
        return {key: as_xmlrpc_client(item) for key, item in value.items()}
    if isinstance(value, list):
        return [as_xmlrpc_client(item) for item in value]
    if isinstance(value, bytes) or _is_date(value):
        # Imported here, because http.client and its imports take longer to load than the rest of this module.
        import xmlrpc.client

        return xmlrpc.client.Binary(value) if isinstance(value, bytes) else xmlrpc.client.DateTime(value)
    return value


def check_sendable(value: object) -> None:
    """Raise the same exception as rospy if XML-RPC has no type for a value, ValueError if XML lacks a character in it."""
    if value is None:
        raise TypeError("cannot marshal None unless allow_none is enabled")

    if isinstance(value, int):
        if not -(2**31) <= value < 2**31:
            raise OverflowError("int exceeds XML-RPC limits")
    elif isinstance(value, str):
        found = _NOT_XML.search(value)
        if found:
            raise ValueError(f"{value!r} cannot be sent: XML has no character {found[0]!r}")
    elif isinstance(value, dict):
        for key, item in value.items():
            if not isinstance(key, str):
                raise TypeError("dictionary key must be string")
            check_sendable(key)
            check_sendable(item)
    elif isinstance(value, list | tuple):
        for item in value:
            check_sendable(item)
    elif is_numpy(value):
        check_sendable(value.tolist())  # type: ignore[attr-defined]
    elif not (isinstance(value, float | bytes | bytearray) or _is_date(value) or _is_wrapper(value)):
        raise TypeError(f"cannot marshal {type(value)} objects")


def _is_date(value: object) -> TypeGuard[datetime.datetime]:
    import datetime

    return isinstance(value, datetime.datetime)


def _is_wrapper(value: object) -> bool:
    return type(value).__module__ == "xmlrpc.client"
