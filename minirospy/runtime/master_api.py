"""The Master API and the Parameter Server API: the checks of arguments, and the ``[status code, text, value]`` answers.

The tables are in ``minirospy.graph``; whom a call makes the master call, and what is written down, goes through
:meth:`MasterApi.act` and :attr:`MasterApi.note`. Source: http://wiki.ros.org/ROS/Master_API; texts and corner cases
are those of real rosmaster (tests/runtime/master_calls.py).
"""

from __future__ import annotations

import logging
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import islice
from typing import Any, NamedTuple

from minirospy import names
from minirospy.errors import RpcFault
from minirospy.escape import escaped, has_controls
from minirospy.graph.parameters import ParametersFullError, ParameterTree, weigh_in_steps
from minirospy.graph.registry import Registry, RegistryFullError
from minirospy.runtime.notifier import PARAMETERS, Notice
from minirospy.steps import ALONE, Steps, finish, is_small
from minirospy.wire.http import MAX_BODY
from minirospy.wire.xmlrpc import Serialized, serialize_response_in_steps

__all__ = ["Answer", "MasterApi", "key_of_node"]

_log = logging.getLogger(__name__)

_SUCCESS, _FAILURE, _ERROR = 1, 0, -1

_MAX_NAME = 4096
"""Characters of a name, a type or a URI."""

_FEW = 200
"""Nodes that may be notified in one step."""

_ROWS = 500
"""Of a table that are collected in one step."""

Answer = list[Any]


_Function = Callable[..., "Answer | Steps[Answer]"]


