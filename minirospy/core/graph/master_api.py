"""The Master API and the Parameter Server API: a table of methods, and the ``[status code, message, value]`` responses.

Pure: a call's effects are passed to :meth:`MasterApi.notify` and :attr:`MasterApi.record`. A slow response is computed
in steps. Source: http://wiki.ros.org/ROS/Master_API, http://wiki.ros.org/ROS/Parameter%20Server%20API; messages
and corner cases are rosmaster's (tests/runtime/master/master_calls.py).
"""

from __future__ import annotations

import logging
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import islice

from minirospy.base.escape import escaped
from minirospy.base.steps import ALONE, SHORT_ITEMS, Steps, finish, is_small
from minirospy.core.graph.calls import (
    ERROR,
    FAILURE,
    SUCCESS,
    Answer,
    CallRefused,
    Dispatcher,
    Method,
    anything,
    api_uri,
    global_name,
    node_name,
    parameter_key,
    parameters,
    plain_key,
    subgraph,
    type_name,
)
from minirospy.core.graph.parameters import (
    ParametersFullError,
    ParameterTree,
    ParameterUpdate,
    weigh_in_steps,
)
from minirospy.core.graph.registry import NodeShutdown, PublisherUpdate, Registry, RegistryFullError

__all__ = ["PARAMETERS", "MasterApi", "Notice", "key_of_node", "nothing"]

_log = logging.getLogger(__name__)

_FEW = 200  # maximum number of nodes to notify in one step

_ROWS = 500  # maximum number of table rows to collect in one step

PARAMETERS = ""  # passed to :meth:`MasterApi.defer` in place of a topic; no topic has this name

# A notification from the master to a node after a change.
Notice = PublisherUpdate | NodeShutdown | ParameterUpdate


