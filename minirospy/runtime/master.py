"""The master: the Master API and the Parameter Server API over XML-RPC, and the calls that follow from them.

The tables are in ``minirospy.graph``; here stand the checks of arguments, the ``[status code, text, value]``
answers, and the sending of updates. Source: http://wiki.ros.org/ROS/Master_API.
"""

from __future__ import annotations

import asyncio
import logging
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from minirospy import names
from minirospy.errors import RpcError, RpcFault
from minirospy.graph.parameters import ParameterTree, ParameterUpdate
from minirospy.graph.registry import Action, NodeShutdown, PublisherUpdate, Registry
from minirospy.runtime.rpc_async import AsyncRpcClient
from minirospy.runtime.rpc_server import RpcServer

__all__ = ["Master"]

_log = logging.getLogger(__name__)

_SUCCESS, _FAILURE, _ERROR = 1, 0, -1
_MASTER = "/master"
_NOTIFY_SECONDS = 3.0
_CALLS_AT_ONCE = 200

Answer = list[Any]
_Notice = PublisherUpdate | NodeShutdown | ParameterUpdate


class _Refusal(Exception):
    """An argument is not acceptable; the text is the answer's."""


class Master:
    """A ROS master at ``http://host:port/``, listening on ``bind_host``; port 0 takes a free one."""

    def __init__(self, *, host: str = "localhost", bind_host: str = "127.0.0.1", port: int = 0) -> None:
        self.host = host
        self.registry = Registry()
        self.parameters = ParameterTree()
        self._server = RpcServer(self.dispatch, bind_host=bind_host, port=port)
        self._notifier = _Notifier()
        self._methods: dict[str, tuple[Callable[..., Answer], Any]] = {
            # Name on the wire -> (method, the value of an answer that refuses).
            "getPid": (self.get_pid, -1),
            "getUri": (self.get_uri, ""),
            "shutdown": (self.shutdown, 0),
            "lookupNode": (self.lookup_node, ""),
            "lookupService": (self.lookup_service, ""),
            "getSystemState": (self.get_system_state, [[], [], []]),
            "getTopicTypes": (self.get_topic_types, []),
            "getPublishedTopics": (self.get_published_topics, []),
            "registerPublisher": (self.register_publisher, []),
            "unregisterPublisher": (self.unregister_publisher, 0),
            "registerSubscriber": (self.register_subscriber, []),
            "unregisterSubscriber": (self.unregister_subscriber, 0),
            "registerService": (self.register_service, 0),
            "unregisterService": (self.unregister_service, 0),
            "getParam": (self.get_param, 0),
            "setParam": (self.set_param, 0),
            "hasParam": (self.has_param, False),
            "deleteParam": (self.delete_param, 0),
            "searchParam": (self.search_param, 0),
            "getParamNames": (self.get_param_names, []),
            "subscribeParam": (self.subscribe_param, 0),
            "unsubscribeParam": (self.unsubscribe_param, 0),
        }
        self.stopped = asyncio.Event()
        """Set when somebody asked the master to stop."""

    @property
    def port(self) -> int:
        """The port that it listens on."""
        return self._server.port

    @property
    def uri(self) -> str:
        """What ROS_MASTER_URI has to say."""
        return f"http://{self.host}:{self.port}/"

    async def start(self) -> None:
        """Listen. Raises OSError."""
        await self._server.start()

    async def close(self) -> None:
        """Stop. Idempotent."""
        await self._server.close()
        await self._notifier.close()

    def dispatch(self, method: str, args: Sequence[Any]) -> Any:
        """The answer to one call. Raises RpcFault on a method that is not there."""
        if method == "system.listMethods":
            return sorted(self._methods)
        if method == "system.multicall":
            return [self._one_of_many(call) for call in (args[0] if args else [])]
        entry = self._methods.get(method)
        if entry is None:
            raise RpcFault(1, f'method "{method}" is not supported')
        function, refused = entry
        if not args:
            return [_ERROR, "missing required caller_id parameter", refused]
        if not isinstance(args[0], str):
            return [_ERROR, "caller_id must be a string", refused]
        if len(args) != function.__code__.co_argcount - 1 and not _has_defaults(function, len(args)):
            return [_ERROR, "Error: bad call arity", refused]
        try:
            return function(*args)
        except _Refusal as refusal:
            return [_ERROR, str(refusal), refused]

    # --- about the master

    def get_pid(self, caller_id: str) -> Answer:
        """The master's process id."""
        return [_SUCCESS, "", os.getpid()]

    def get_uri(self, caller_id: str) -> Answer:
        """The master's URI."""
        return [_SUCCESS, "", self.uri]

    def shutdown(self, caller_id: str, msg: str = "") -> Answer:
        """Stop the master."""
        _log.info("shutdown request from %s: %s", caller_id, msg)
        self.stopped.set()
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
        self._act(actions)
        _log.info("+PUB [%s] %s %s", topic, caller_id, uri)
        return [_SUCCESS, f"Registered [{caller_id}] as publisher of [{topic}]", peers]

    def unregister_publisher(self, caller_id: str, topic: Any, caller_api: Any) -> Answer:
        """A node publishes a topic no more."""
        topic, uri = _name(topic, "topic", caller_id), _uri(caller_api, "caller_api")
        gone = self.registry.unregister_publisher(caller_id, topic, uri)
        if gone:
            self._act(gone.actions)
            _log.info("-PUB [%s] %s %s", topic, caller_id, uri)
        return self._unregistered(caller_id, topic, gone is not None)

    def register_subscriber(self, caller_id: str, topic: Any, topic_type: Any, caller_api: Any) -> Answer:
        """A node subscribes to a topic; the URIs of its publishers."""
        topic = _name(topic, "topic", caller_id)
        type_, uri = _type(topic_type, "topic_type"), _uri(caller_api, "caller_api")
        peers, actions = self.registry.register_subscriber(caller_id, topic, type_, uri)
        self._act(actions)
        _log.info("+SUB [%s] %s %s", topic, caller_id, uri)
        return [_SUCCESS, f"Subscribed to [{topic}]", peers]

    def unregister_subscriber(self, caller_id: str, topic: Any, caller_api: Any) -> Answer:
        """A node subscribes to a topic no more."""
        topic, uri = _name(topic, "topic", caller_id), _uri(caller_api, "caller_api")
        gone = self.registry.unregister_subscriber(caller_id, topic, uri)
        if gone:
            _log.info("-SUB [%s] %s %s", topic, caller_id, uri)
        return self._unregistered(caller_id, topic, gone)

    def register_service(self, caller_id: str, service: Any, service_api: Any, caller_api: Any) -> Answer:
        """A node offers a service."""
        service = _name(service, "service", caller_id)
        service_uri, uri = _uri(service_api, "service_api"), _uri(caller_api, "caller_api")
        self._act(self.registry.register_service(caller_id, service, service_uri, uri))
        _log.info("+SERVICE [%s] %s %s", service, caller_id, uri)
        return [_SUCCESS, f"Registered [{caller_id}] as provider of [{service}]", 1]

    def unregister_service(self, caller_id: str, service: Any, service_api: Any) -> Answer:
        """A node offers a service no more."""
        service, uri = _name(service, "service", caller_id), _uri(service_api, "service_api")
        if self.registry.unregister_service(caller_id, service, uri):
            _log.info("-SERVICE [%s] %s %s", service, caller_id, uri)
            return [_SUCCESS, f"Unregistered [{caller_id}] as provider of [{service}]", 1]
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
            updates = self.parameters.set(name, value, caller_id)
        except ValueError as error:
            raise _Refusal(f"Error: invalid arguments: {error}") from error
        self._act(updates)
        _log.debug("+PARAM [%s] by %s", name, caller_id)
        return [_SUCCESS, f"parameter {name} set", 0]

    def has_param(self, caller_id: str, key: Any) -> Answer:
        """Whether a parameter is set."""
        name = _key(key, caller_id)
        return [_SUCCESS, name, self.parameters.has(name)]

    def delete_param(self, caller_id: str, key: Any) -> Answer:
        """Delete a parameter."""
        name = _key(key, caller_id)
        try:
            self._act(self.parameters.delete(name, caller_id))
        except KeyError:
            return [_ERROR, f"parameter [{name}] is not set", 0]
        _log.debug("-PARAM [%s] by %s", name, caller_id)
        return [_SUCCESS, f"parameter {name} deleted", 0]

    def search_param(self, caller_id: str, key: Any) -> Answer:
        """The nearest parameter of a name, upwards from the caller's namespace."""
        if not isinstance(key, str) or not key:
            raise _Refusal("ERROR: parameter [key] must be specified and non-empty")
        if not caller_id.startswith("/"):
            return [_FAILURE, "Internal failure: namespace must be global", 0]
        if key.startswith("~"):
            return [_FAILURE, "Internal failure: invalid key", 0]
        found = self.parameters.search(caller_id, key)
        if found is None:
            return [_ERROR, f"Cannot find parameter [{key}] in an upwards search", ""]
        return [_SUCCESS, f"Found [{found}]", found]

    def get_param_names(self, caller_id: str) -> Answer:
        """The names of all parameters."""
        return [_SUCCESS, "Parameter names", self.parameters.names()]

    def subscribe_param(self, caller_id: str, caller_api: Any, key: Any) -> Answer:
        """Tell a node of changes of a parameter; its value now."""
        name, uri = _key(key, caller_id), _uri(caller_api, "caller_api")
        value = self.parameters.subscribe(name, caller_id, uri)
        return [_SUCCESS, f"Subscribed to parameter [{name}]", value]

    def unsubscribe_param(self, caller_id: str, caller_api: Any, key: Any) -> Answer:
        """Tell it no more."""
        name, uri = _key(key, caller_id), _uri(caller_api, "caller_api")
        self.parameters.unsubscribe(name, caller_id, uri)
        return [_SUCCESS, f"Unsubscribe to parameter [{name}]", 1]

    # --- helpers

    def _unregistered(self, caller_id: str, topic: str, gone: bool) -> Answer:
        if gone:
            return [_SUCCESS, f"Unregistered [{caller_id}] as provider of [{topic}]", 1]
        if self.registry.node_uri(caller_id) is None:
            return [_SUCCESS, f"[{caller_id}] is not a registered node", 0]
        return [_SUCCESS, f"[{caller_id}] is not a known provider of [{topic}]", 0]

    def _act(self, actions: Iterable[Action | ParameterUpdate]) -> None:
        for action in actions:
            if isinstance(action, NodeShutdown):
                self.parameters.unsubscribe_all(action.uri)
                _log.warning("another node took the name %s: %s is told to stop", action.name, action.uri)
            self._notifier.send(action)

    def _one_of_many(self, call: Any) -> Any:
        try:
            return [self.dispatch(call["methodName"], call["params"])]
        except RpcFault as fault:
            return {"faultCode": fault.code, "faultString": fault.text}
        except (KeyError, TypeError):
            return {"faultCode": 1, "faultString": "a call is a struct of methodName and params"}