class _Method(NamedTuple):
    function: _Function
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
        """Receives each change, as it is written to the journal."""
        self.store: Callable[[Any], Steps[int]] = _store_nothing
        """Writes a large value to the journal, and returns the number that a change refers to it by."""
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
    def act(self, action: Notice) -> None:
        """Do what a change of the tables requires."""

    def act_in_steps(self, actions: Iterable[Notice]) -> Steps[None]:
        """Do what a change of the tables requires, which may be much."""
        for number, action in enumerate(actions):
            self.act(action)
            if number % _FEW == _FEW - 1:
                yield None

    @abstractmethod
    def hold(self, uri: str, topic: str) -> None:
        """The node gets its answer about a topic or PARAMETERS, and is not told of changes at the same moment."""

    @abstractmethod
    def stop(self) -> None:
        """Somebody asked the master to stop."""

    @abstractmethod
    def get_status(self, caller_id: str) -> Answer | Steps[Answer]:
        """How this master is: minirospy's own, for `minirospy master --status`."""

    def serve(self, method: str, args: Sequence[Any]) -> Any:
        """Return the answer to one call of a client, perhaps as XML already. Raises RpcFault as :meth:`dispatch`."""
        self.calls += 1
        if method == "getSystemState" and len(args) == 1 and isinstance(args[0], str):
            if self._state[0] == self.registry.changes:
                return self._state[1]
            steps = self._write_state(args[0])
            return finish(steps) if self.registry.is_small else steps
        return self.dispatch(method, args)

    def dispatch(self, method: str, args: Sequence[Any]) -> Any:
        """Return the answer to one call, or the steps that lead to it. Raises RpcFault on an unknown method."""
        entry = self._methods.get(method)
        if entry is None:
            return self._system(method, args)
        if not args:
            return [_ERROR, "missing required caller_id parameter", entry.refused]
        if not entry.fewest <= len(args) <= entry.most:
            return [_ERROR, "Error: bad call arity", entry.refused]
        if not isinstance(args[0], str):
            return [_ERROR, "caller_id must be a string", entry.refused]
        try:
            if len(args[0]) > _MAX_NAME:
                raise _Refusal(f"ERROR: the caller_id has more than {_MAX_NAME} characters")
            if has_controls(args[0]):
                raise _Refusal("caller_id contains illegal chars")
            answer = entry.function(*args)
        except _REFUSALS as refusal:
            return [_ERROR, str(refusal), entry.refused]
        return answer if isinstance(answer, list) else self._answer_in_steps(answer, entry.refused)

    def _answer_in_steps(self, steps: Steps[Answer], refused: Any) -> Steps[Answer]:
        try:
            return (yield from steps)
        except _REFUSALS as refusal:
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

    def get_system_state(self, caller_id: str) -> Answer | Steps[Answer]:
        """Publishers, subscribers and services, each as [name, nodes]."""
        steps = self._collect_state()
        return finish(steps) if self.registry.is_small else steps

    def _collect_state(self) -> Steps[Answer]:
        state: list[list[list[Any]]] = []
        registry = self.registry
        for rows in (registry.publisher_rows(), registry.subscriber_rows(), registry.service_rows()):
            table: list[list[Any]] = []
            state.append(table)
            while found := [list(row) for row in islice(rows, _ROWS)]:
                table += found
                yield None
        return [_SUCCESS, "current system state", state]

    def _write_state(self, caller_id: str) -> Steps[Serialized]:
        """Return the same as it is sent: of a large graph it takes long to write, and tools request it all the time."""
        changes = self.registry.changes
        answer = yield from self._collect_state()
        pieces = yield from serialize_response_in_steps(answer, MAX_BODY)
        state = Serialized(b"".join(pieces))
        if changes == self.registry.changes:
            self._state = (changes, state)
        return state

    def get_topic_types(self, caller_id: str) -> Answer:
        """[topic, type] of each topic."""
        return [_SUCCESS, "current system state", _rows(self.registry.topic_types())]

    def get_published_topics(self, caller_id: str, subgraph: Any) -> Answer:
        """[topic, type] of each published topic below a namespace."""
        if not isinstance(subgraph, str):
            raise _Refusal("ERROR: parameter [subgraph] must be a string")
        prefix = names.resolve(subgraph, caller_id) if subgraph else ""
        return [_SUCCESS, "current topics", [list(row) for row in self.registry.published_topics(prefix)]]

    def register_publisher(
        self, caller_id: str, topic: Any, topic_type: Any, caller_api: Any
    ) -> Answer | Steps[Answer]:
        """A node publishes a topic; the URIs of its subscribers."""
        topic = _name(topic, "topic", caller_id)
        type_, uri = _type(topic_type, "topic_type"), _uri(caller_api, "caller_api")

        def register() -> Steps[Answer]:
            peers, actions = self.registry.register_publisher(caller_id, topic, type_, uri)
            others = self._act_first(actions)
            self.note("+pub", caller_id, topic, type_, uri)
            self.say(f"+PUB [{topic}] {caller_id} {uri}")
            yield from self.act_in_steps(others)
            return [_SUCCESS, f"Registered [{caller_id}] as publisher of [{topic}]", peers]

        return self._run(register(), self.registry.count_subscribers(topic))

    def unregister_publisher(self, caller_id: str, topic: Any, caller_api: Any) -> Answer | Steps[Answer]:
        """A node publishes a topic no more."""
        topic, uri = _name(topic, "topic", caller_id), _uri(caller_api, "caller_api")

        def unregister() -> Steps[Answer]:
            actions = self.registry.unregister_publisher(caller_id, topic, uri)
            if actions is not None:
                self.note("-pub", caller_id, topic, uri)
                self.say(f"-PUB [{topic}] {caller_id} {uri}")
                yield from self.act_in_steps(actions)
            return self._unregistered(caller_id, topic, actions is not None)

        return self._run(unregister(), self.registry.count_subscribers(topic))

    def register_subscriber(self, caller_id: str, topic: Any, topic_type: Any, caller_api: Any) -> Answer:
        """A node subscribes to a topic; the URIs of its publishers."""
        topic = _name(topic, "topic", caller_id)
        type_, uri = _type(topic_type, "topic_type"), _uri(caller_api, "caller_api")
        peers, actions = self.registry.register_subscriber(caller_id, topic, type_, uri)
        self._act(actions)
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
        self._act(actions)
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

    def set_param(self, caller_id: str, key: Any, value: Any) -> Answer | Steps[Answer]:
        """Set a parameter."""
        name = _key(key, caller_id)
        if not is_small(value):
            return self._set_large(caller_id, name, value)
        weight = finish(_weigh(name, value))
        if not self.parameters.has_room(weight):
            return self._set_large(caller_id, name, value)
        steps = self._set(caller_id, name, value, weight)
        return self._run(steps, self.parameters.count_subscriptions())

    def _set_large(self, caller_id: str, name: str, value: Any) -> Steps[Answer]:
        # One at a time: the value is in the tree, or it is freed, before the next one comes.
        yield ALONE
        weight = yield from _weigh(name, value)
        yield from self.parameters.make_room(weight)
        number = None if is_small(value) else (yield from self.store(value))
        return (yield from self._set(caller_id, name, value, weight, number))

    def _set(
        self, caller_id: str, name: str, value: Any, weight: int, number: int | None = None
    ) -> Steps[Answer]:
        try:
            updates = self.parameters.set(name, value, caller_id, weight)
        except ValueError as error:
            raise _Refusal(f"Error: invalid arguments: {error}") from error
        if number is None:
            self.note("set", name, value)
        else:
            self.note("put", name, number)
        self.say(f"+PARAM [{name}] by {caller_id}")
        yield from self.act_in_steps(updates)
        return [_SUCCESS, f"parameter {name} set", 0]

    def has_param(self, caller_id: str, key: Any) -> Answer:
        """Whether a parameter is set."""
        name = _key(key, caller_id)
        return [_SUCCESS, name, self.parameters.has(name)]

    def delete_param(self, caller_id: str, key: Any) -> Answer | Steps[Answer]:
        """Delete a parameter."""
        name = _key(key, caller_id)
        try:
            updates = self.parameters.delete(name)
        except KeyError:
            return [_ERROR, f"parameter [{name}] is not set", 0]

        def delete() -> Steps[Answer]:
            self.note("del", name)
            self.say(f"-PARAM [{name}] by {caller_id}")
            yield from self.act_in_steps(updates)
            return [_SUCCESS, f"parameter {name} deleted", 0]

        return self._run(delete(), self.parameters.count_subscriptions())

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

    def get_param_names(self, caller_id: str) -> Answer | Steps[Answer]:
        """The names of all parameters."""

        def collect() -> Steps[Answer]:
            return [_SUCCESS, "Parameter names", (yield from self.parameters.names_in_steps())]

        return finish(collect()) if self.parameters.is_small else collect()

    def subscribe_param(self, caller_id: str, caller_api: Any, key: Any) -> Answer:
        """Tell a node of changes of a parameter; its value now."""
        uri, name = _uri(caller_api, "caller_api"), _key(key, caller_id)
        actions = self.registry.register_parameter(caller_id, key_of_node(name), uri)
        value = self.parameters.subscribe(name, caller_id, uri)
        self._act(actions)
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

    def _run(self, steps: Steps[Answer], actions: int) -> Answer | Steps[Answer]:
        """Return the answer immediately where it takes few actions, else the steps to it."""
        return finish(steps) if actions <= _FEW else steps

    def _act_first(self, actions: Iterable[Notice]) -> Iterator[Notice]:
        """Do the first action, and return the others.

        It may stop a node whose name another one took: its parameters are dropped before the change is noted.
        """
        others = iter(actions)
        for action in islice(others, 1):
            self.act(action)
        return others

    def _act(self, actions: Iterable[Notice]) -> None:
        for action in actions:
            self.act(action)

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
            return self._call_many(args[0])
        raise RpcFault(1, f"<class 'Exception'>:method \"{method[:_MAX_NAME]}\" is not supported")

    def _call_many(self, calls: list[Any]) -> Steps[list[Any]]:
        answers = []
        for call in calls:
            answers.append((yield from self._one_of_many(call)))
            yield None
        return answers

    def _one_of_many(self, call: Any) -> Steps[Any]:
        match call:
            case {"methodName": "system.multicall"}:
                return {"faultCode": 1, "faultString": "system.multicall inside itself"}
            case {"methodName": str(method), "params": list(params)}:
                try:
                    answer = self.dispatch(method, params)
                    return [answer if type(answer) is list else (yield from answer)]
                except RpcFault as fault:
                    return {"faultCode": fault.code, "faultString": fault.text}
            case _:
                return {"faultCode": 1, "faultString": "a call is a struct of methodName and params"}