class MasterApi(ABC):
    """The Master API: one method per call. An XML-RPC server passes each call to :meth:`dispatch`."""

    def __init__(self) -> None:
        self.registry = Registry()
        self.parameters = ParameterTree()
        self.log: Callable[[str], object] = nothing  # called with a log line for each registration
        # Called with each change, as a record for the journal
        self.record: Callable[..., object] = nothing
        self.store: Callable[[object], Steps[int]] = _store_nothing
        """Writes a large value to the journal; returns the number by which a change refers to it."""

        topic = parameters(topic=global_name, caller_api=api_uri)
        typed_topic = parameters(topic=global_name, topic_type=type_name, caller_api=api_uri)
        key = parameters(key=parameter_key)

        self.dispatcher = Dispatcher(
            {
                "getPid": Method(self.get_pid, -1),
                "getUri": Method(self.get_uri, ""),
                "shutdown": Method(self.shutdown, 0, parameters(msg=anything), optional=1),
                "lookupNode": Method(self.lookup_node, "", parameters(node=node_name)),
                "lookupService": Method(self.lookup_service, "", parameters(service=global_name)),
                "getSystemState": Method(self.get_system_state, [[], [], []]),
                "getTopicTypes": Method(self.get_topic_types, []),
                "getPublishedTopics": Method(self.get_published_topics, 0, parameters(subgraph=subgraph)),
                "registerPublisher": Method(self.register_publisher, [], typed_topic),
                "unregisterPublisher": Method(self.unregister_publisher, 0, topic),
                "registerSubscriber": Method(self.register_subscriber, [], typed_topic),
                "unregisterSubscriber": Method(self.unregister_subscriber, 0, topic),
                "registerService": Method(
                    self.register_service,
                    0,
                    parameters(service=global_name, service_api=api_uri, caller_api=api_uri),
                ),
                "unregisterService": Method(
                    self.unregister_service, 0, parameters(service=global_name, service_api=api_uri)
                ),
                "getParam": Method(self.get_param, 0, key),
                "setParam": Method(self.set_param, 0, parameters(key=parameter_key, value=anything)),
                "hasParam": Method(self.has_param, False, key),
                "deleteParam": Method(self.delete_param, 0, key),
                "searchParam": Method(self.search_param, 0, parameters(key=plain_key)),
                "getParamNames": Method(self.get_param_names, []),
                "subscribeParam": Method(
                    self.subscribe_param, 0, parameters(caller_api=api_uri, key=parameter_key)
                ),
                "unsubscribeParam": Method(
                    self.unsubscribe_param, 0, parameters(caller_api=api_uri, key=parameter_key)
                ),
                "minirospy.status": Method(self.get_status, {}),
            },
            refusals=(RegistryFullError, ParametersFullError),
        )

    @property
    @abstractmethod
    def uri(self) -> str:
        """Return the value for ROS_MASTER_URI."""

    @abstractmethod
    def notify(self, action: Notice) -> None:
        """Send the notification that a change in the tables requires."""

    def notify_in_steps(self, actions: Iterable[Notice]) -> Steps[None]:
        """Send the notifications that a change in the tables requires. There may be many."""
        for number, action in enumerate(actions):
            self.notify(action)
            if number % _FEW == _FEW - 1:
                yield None

    @abstractmethod
    def defer(self, uri: str, topic: str) -> None:
        """Delay notifications to a node about ``topic`` (or PARAMETERS) while a response with the topic's state is on its way."""

    @abstractmethod
    def stop(self) -> None:
        """Ask the master to stop."""

    @abstractmethod
    def get_status(self, caller_id: str) -> Answer | Steps[Answer]:
        """Return this master's status, for `minirospy master --status`; not part of ROS's API."""

    def dispatch(self, method: str, args: Sequence[object]) -> object:
        """Return the response to one call, or the steps that compute it. Raise RpcFault if the method is unknown."""
        return self.dispatcher.dispatch(method, args)

    # --- master

    def get_pid(self, caller_id: str) -> Answer:
        """Return the master's process id."""
        return [SUCCESS, "", os.getpid()]

    def get_uri(self, caller_id: str) -> Answer:
        """Return the master's URI."""
        return [SUCCESS, "", self.uri]

    def shutdown(self, caller_id: str, msg: str = "") -> Answer:
        """Stop the master."""
        _log.info("shutdown request from %s: %s", caller_id, escaped(str(msg)))
        self.stop()
        return [SUCCESS, "shutdown", 0]

    # --- graph

    def lookup_node(self, caller_id: str, node: str) -> Answer:
        """Return the URI of a node's Slave API."""
        uri = self.registry.node_uri(node)
        return [SUCCESS, "node api", uri] if uri else [ERROR, f"unknown node [{node}]", ""]

    def lookup_service(self, caller_id: str, service: str) -> Answer:
        """Return the URI of a service."""
        uri = self.registry.service_uri(service)
        return [SUCCESS, f"rosrpc URI: [{uri}]", uri] if uri else [ERROR, "no provider", ""]

    def get_system_state(self, caller_id: str) -> Answer | Steps[Answer]:
        """Return publishers, subscribers and services, each as [name, nodes]."""
        steps = self.collect_system_state()
        return finish(steps) if self.registry.is_small else steps

    def collect_system_state(self) -> Steps[Answer]:
        """Return the response to :meth:`get_system_state`, in steps."""
        if self.registry.is_large:
            # Build one list at a time, so that memory does not hold a list for each waiting client.
            yield ALONE
        publishers = yield from _collect(self.registry.publisher_rows())
        subscribers = yield from _collect(self.registry.subscriber_rows())
        services = yield from _collect(self.registry.service_rows())
        return [SUCCESS, "current system state", [publishers, subscribers, services]]

    def get_topic_types(self, caller_id: str) -> Answer | Steps[Answer]:
        """Return [topic, type] for each topic."""
        return self._answer_rows("current system state", self.registry.type_rows)

    def get_published_topics(self, caller_id: str, namespace: str) -> Answer | Steps[Answer]:
        """Return [topic, type] for each published topic below a namespace."""
        return self._answer_rows("current topics", partial(self.registry.published_rows, namespace))

    def _answer_rows(
        self, text: str, rows: Callable[[], Iterator[tuple[str, str]]]
    ) -> Answer | Steps[Answer]:
        def answer() -> Steps[Answer]:
            if self.registry.is_large:
                yield ALONE
            return [SUCCESS, text, (yield from _collect(rows()))]

        return finish(answer()) if self.registry.is_small else answer()

    def register_publisher(self, caller_id: str, topic: str, type_: str, uri: str) -> Answer | Steps[Answer]:
        """Register a publisher; return the URIs of the topic's subscribers."""

        def register() -> Steps[Answer]:
            peers, actions = self.registry.register_publisher(caller_id, topic, type_, uri)
            others = self._act_first(actions)
            self.record("+pub", caller_id, topic, type_, uri)
            self.log(f"+PUB [{topic}] {caller_id} {uri}")
            yield from self.notify_in_steps(others)
            return [SUCCESS, f"Registered [{caller_id}] as publisher of [{topic}]", peers]

        return self._run(register(), self.registry.count_subscribers(topic))

    def unregister_publisher(self, caller_id: str, topic: str, uri: str) -> Answer | Steps[Answer]:
        """Unregister a publisher."""

        def unregister() -> Steps[Answer]:
            actions = self.registry.unregister_publisher(caller_id, topic, uri)
            if actions is not None:
                self.record("-pub", caller_id, topic, uri)
                self.log(f"-PUB [{topic}] {caller_id} {uri}")
                yield from self.notify_in_steps(actions)
            return self._unregistered(caller_id, topic, actions is not None)

        return self._run(unregister(), self.registry.count_subscribers(topic))

    def register_subscriber(self, caller_id: str, topic: str, type_: str, uri: str) -> Answer:
        """Register a subscriber; return the URIs of the topic's publishers."""
        peers, actions = self.registry.register_subscriber(caller_id, topic, type_, uri)
        self._act(actions)
        self.defer(uri, topic)
        self.record("+sub", caller_id, topic, type_, uri)
        self.log(f"+SUB [{topic}] {caller_id} {uri}")
        return [SUCCESS, f"Subscribed to [{topic}]", peers]

    def unregister_subscriber(self, caller_id: str, topic: str, uri: str) -> Answer:
        """Unregister a subscriber."""
        gone = self.registry.unregister_subscriber(caller_id, topic, uri)
        if gone:
            self.record("-sub", caller_id, topic, uri)
            self.log(f"-SUB [{topic}] {caller_id} {uri}")
        return self._unregistered(caller_id, topic, gone)

    def register_service(self, caller_id: str, service: str, service_uri: str, uri: str) -> Answer:
        """Register a service."""
        actions = self.registry.register_service(caller_id, service, service_uri, uri)
        self._act(actions)
        self.record("+srv", caller_id, service, service_uri, uri)
        self.log(f"+SERVICE [{service}] {caller_id} {uri}")
        return [SUCCESS, f"Registered [{caller_id}] as provider of [{service}]", 1]

    def unregister_service(self, caller_id: str, service: str, uri: str) -> Answer:
        """Unregister the service at ``uri``."""
        if self.registry.unregister_service(caller_id, service, uri):
            self.record("-srv", caller_id, service, uri)
            self.log(f"-SERVICE [{service}] {caller_id} {uri}")
            return [SUCCESS, f"Unregistered [{caller_id}] as provider of [{service}]", 1]
        if self.registry.node_uri(caller_id) is None:
            return [SUCCESS, f"[{caller_id}] is not a registered node", 0]
        return [SUCCESS, f"[{uri}] is no longer the current service api handle for [{service}]", 0]

    # --- parameters

    def get_param(self, caller_id: str, name: str) -> Answer | Steps[Answer]:
        """Return a parameter's value."""
        if self.parameters.is_small_at(name, SHORT_ITEMS):
            return self._get(name)

        def get() -> Steps[Answer]:
            # Count the items in a separate step, because counting takes time.
            if not self.parameters.is_small_at(name):
                # Send one value at a time, because any change to a value that is being sent requires a copy.
                yield ALONE
            return self._get(name)

        return get()

    def _get(self, name: str) -> Answer:
        try:
            return [SUCCESS, f"Parameter [{name}]", self.parameters.get(name)]
        except KeyError:
            return [ERROR, f"Parameter [{name}] is not set", 0]

    def set_param(self, caller_id: str, name: str, value: object) -> Answer | Steps[Answer]:
        """Set a parameter."""
        if not is_small(value):
            return self._set_large(caller_id, name, value)
        weight = finish(_weigh(name, value))
        if not self.parameters.has_room(weight):
            return self._set_large(caller_id, name, value)
        steps = self._set(caller_id, name, value, weight)
        return self._run(steps, self.parameters.count_subscriptions())

    def _set_large(self, caller_id: str, name: str, value: object) -> Steps[Answer]:
        # Process the values one by one, so that each is stored in the tree or freed before the next.
        yield ALONE
        weight = yield from _weigh(name, value)
        yield from self.parameters.make_room(weight)
        number = None if is_small(value) else (yield from self.store(value))
        return (yield from self._set(caller_id, name, value, weight, number))

    def _set(
        self, caller_id: str, name: str, value: object, weight: int, number: int | None = None
    ) -> Steps[Answer]:
        try:
            updates = self.parameters.set(name, value, caller_id, weight)
        except ValueError as error:
            raise CallRefused(f"Error: invalid arguments: {error}") from error
        if number is None:
            self.record("set", name, value)
        else:
            self.record("put", name, number)
        self.log(f"+PARAM [{name}] by {caller_id}")
        yield from self.notify_in_steps(updates)
        return [SUCCESS, f"parameter {name} set", 0]

    def has_param(self, caller_id: str, name: str) -> Answer:
        """Return whether a parameter is set."""
        return [SUCCESS, name, self.parameters.has(name)]

    def delete_param(self, caller_id: str, name: str) -> Answer | Steps[Answer]:
        """Delete a parameter."""
        try:
            updates = self.parameters.delete(name)
        except KeyError:
            return [ERROR, f"parameter [{name}] is not set", 0]

        def delete() -> Steps[Answer]:
            self.record("del", name)
            self.log(f"-PARAM [{name}] by {caller_id}")
            yield from self.notify_in_steps(updates)
            return [SUCCESS, f"parameter {name} deleted", 0]

        return self._run(delete(), self.parameters.count_subscriptions())

    def search_param(self, caller_id: str, key: str) -> Answer:
        """Search for a parameter from the caller's namespace upwards; return the name of the first match."""
        if key.startswith("~"):
            return [FAILURE, "Internal failure: invalid key", 0]
        if not caller_id.startswith("/"):
            return [FAILURE, "Internal failure: namespace must be global", 0]
        found = self.parameters.search(caller_id, key)
        if found is None:
            return [ERROR, f"Cannot find parameter [{key}] in an upwards search", ""]
        return [SUCCESS, f"Found [{found}]", found]

    def get_param_names(self, caller_id: str) -> Answer | Steps[Answer]:
        """Return the names of all parameters."""

        def collect() -> Steps[Answer]:
            if self.parameters.is_large:
                yield ALONE
            return [SUCCESS, "Parameter names", (yield from self.parameters.names_in_steps())]

        return finish(collect()) if self.parameters.is_small else collect()

    def subscribe_param(self, caller_id: str, uri: str, name: str) -> Answer:
        """Subscribe a node to a parameter's changes; return its current value."""
        # Subscribe first, so that exceeding a limit has no side effects.
        value = self.parameters.subscribe(name, caller_id, uri)
        try:
            actions = self.registry.register_parameter(caller_id, key_of_node(name), uri)
        except RegistryFullError:
            self.parameters.unsubscribe(name, caller_id, uri)
            raise
        self._act(actions)
        self.defer(uri, PARAMETERS)
        self.record("+par", caller_id, name, uri)
        self.log(f"+CACHEDPARAM [{name}] by {caller_id}")
        return [SUCCESS, f"Subscribed to parameter [{name}]", value]

    def unsubscribe_param(self, caller_id: str, uri: str, name: str) -> Answer:
        """Unsubscribe a node from a parameter's changes."""
        if self.parameters.unsubscribe(name, caller_id, uri):
            self.registry.unregister_parameter(caller_id, key_of_node(name), uri)
            self.record("-par", caller_id, name, uri)
            self.log(f"-CACHEDPARAM [{name}] by {caller_id}")
        return [SUCCESS, f"Unsubscribe to parameter [{name}]", 1]

    # --- helpers

    def _run(self, steps: Steps[Answer], actions: int) -> Answer | Steps[Answer]:
        """Return the response immediately if it requires only a few actions; otherwise return the steps that compute it."""
        return finish(steps) if actions <= _FEW else steps

    def _act_first(self, actions: Iterable[Notice]) -> Iterator[Notice]:
        """Send the first notification and return the others.

        The first one may stop a node whose name was taken over; that node's parameters must be dropped before the change is
        recorded.
        """
        others = iter(actions)
        for action in islice(others, 1):
            self.notify(action)
        return others

    def _act(self, actions: Iterable[Notice]) -> None:
        for action in actions:
            self.notify(action)

    def _unregistered(self, caller_id: str, topic: str, gone: bool) -> Answer:
        if gone:
            return [SUCCESS, f"Unregistered [{caller_id}] as provider of [{topic}]", 1]
        if self.registry.node_uri(caller_id) is None:
            return [SUCCESS, f"[{caller_id}] is not a registered node", 0]
        return [SUCCESS, f"[{caller_id}] is not a known provider of [{topic}]", 0]


def _collect(rows: Iterator[tuple[object, ...]]) -> Steps[list[list[object]]]:
    """Return a table's rows, each as a list."""
    table: list[list[object]] = []
    while found := [list(row) for row in islice(rows, _ROWS)]:
        table += found
        yield None
    return table


def _weigh(name: str, value: object) -> Steps[int]:
    try:
        return (yield from weigh_in_steps(name, value))
    except ValueError as error:
        raise CallRefused(f"Error: invalid arguments: {error}") from error


def _store_nothing(_: object) -> Steps[int]:
    yield None
    return 0


def nothing(*_: object) -> None:
    """Do nothing; the default for a journal or a log."""


def key_of_node(key: str) -> str:
    """Return a parameter's key in the form in which the registry stores it: without the final slash."""
    return key.rstrip("/") or "/"