class _Notifier:
    """Calls the nodes: in order for each, side by side for all, so that a dead one delays nobody.

    Of a topic's publishers only the newest list waits: an older one is of no use to anybody.
    """

    def __init__(self) -> None:
        self._rpc = AsyncRpcClient()
        self._waiting: dict[str, dict[object, _Notice]] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._slots = asyncio.Semaphore(_CALLS_AT_ONCE)

    def send(self, notice: _Notice) -> None:
        """Call the node that the notice is for, soon."""
        waiting = self._waiting.get(notice.uri)
        if waiting is None:
            waiting = self._waiting[notice.uri] = {}
            task = asyncio.get_running_loop().create_task(self._serve(notice.uri, waiting))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)
        # Keyed so that a newer list replaces the older, in its place.
        key = notice.topic if isinstance(notice, PublisherUpdate) else object()
        waiting[key] = notice

    async def close(self) -> None:
        """Give up what waits."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await self._rpc.close()

    async def _serve(self, uri: str, waiting: dict[object, _Notice]) -> None:
        try:
            while waiting:
                notice = waiting.pop(next(iter(waiting)))
                async with self._slots:
                    await self._call(uri, notice)
        finally:
            del self._waiting[uri]

    async def _call(self, uri: str, notice: _Notice) -> None:
        match notice:
            case PublisherUpdate():
                args: tuple[Any, ...] = ("publisherUpdate", _MASTER, notice.topic, list(notice.publishers))
            case ParameterUpdate():
                args = ("paramUpdate", _MASTER, notice.key, notice.value)
            case NodeShutdown():
                args = ("shutdown", _MASTER, f"[{notice.name}] Reason: {notice.reason}")
        try:
            await self._rpc.call(uri, *args, timeout=_NOTIFY_SECONDS)
        except RpcError as error:
            _log.info("%s to %s: %s", args[0], uri, error)


def _has_defaults(function: Callable[..., Answer], count: int) -> bool:
    most = function.__code__.co_argcount - 1
    return most - len(getattr(function, "__defaults__", None) or ()) <= count <= most


def _rows(table: Mapping[str, Any]) -> list[list[Any]]:
    return [[name, value] for name, value in table.items()]


def _name(value: Any, what: str, caller_id: str) -> str:
    """A graph resource name, resolved as the caller sees it."""
    if not isinstance(value, str) or not value:
        raise _Refusal(f"ERROR: parameter [{what}] must be a non-empty string")
    if not names.is_legal_name(names.canonicalize(value)):
        raise _Refusal(f"ERROR: parameter [{what}] contains illegal chars")
    return names.resolve(value, caller_id)


def _key(value: Any, caller_id: str) -> str:
    """A parameter's name, resolved; rosmaster lets any characters in."""
    if not isinstance(value, str):
        raise _Refusal("ERROR: parameter [key] must be a string")
    if not value:
        raise _Refusal("ERROR: parameter [key] must be specified and non-empty")
    return names.resolve(value, caller_id)


def _type(value: Any, what: str) -> str:
    """A type ``pkg/Name``, or ``*``."""
    if not isinstance(value, str) or not value:
        raise _Refusal(f"ERROR: parameter [{what}] must be a non-empty string")
    if value != "*" and (value.count("/") != 1 or " " in value):
        raise _Refusal(f"ERROR: parameter [{what}] is not a valid package resource name")
    return value


def _uri(value: Any, what: str) -> str:
    if not isinstance(value, str) or "://" not in value:
        raise _Refusal(f"ERROR: parameter [{what}] is not an RPC URI")
    return value
