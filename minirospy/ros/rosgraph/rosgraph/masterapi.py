"""The Master API for Python programs: blocking calls that return lists as in ROS. Source: http://wiki.ros.org/ROS/Master_API."""

from __future__ import annotations

import weakref
from functools import cached_property
from typing import TYPE_CHECKING, Any

from minirospy.base.errors import MasterUnreachableError, RpcError, RpcRefused
from minirospy.client.params import as_xmlrpc_client, check_sendable
from minirospy.ros.rosgraph.rosgraph.names import make_caller_id as make_caller_id
from minirospy.ros.rosgraph.rosgraph.network import parse_http_host_and_port as parse_http_host_and_port
from minirospy.ros.rosgraph.rosgraph.rosenv import get_master_uri
from minirospy.runtime.rpc.master_proxy import MasterProxy

if TYPE_CHECKING:
    from xmlrpc.client import ServerProxy

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
    """The master is unreachable or returned an error."""


ROSMasterException = MasterException  # an older name for MasterException


class MasterFailure(MasterException):
    """The call failed on the master."""


class MasterError(MasterException):
    """The master rejected the call, because of an unknown name or a bad argument."""


Error, Failure = MasterError, MasterFailure


class Master:
    """A proxy for the master at ``master_uri`` (default: from the environment); calls are made as node ``caller_id``."""

    def __init__(self, caller_id: str, master_uri: str | None = None) -> None:
        uri = master_uri or get_master_uri()
        self.master_uri = uri
        try:
            parse_http_host_and_port(uri)
        except ValueError as error:
            raise ValueError(f"invalid master URI: {uri}") from error
        # Remove the trailing slash, as ROS's rosgraph does.
        self.caller_id = make_caller_id(caller_id).rstrip("/")
        self._proxy = MasterProxy(uri, self.caller_id)
        # Close the connections when the object is deleted, because ROS's Master has no close().
        weakref.finalize(self, self._proxy.close)

    def _call(self, method: str, *args: object) -> Any:
        check_sendable(args)
        try:
            return self._proxy.call(method, *args)
        except RpcRefused as error:
            raise (MasterError if error.code == -1 else MasterFailure)(error.text) from error
        except MasterUnreachableError as error:
            # Programs that poll for a master expect a socket error.
            raise ConnectionRefusedError(str(error)) from error
        except RpcError as error:
            raise MasterException(str(error)) from error

    @cached_property
    def handle(self) -> ServerProxy:
        """Return a `xmlrpc.client.ServerProxy` for the master, whose methods return (code, text, value)."""
        from xmlrpc.client import ServerProxy

        return ServerProxy(self.master_uri)

    def _list(self, method: str, *args: object) -> list[str]:
        return list(self._call(method, *args))

    def is_online(self) -> bool:
        """Return whether the master responds."""
        try:
            self.getPid()
        except (OSError, MasterException):
            return False
        return True

    def getPid(self) -> int:
        """Return the master's process ID."""
        return int(self._call("getPid"))

    def getUri(self) -> str:
        """Return the URI that the master reports."""
        return str(self._call("getUri"))

    def getSystemState(self) -> list[list[tuple[str, list[str]]]]:
        """Return [publishers, subscribers, services], each a list of [name, [nodes]]."""
        tables: list[list[tuple[str, list[str]]]] = self._call("getSystemState")
        return tables

    def getPublishedTopics(self, subgraph: str) -> list[list[str]]:
        """Return [[topic, type]] for the published topics."""
        return [list(pair) for pair in self._call("getPublishedTopics", subgraph)]

    def getTopicTypes(self) -> list[list[str]]:
        """Return [[topic, type]] for all topics known to the master."""
        return [list(pair) for pair in self._call("getTopicTypes")]

    def lookupNode(self, node_name: str) -> str:
        """Return a node's URI."""
        return str(self._call("lookupNode", node_name))

    def lookupService(self, service: str) -> str:
        """Return a service's URI."""
        return str(self._call("lookupService", service))

    def getParam(self, key: str) -> Any:
        """Return a parameter's value."""
        return as_xmlrpc_client(self._call("getParam", key))

    def setParam(self, key: str, value: object) -> int:
        """Set a parameter."""
        return int(self._call("setParam", key, value))

    def hasParam(self, key: str) -> bool:
        """Return whether a parameter is set."""
        return bool(self._call("hasParam", key))

    def deleteParam(self, key: str) -> int:
        """Delete a parameter."""
        return int(self._call("deleteParam", key))

    def searchParam(self, key: str) -> str:
        """Return the name of the closest parameter called ``key``, searching upwards from the caller's namespace."""
        return str(self._call("searchParam", key))

    def getParamNames(self) -> list[str]:
        """Return the names of all parameters."""
        return self._list("getParamNames")

    def subscribeParam(self, caller_api: str, key: str) -> object:
        """Subscribe to a parameter's changes; return its value."""
        return as_xmlrpc_client(self._call("subscribeParam", caller_api, key))

    def unsubscribeParam(self, caller_api: str, key: str) -> int:
        """Unsubscribe from a parameter's changes."""
        return int(self._call("unsubscribeParam", caller_api, key))

    def registerPublisher(self, topic: str, topic_type: str, caller_api: str) -> list[str]:
        """Register a publisher; return the subscribers' URIs."""
        return self._list("registerPublisher", topic, topic_type, caller_api)

    def unregisterPublisher(self, topic: str, caller_api: str) -> int:
        """Unregister a publisher."""
        return int(self._call("unregisterPublisher", topic, caller_api))

    def registerSubscriber(self, topic: str, topic_type: str, caller_api: str) -> list[str]:
        """Register a subscriber; return the publishers' URIs."""
        return self._list("registerSubscriber", topic, topic_type, caller_api)

    def unregisterSubscriber(self, topic: str, caller_api: str) -> int:
        """Unregister a subscriber."""
        return int(self._call("unregisterSubscriber", topic, caller_api))

    def registerService(self, service: str, service_api: str, caller_api: str) -> int:
        """Register a service."""
        return int(self._call("registerService", service, service_api, caller_api))

    def unregisterService(self, service: str, service_api: str) -> int:
        """Unregister a service."""
        return int(self._call("unregisterService", service, service_api))


def is_online(master_uri: str | None = None) -> bool:
    """Return whether a master responds at ``master_uri`` (default: from the environment)."""
    return Master("/rosgraph", master_uri).is_online()
