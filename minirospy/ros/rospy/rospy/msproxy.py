"""The master proxy that rospy.get_master() returns: the Master API with unchanged results, and parameters like a dict.

Source: http://wiki.ros.org/ROS/Master_API and the behaviour of rospy.msproxy.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from minirospy.base.errors import ROSException, RpcFault, RpcUnreachable
from minirospy.client.params import as_xmlrpc_client, check_sendable, get_param_cached
from minirospy.client.session import current_session
from minirospy.runtime.rpc.client import RpcClient

__all__ = ["MasterProxy", "_master_arg_remap"]

_master_arg_remap = {
    method: [0]
    for method in (
        "deleteParam",
        "getParam",
        "getPublishedTopics",
        "hasParam",
        "lookupNode",
        "lookupService",
        "registerPublisher",
        "registerService",
        "registerSubscriber",
        "searchParam",
        "setParam",
        "subscribeParam",
        "unregisterPublisher",
        "unregisterService",
        "unregisterSubscriber",
        "unsubscribeParam",
    )
}
"""Positions of the arguments that are graph resource names, keyed by method. The caller's name is not counted."""


class ServerProxy:
    """A proxy for an XML-RPC server, with the server's methods as attributes.

    As in xmlrpc.client, calls raise OSError (ConnectionRefusedError, TimeoutError) if the server is unreachable, and
    xmlrpc.client.Fault if the server returns a fault. Thread-safe.
    """

    def __init__(self, uri: str) -> None:
        self._uri = uri
        self._client = RpcClient(uri, same_host=current_session().identity.environment.same_host)

    def __getattr__(self, name: str) -> Callable[..., Any]:
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *args: self._call(name, args)

    def __repr__(self) -> str:
        return f"<ServerProxy for {self._uri}>"

    def _call(self, method: str, args: tuple[object, ...]) -> object:
        try:
            return as_xmlrpc_client(self._client.call(method, *args))
        except RpcUnreachable as error:
            if isinstance(error.__cause__, OSError):
                raise error.__cause__ from error
            raise ConnectionError(str(error)) from error
        except RpcFault as error:
            from xmlrpc.client import Fault

            raise Fault(error.code, error.text) from error


class MasterProxy:
    """A proxy for the master at ``uri``. Passes this node's name as the first argument, and resolves names.

    Results are ``[status code, text, value]``: ``code, _, uri = rospy.get_master().lookupNode("talker")``.
    ``proxy[key]``, ``proxy[key] = value``, ``del proxy[key]`` (KeyError), ``key in proxy`` and iteration
    access the parameters. A program may replace ``target``. Calls raise the same errors as :class:`ServerProxy`, and
    ROSException if the master rejects a call about parameters.
    """

    def __init__(self, uri: str) -> None:
        self.target = ServerProxy(uri)

    def __getattr__(self, name: str) -> Callable[..., Any]:
        if name.startswith("__"):
            raise AttributeError(name)
        method = getattr(self.target, name)

        def call(*args: Any) -> Any:
            positions = _master_arg_remap.get(name)
            if positions:
                resolve = current_session().resolve
                args = tuple(resolve(each) if at in positions else each for at, each in enumerate(args))
            return method(current_session().name, *args)

        return call

    def __getitem__(self, key: str) -> Any:
        code, _, value = self.getParam(key)
        if code != 1:
            raise KeyError(key)
        return value

    def __setitem__(self, key: str, val: object) -> None:
        self.setParam(key, val)

    def __delitem__(self, key: str) -> None:
        if self.deleteParam(key)[0] != 1:
            raise KeyError(key)

    def __contains__(self, key: str) -> bool:
        code, text, value = self.hasParam(key)
        if code != 1:
            raise ROSException(f"cannot check parameter on server: {text}")
        return bool(value)

    def __iter__(self) -> Iterator[str]:
        code, text, value = self.getParamNames()
        if code != 1:
            raise ROSException(f"cannot retrieve parameter names: {text}")
        return iter(value)

    def search_param(self, key: str) -> str | None:
        """Search for a parameter in this node's namespace and its parents. Return the closest match's name, or None."""
        check_sendable(key)
        code, _, value = self.target.searchParam(current_session().name, key)
        return value if code == 1 else None

    def get_param_cached(self, key: str) -> Any:
        """Return a parameter's value from this node's cache. Raise KeyError if it is not set."""
        return get_param_cached(key)


def get_master(env: Mapping[str, str] = os.environ) -> MasterProxy:
    """Return this node's master, or the one at the ROS_MASTER_URI in ``env`` if that is not os.environ."""
    uri = env.get("ROS_MASTER_URI") if isinstance(env, dict) else None
    return _master(uri or current_session().identity.environment.master_uri, os.getpid())


def xmlrpcapi(uri: str | None, cache: bool = True) -> ServerProxy | None:
    """Return the proxy for the XML-RPC server at ``uri`` (always the same object), or None if ``uri`` is invalid."""
    if not uri or not uri.startswith(("http://", "rosrpc://")):
        return None
    return _server(uri, os.getpid()) if cache else ServerProxy(uri)


# Cache the proxy per process: a forked child must not use its parent's connections.
@functools.cache
def _master(uri: str, pid: int) -> MasterProxy:
    return MasterProxy(uri)


@functools.cache
def _server(uri: str, pid: int) -> ServerProxy:
    return ServerProxy(uri)
