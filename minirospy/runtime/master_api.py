"""The Master API and the Parameter Server API: the checks of arguments, and the ``[status code, text, value]`` answers.

The tables are in ``minirospy.graph``; whom a call makes the master call, and what is written down, goes through
:meth:`MasterApi.act` and :attr:`MasterApi.note`. Source: http://wiki.ros.org/ROS/Master_API; texts and corner cases
are those of real rosmaster (tests/runtime/master_calls.py).
"""

from __future__ import annotations

import logging
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from minirospy import names
from minirospy.errors import RpcFault
from minirospy.escape import escaped, has_controls
from minirospy.graph.parameters import ParameterTree, check_value
from minirospy.graph.registry import Registry
from minirospy.runtime.notifier import PARAMETERS, Notice
from minirospy.wire.xmlrpc import Serialized, serialize_response

__all__ = ["Answer", "MasterApi", "key_of_node"]

_log = logging.getLogger(__name__)

_SUCCESS, _FAILURE, _ERROR = 1, 0, -1

Answer = list[Any]


class _Method(NamedTuple):
    function: Callable[..., Answer]
    fewest: int
    most: int
    refused: Any


class _Refusal(Exception):
    """An argument is not acceptable; the text is the answer's."""


class MasterApi(ABC):
    """One method per call of the API; ``serve`` is what the XML-RPC server calls."""

    def __init__(self) -> None:
        self.registry = Registry()
        self.parameters = ParameterTree()
        self.calls = 0
        self.say: Callable[[str], object] = nothing
        """Gets a line for each registration."""
        self.note: Callable[..., object] = nothing
        """Gets each change, as it is written to the journal."""
        # The answer to getSystemState, and after which change of the registry it was written.
        self._state = (-1, Serialized())
        # Name on the wire -> method, and the value of an answer that refuses.
        self._methods = {
            name: _Method(function, *_arity(function), refused)
            for name, function, refused in (
                ("getPid", self.get_pid, -1),
                ("getUri", self.get_uri, ""),
                ("shutdown", self.shutdown, 0),
                ("lookupNode", self.lookup_node, ""),
                ("lookupService", self.lookup_service, ""),
                ("getSystemState", self.get_system_state, [[], [], []]),
                ("getTopicTypes", self.get_topic_types, []),
                ("getPublishedTopics", self.get_published_topics, 0),
                ("registerPublisher", self.register_publisher, []),
                ("unregisterPublisher", self.unregister_publisher, 0),
                ("registerSubscriber", self.register_subscriber, []),
                ("unregisterSubscriber", self.unregister_subscriber, 0),
                ("registerService", self.register_service, 0),
                ("unregisterService", self.unregister_service, 0),
                ("getParam", self.get_param, 0),
                ("setParam", self.set_param, 0),
                ("hasParam", self.has_param, False),
                ("deleteParam", self.delete_param, 0),
                ("searchParam", self.search_param, 0),
                ("getParamNames", self.get_param_names, []),
                ("subscribeParam", self.subscribe_param, 0),
                ("unsubscribeParam", self.unsubscribe_param, 0),
                ("minirospy.status", self.get_status, {}),
            )
        }

    @property
    @abstractmethod
    def uri(self) -> str:
        """What ROS_MASTER_URI has to say."""

    @abstractmethod
    def act(self, actions: Iterable[Notice]) -> None:
        """Do what a change of the tables asks for."""

    @abstractmethod
    def hold(self, uri: str, topic: str) -> None:
        """The node gets its answer about a topic or PARAMETERS, and is not told of changes at the same moment."""

    @abstractmethod
    def stop(self) -> None:
        """Somebody asked the master to stop."""

    @abstractmethod
    def get_status(self, caller_id: str) -> Answer:
        """How this master is: minirospy's own, for `minirospy master --status`."""

    def serve(self, method: str, args: Sequence[Any]) -> Any:
        """The answer to one call of a client, perhaps as XML already. Raises RpcFault as :meth:`dispatch`."""
        self.calls += 1
        if method == "getSystemState" and len(args) == 1 and isinstance(args[0], str):
            return self._written_state(args[0])
        return self.dispatch(method, args)

    def dispatch(self, method: str, args: Sequence[Any]) -> Any:
        """The answer to one call. Raises RpcFault on a method that is not there."""
        entry = self._methods.get(method)
        if entry is None:
            return self._system(method, args)
        if not args:
            return [_ERROR, "missing required caller_id parameter", entry.refused]
        if not entry.fewest <= len(args) <= entry.most:
            return [_ERROR, "Error: bad call arity", entry.refused]
        if not isinstance(args[0], str):
            return [_ERROR, "caller_id must be a string", entry.refused]
        if has_controls(args[0]):
            return [_ERROR, "caller_id contains illegal chars", entry.refused]
        try:
            return entry.function(*args)
        except _Refusal as refusal:
            return [_ERROR, str(refusal), entry.refused]

    # --- about the master

    def get_pid(self, caller_id: str) -> Answer:
        """The master's process id."""
        return [_SUCCESS, "", os.getpid()]

    def get_uri(self, caller_id: str) -> Answer:
        """The master's URI."""
        return [_SUCCESS, "", self.uri]

    def shutdown(self, caller_id: str, msg: str = "") -> Answer:
        """Stop the master."""
        _log.info("shutdown request from %s: %s", caller_id, escaped(str(msg)))
        self.stop()
        return [_SUCCESS, "shutdown", 0]

    # --- the graph

    def lookup_node(self, caller_id: str, node: Any) -> Answer:
        """The URI of a node's Slave API."""
        node = _name(node, "node", caller_id)
        uri = self.registry.node_uri(node)
        return [_SUCCESS, "node api", uri] if uri else [_ERROR, f"unknown node [{node}]", ""]

    def lookup_service(self, caller_id: str, service: Any) -> Answer:
        """Where a service is called."""
        uri = self.registry.service_uri(_name(service, "service", caller_id))
        return [_SUCCESS, f"rosrpc URI: [{uri}]", uri] if uri else [_ERROR, "no provider", ""]

    def get_system_state(self, caller_id: str) -> Answer:
        """Publishers, subscribers and services, each as [name, nodes]."""
        tables = (self.registry.publishers(), self.registry.subscribers(), self.registry.services())
        return [_SUCCESS, "current system state", [_rows(table) for table in tables]]

    def _written_state(self, caller_id: str) -> Serialized:
        """The same as it is sent: of a large graph it takes long to write, and tools ask for it all the time."""
        if self._state[0] != self.registry.changes:
            state = Serialized(serialize_response(self.get_system_state(caller_id)))
            self._state = (self.registry.changes, state)
        return self._state[1]

    def get_topic_types(self, caller_id: str) -> Answer:
        """[topic, type] of each topic."""
        return [_SUCCESS, "current system state", _rows(self.registry.topic_types())]

    def get_published_topics(self, caller_id: str, subgraph: Any) -> Answer:
        """[topic, type] of each published topic below a namespace."""
        if not isinstance(subgraph, str):
            raise _Refusal("ERROR: parameter [subgraph] must be a string")
        prefix = names.resolve(subgraph, caller_id) if subgraph else ""
        return [_SUCCESS, "current topics", [list(row) for row in self.registry.published_topics(prefix)]]

    def register_publisher(self, caller_id: str, topic: Any, topic_type: Any, caller_api: Any) -> Answer:
        """A node publishes a topic; the URIs of its subscribers."""
        topic = _name(topic, "topic", caller_id)
        type_, uri = _type(topic_type, "topic_type"), _uri(caller_api, "caller_api")
        peers, actions = self.registry.register_publisher(caller_id, topic, type_, uri)
        self.act(actions)
        self.note("+pub", caller_id, topic, type_, uri)
        self.say(f"+PUB [{topic}] {caller_id} {uri}")
        return [_SUCCESS, f"Registered [{caller_id}] as publisher of [{topic}]", peers]

    def unregister_publisher(self, caller_id: str, topic: Any, caller_api: Any) -> Answer:
        """A node publishes a topic no more."""
        topic, uri = _name(topic, "topic", caller_id), _uri(caller_api, "caller_api")
        actions = self.registry.unregister_publisher(caller_id, topic, uri)
        if actions is not None:
            self.act(actions)
            self.note("-pub", caller_id, topic, uri)
            self.say(f"-PUB [{topic}] {caller_id} {uri}")
        return self._unregistered(caller_id, topic, actions is not None)

    def register_subscriber(self, caller_id: str, topic: Any, topic_type: Any, caller_api: Any) -> Answer:
        """A node subscribes to a topic; the URIs of its publishers."""
        topic = _name(topic, "topic", caller_id)
        type_, uri = _type(topic_type, "topic_type"), _uri(caller_api, "caller_api")
        peers, actions = self.registry.register_subscriber(caller_id, topic, type_, uri)
        self.act(actions)
        self.hold(uri, topic)
        self.note("+sub", caller_id, topic, type_, uri)
        self.say(f"+SUB [{topic}] {caller_id} {uri}")
        return [_SUCCESS, f"Subscribed to [{topic}]", peers]

    def unregister_subscriber(self, caller_id: str, topic: Any, caller_api: Any) -> Answer:
        """A node subscribes to a topic no more."""
        topic, uri = _name(topic, "topic", caller_id), _uri(caller_api, "caller_api")
        gone = self.registry.unregister_subscriber(caller_id, topic, uri)
        if gone:
            self.note("-sub", caller_id, topic, uri)
            self.say(f"-SUB [{topic}] {caller_id} {uri}")
        return self._unregistered(caller_id, topic, gone)

    def register_service(self, caller_id: str, service: Any, service_api: Any, caller_api: Any) -> Answer:
        """A node offers a service."""
        service = _name(service, "service", caller_id)
        service_uri, uri = _uri(service_api, "service_api"), _uri(caller_api, "caller_api")
        actions = self.registry.register_service(caller_id, service, service_uri, uri)
        self.act(actions)
        self.note("+srv", caller_id, service, service_uri, uri)
        self.say(f"+SERVICE [{service}] {caller_id} {uri}")
        return [_SUCCESS, f"Registered [{caller_id}] as provider of [{service}]", 1]

    def unregister_service(self, caller_id: str, service: Any, service_api: Any) -> Answer:
        """A node offers a service no more."""
        service, uri = _name(service, "service", caller_id), _uri(service_api, "service_api")
        if self.registry.unregister_service(caller_id, service, uri):
            self.note("-srv", caller_id, service, uri)
            self.say(f"-SERVICE [{service}] {caller_id} {uri}")
            return [_SUCCESS, f"Unregistered [{caller_id}] as provider of [{service}]", 1]
        if self.registry.node_uri(caller_id) is None:
            return [_SUCCESS, f"[{caller_id}] is not a registered node", 0]
        return [_SUCCESS, f"[{uri}] is no longer the current service api handle for [{service}]", 0]

    # --- parameters

    def get_param(self, caller_id: str, key: Any) -> Answer:
        """A parameter's value."""
        name = _key(key, caller_id)
        try:
            return [_SUCCESS, f"Parameter [{name}]", self.parameters.get(name)]
        except KeyError:
            return [_ERROR, f"Parameter [{name}] is not set", 0]

    def set_param(self, caller_id: str, key: Any, value: Any) -> Answer:
        """Set a parameter."""
        name = _key(key, caller_id)
        try:
            check_value(name, value)
            updates = self.parameters.set(name, value, caller_id)
        except ValueError as error:
            raise _Refusal(f"Error: invalid arguments: {error}") from error
        self.act(updates)
        self.note("set", name, value)
        self.say(f"+PARAM [{name}] by {caller_id}")
        return [_SUCCESS, f"parameter {name} set", 0]

    def has_param(self, caller_id: str, key: Any) -> Answer:
        """Whether a parameter is set."""
        name = _key(key, caller_id)
        return [_SUCCESS, name, self.parameters.has(name)]

    def delete_param(self, caller_id: str, key: Any) -> Answer:
        """Delete a parameter."""
        name = _key(key, caller_id)
        try:
            updates = self.parameters.delete(name)
        except KeyError:
            return [_ERROR, f"parameter [{name}] is not set", 0]
        self.act(updates)
        self.note("del", name)
        self.say(f"-PARAM [{name}] by {caller_id}")
        return [_SUCCESS, f"parameter {name} deleted", 0]

    def search_param(self, caller_id: str, key: Any) -> Answer:
        """The nearest parameter of a name, upwards from the caller's namespace."""
        _check_key(key)
        if key.startswith("~"):
            return [_FAILURE, "Internal failure: invalid key", 0]
        if not caller_id.startswith("/"):
            return [_FAILURE, "Internal failure: namespace must be global", 0]
        found = self.parameters.search(caller_id, key)
        if found is None:
            return [_ERROR, f"Cannot find parameter [{key}] in an upwards search", ""]
        return [_SUCCESS, f"Found [{found}]", found]

    def get_param_names(self, caller_id: str) -> Answer:
        """The names of all parameters."""
        return [_SUCCESS, "Parameter names", self.parameters.names()]

    def subscribe_param(self, caller_id: str, caller_api: Any, key: Any) -> Answer:
        """Tell a node of changes of a parameter; its value now."""
        uri, name = _uri(caller_api, "caller_api"), _key(key, caller_id)
        actions = self.registry.register_parameter(caller_id, key_of_node(name), uri)
        value = self.parameters.subscribe(name, caller_id, uri)
        self.act(actions)
        self.hold(uri, PARAMETERS)
        self.note("+par", caller_id, name, uri)
        self.say(f"+CACHEDPARAM [{name}] by {caller_id}")
        return [_SUCCESS, f"Subscribed to parameter [{name}]", value]

    def unsubscribe_param(self, caller_id: str, caller_api: Any, key: Any) -> Answer:
        """Tell it no more."""
        uri, name = _uri(caller_api, "caller_api"), _key(key, caller_id)
        if self.parameters.unsubscribe(name, caller_id, uri):
            self.registry.unregister_parameter(caller_id, key_of_node(name), uri)
            self.note("-par", caller_id, name, uri)
            self.say(f"-CACHEDPARAM [{name}] by {caller_id}")
        return [_SUCCESS, f"Unsubscribe to parameter [{name}]", 1]

    # --- helpers

    def _unregistered(self, caller_id: str, topic: str, gone: bool) -> Answer:
        if gone:
            return [_SUCCESS, f"Unregistered [{caller_id}] as provider of [{topic}]", 1]
        if self.registry.node_uri(caller_id) is None:
            return [_SUCCESS, f"[{caller_id}] is not a registered node", 0]
        return [_SUCCESS, f"[{caller_id}] is not a known provider of [{topic}]", 0]

    def _system(self, method: str, args: Sequence[Any]) -> Any:
        """The methods that XML-RPC servers have: http://xmlrpc-c.sourceforge.net/introspection.html and multicall."""
        if method == "system.listMethods":
            return sorted(self._methods)
        if method == "system.multicall":
            if len(args) != 1 or not isinstance(args[0], list):
                raise RpcFault(1, "system.multicall takes a list of structs of methodName and params")
            return [self._one_of_many(call) for call in args[0]]
        raise RpcFault(1, f"<class 'Exception'>:method \"{method}\" is not supported")

    def _one_of_many(self, call: Any) -> Any:
        match call:
            case {"methodName": "system.multicall"}:
                return {"faultCode": 1, "faultString": "system.multicall inside itself"}
            case {"methodName": str(method), "params": list(params)}:
                try:
                    return [self.dispatch(method, params)]
                except RpcFault as fault:
                    return {"faultCode": fault.code, "faultString": fault.text}
            case _:
                return {"faultCode": 1, "faultString": "a call is a struct of methodName and params"}