_REFUSALS = (_Refusal, RegistryFullError, ParametersFullError)


def _weigh(name: str, value: Any) -> Steps[int]:
    try:
        return (yield from weigh_in_steps(name, value))
    except ValueError as error:
        raise _Refusal(f"Error: invalid arguments: {error}") from error


def _store_nothing(_: Any) -> Steps[int]:
    yield None
    return 0


def nothing(*_: object) -> None:
    """What stands where a journal or a log would."""


def _arity(function: _Function) -> tuple[int, int]:
    most = function.__code__.co_argcount - 1
    return most - len(getattr(function, "__defaults__", None) or ()), most


def _rows(table: Mapping[str, Any]) -> list[list[Any]]:
    return [[name, value] for name, value in table.items()]


def _name(value: Any, what: str, caller_id: str) -> str:
    """A graph resource name, resolved as the caller sees it."""
    if not isinstance(value, str) or not value:
        raise _Refusal(f"ERROR: parameter [{what}] must be a non-empty string")
    _check_length(value, what)
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
    _check_length(value, "key")


def _key(value: Any, caller_id: str) -> str:
    """A parameter's name, resolved; rosmaster lets any characters in."""
    _check_key(value)
    return _resolve(value, caller_id)


def _type(value: Any, what: str) -> str:
    """A type ``pkg/Name``, or ``*``."""
    if not isinstance(value, str) or not value:
        raise _Refusal(f"ERROR: parameter [{what}] must be a non-empty string")
    _check_length(value, what)
    if value != "*" and (value.count("/") != 1 or has_controls(value)):
        raise _Refusal(f"ERROR: parameter [{what}] is not a valid package resource name")
    return value


def _uri(value: Any, what: str) -> str:
    if not isinstance(value, str) or not value:
        raise _Refusal(f"ERROR: parameter [{what}] is not an XMLRPC URI")
    _check_length(value, what)
    if not value.startswith(("http://", "rosrpc://")):
        raise _Refusal(f"ERROR: parameter [{what}] is not an RPC URI")
    if " " in value or has_controls(value):
        # It becomes part of the requests to the node, and of lines of logs.
        raise _Refusal(f"ERROR: parameter [{what}] contains illegal chars")
    return value


def _check_length(value: str, what: str) -> None:
    if len(value) > _MAX_NAME:
        raise _Refusal(f"ERROR: parameter [{what}] has more than {_MAX_NAME} characters")


def key_of_node(key: str) -> str:
    """A parameter's name among a node's entries, where topics and services stand too."""
    return key.rstrip("/") or "/"
