"""The Master API for Python programs: blocking calls that return lists as in ROS. Source: http://wiki.ros.org/ROS/Master_API."""

# mypy: disable-error-code="no-any-return"
# The annotations state what a master should return;
# values are returned unchecked, because a program may replace the master.

from __future__ import annotations

import weakref
from functools import cached_property
from typing import Any

from minirospy.base.errors import MasterUnreachableError, RpcError, RpcRefused
from minirospy.client.params import as_xmlrpc_client, check_sendable
from minirospy.ros.rosgraph.rosgraph.names import make_caller_id as make_caller_id
from minirospy.ros.rosgraph.rosgraph.network import parse_http_host_and_port as parse_http_host_and_port
from minirospy.ros.rosgraph.rosgraph.rosenv import get_master_uri
from minirospy.runtime.rpc.master_proxy import MasterProxy

__all__ = [
    "Error",
    "Failure",
    "Master",
    "MasterError",
    "MasterException",
    "MasterFailure",
    "ROSMasterException",
    "get_master_uri",
    "is_online",
]


class MasterException(Exception):
    """Raised if the master is unreachable or returned an error."""


ROSMasterException = MasterException  # an older name for MasterException


class MasterFailure(MasterException):
    """Raised if a call failed on the master."""


class MasterError(MasterException):
    """Raised if the master rejected a call because of an unknown name or a bad argument."""


Error, Failure = MasterError, MasterFailure


class Master:
    """Calls the master at ``master_uri`` (default: from the environment) as node ``caller_id``."""

    def __init__(self, caller_id: str, master_uri: str | None = None) -> None:
        # Like ROS's rosgraph, remove the trailing slash.
        self.caller_id = make_caller_id(caller_id).rstrip("/")
        self._reinit(master_uri or get_master_uri())

    def _reinit(self, master_uri: str) -> None:
        """Use the master at this URI for all later calls."""
        self.master_uri = master_uri
        try:
            parse_http_host_and_port(master_uri)
        except ValueError as error:
            raise ValueError(f"invalid master URI: {master_uri}") from error
        self.__dict__.pop("handle", None)
        self._proxy = MasterProxy(master_uri, self.caller_id)
        # Close the connections on garbage collection, because ROS's Master has no close().
        weakref.finalize(self, self._proxy.close)

    @cached_property
    def handle(self) -> Any:
        """Return the master as an `xmlrpc.client.ServerProxy`, whose methods return (code, text, value).

        From then on, all calls use this proxy, because a program may replace the proxy or one of its methods.
        """
        from xmlrpc.client import ServerProxy

        return ServerProxy(self.master_uri)

    def _call(self, method: str, *args: object) -> Any:
        handle = self.__dict__.get("handle")
        if handle is not None:
            return self._succeed(getattr(handle, method)(self.caller_id, *args))

        check_sendable(args)
        self._proxy.caller_id = self.caller_id
        try:
            return as_xmlrpc_client(self._proxy.call(method, *args))
        except RpcRefused as error:
            raise (MasterError if error.code == -1 else MasterFailure)(error.text) from error
        except MasterUnreachableError as error:
            # Programs that poll for a master expect a socket error.
            raise ConnectionRefusedError(str(error)) from error
        except RpcError as error:
            raise MasterException(str(error)) from error

    def _succeed(self, args: tuple[int, str, Any]) -> Any:
        """Return a response's value. Raise MasterError or MasterFailure if the call failed."""
        code, text, value = args
        if code == 1:
            return value
        raise (MasterError if code == -1 else MasterFailure)(text)

    def is_online(self) -> bool:
        """Return whether the master responds."""
        try:
            self.getPid()
        except Exception:  # noqa: BLE001 - a program's own handle may raise anything
            return False
        return True

    def getPid(self) -> int:
        """Return the master's process ID."""
        return self._call("getPid")

    def getUri(self) -> str:
        """Return the URI that the master reports."""
        return self._call("getUri")

    def getSystemState(self) -> list[list[tuple[str, list[str]]]]:
        """Return [publishers, subscribers, services], each a list of [name, [nodes]]."""
        return self._call("getSystemState")

    def getPublishedTopics(self, subgraph: str) -> list[list[str]]:
        """Return [[topic, type]] for the published topics."""
        return self._call("getPublishedTopics", subgraph)

    def getTopicTypes(self) -> list[list[str]]:
        """Return [[topic, type]] for all topics known to the master."""
        return self._call("getTopicTypes")

    def lookupNode(self, node_name: str) -> str:
        """Return a node's URI."""
        return self._call("lookupNode", node_name)

    def lookupService(self, service: str) -> str:
        """Return a service's URI."""
        return self._call("lookupService", service)

    def getParam(self, key: str) -> Any:
        """Return a parameter's value."""
        return self._call("getParam", key)

    def setParam(self, key: str, value: object) -> int:
        """Set a parameter."""
        return self._call("setParam", key, value)

    def hasParam(self, key: str) -> bool:
        """Return whether a parameter is set."""
        return self._call("hasParam", key)

    def deleteParam(self, key: str) -> int:
        """Delete a parameter."""
        return self._call("deleteParam", key)

    def searchParam(self, key: str) -> str:
        """Search upwards from the caller's namespace for the parameter ``key``; return its full name."""
        return self._call("searchParam", key)

    def getParamNames(self) -> list[str]:
        """Return the names of all parameters."""
        return self._call("getParamNames")

    def subscribeParam(self, caller_api: str, key: str) -> object:
        """Subscribe to a parameter's changes; return its value."""
        return self._call("subscribeParam", caller_api, key)

    def unsubscribeParam(self, caller_api: str, key: str) -> int:
        """Unsubscribe from a parameter's changes."""
        return self._call("unsubscribeParam", caller_api, key)

    def registerPublisher(self, topic: str, topic_type: str, caller_api: str) -> list[str]:
        """Register a publisher; return the subscribers' URIs."""
        return self._call("registerPublisher", topic, topic_type, caller_api)

    def unregisterPublisher(self, topic: str, caller_api: str) -> int:
        """Unregister a publisher."""
        return self._call("unregisterPublisher", topic, caller_api)

    def registerSubscriber(self, topic: str, topic_type: str, caller_api: str) -> list[str]:
        """Register a subscriber; return the publishers' URIs."""
        return self._call("registerSubscriber", topic, topic_type, caller_api)

    def unregisterSubscriber(self, topic: str, caller_api: str) -> int:
        """Unregister a subscriber."""
        return self._call("unregisterSubscriber", topic, caller_api)

    def registerService(self, service: str, service_api: str, caller_api: str) -> int:
        """Register a service."""
        return self._call("registerService", service, service_api, caller_api)

    def unregisterService(self, service: str, service_api: str) -> int:
        """Unregister a service."""
        return self._call("unregisterService", service, service_api)


def is_online(master_uri: str | None = None) -> bool:
    """Return whether a master responds at ``master_uri`` (default: from the environment)."""
    return Master("/rosgraph", master_uri).is_online()