def nothing(*_: object) -> None:
    """What stands where a journal or a log would."""


def _arity(function: Callable[..., Answer]) -> tuple[int, int]:
    most = function.__code__.co_argcount - 1
    return most - len(getattr(function, "__defaults__", None) or ()), most


def _rows(table: Mapping[str, Any]) -> list[list[Any]]:
    return [[name, value] for name, value in table.items()]


def _name(value: Any, what: str, caller_id: str) -> str:
    """A graph resource name, resolved as the caller sees it."""
    if not isinstance(value, str) or not value:
        raise _Refusal(f"ERROR: parameter [{what}] must be a non-empty string")
    # rosmaster lets in much that is no legal name: many a robot's topics have a dash.
    if ":" in value or " " in value or has_controls(value):
        raise _Refusal(f"ERROR: parameter [{what}] contains illegal chars")
    resolved = _resolve(value, caller_id)
    if resolved == "/" and what != "node":
        raise _Refusal(f"ERROR: parameter [{what}] cannot be the global namespace")
    return resolved


def _resolve(name: str, caller_id: str) -> str:
    if name[0] == "/" and name[-1] != "/" and "//" not in name:
        return name
    return names.resolve(name, caller_id)


def _check_key(value: Any) -> None:
    if not value:
        raise _Refusal("ERROR: parameter [key] must be specified and non-empty")
    if not isinstance(value, str):
        raise _Refusal("ERROR: parameter [key] must be a string")


def _key(value: Any, caller_id: str) -> str:
    """A parameter's name, resolved; rosmaster lets any characters in."""
    _check_key(value)
    return _resolve(value, caller_id)


def _type(value: Any, what: str) -> str:
    """A type ``pkg/Name``, or ``*``."""
    if not isinstance(value, str) or not value:
        raise _Refusal(f"ERROR: parameter [{what}] must be a non-empty string")
    if value != "*" and (value.count("/") != 1 or has_controls(value)):
        raise _Refusal(f"ERROR: parameter [{what}] is not a valid package resource name")
    return value


def _uri(value: Any, what: str) -> str:
    if not isinstance(value, str) or not value:
        raise _Refusal(f"ERROR: parameter [{what}] is not an XMLRPC URI")
    if not value.startswith(("http://", "rosrpc://")):
        raise _Refusal(f"ERROR: parameter [{what}] is not an RPC URI")
    if " " in value or has_controls(value):
        # It becomes part of the requests to the node, and of lines of logs.
        raise _Refusal(f"ERROR: parameter [{what}] contains illegal chars")
    return value


def key_of_node(key: str) -> str:
    """A parameter's name among a node's entries, where topics and services stand too."""
    return key.rstrip("/") or "/"
