"""The master: the Master API and the Parameter Server API over XML-RPC, and the calls that follow from them.

The tables are in ``minirospy.graph``; here stand the checks of arguments, the ``[status code, text, value]``
answers, and what is written to the journal. Source: http://wiki.ros.org/ROS/Master_API; texts and corner cases
are those of real rosmaster (tests/runtime/master_calls.py).
"""

from __future__ import annotations

import asyncio
import logging
import os
import re
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Sized
from pathlib import Path
from typing import Any, NamedTuple

import minirospy
from minirospy import names
from minirospy.errors import RpcError, RpcFault, RpcUnreachable
from minirospy.graph.parameters import ParameterTree, ParameterUpdate, check_value
from minirospy.graph.registry import NodeShutdown, PublisherUpdate, Registry
from minirospy.runtime.access import Access
from minirospy.runtime.notifier import Notice, Notifier
from minirospy.runtime.rpc_async import AsyncRpcClient
from minirospy.runtime.rpc_server import RpcServer

__all__ = ["Master"]

_log = logging.getLogger(__name__)

_SUCCESS, _FAILURE, _ERROR = 1, 0, -1
_CHECK_SECONDS = 3.0
_CHECK_TRIES = 3
_CHECKS_AT_ONCE = 100
_QUICK_CHECK_SECONDS = 1.0
_TOUCH_SECONDS = 60.0
_RESTART_SECONDS = 600.0
"""A master that starts so soon after the last sign of the one that was killed takes its session up."""

_OWN_NODE = "/rosout"

Answer = list[Any]


class _Method(NamedTuple):
    function: Callable[..., Answer]
    fewest: int
    most: int
    refused: Any


class _Refusal(Exception):
    """An argument is not acceptable; the text is the answer's."""


class Master:
    """A ROS master at ``http://host:port/``, listening on ``bind_host``; port 0 takes a free one."""

    def __init__(
        self,
        *,
        host: str = "localhost",
        bind_host: str = "127.0.0.1",
        port: int = 0,
        journal: Path | None = None,
        access: Access | None = None,
        fresh: bool = False,
        timeout: float = 3.0,
        most_clients: int = 4000,
    ) -> None:
        """``journal``: the file that keeps what it knows (None: no file); ``fresh``: what stands there is dropped.

        ``timeout``: seconds that a node has to take a call.
        """
        self.host = host
        self.registry = Registry()
        self.parameters = ParameterTree()
        self.news: list[str] = []
        """What a person should know of the start: what was recovered, and what was not."""
        self._started = time.monotonic()
        self._journal_path = journal
        self._fresh = fresh
        self._journal: Any = None
        self.say: Callable[[str], object] = _nothing
        """Gets a line for each registration."""
        self._note: Callable[..., object] = _nothing
        self._server = RpcServer(
            self.dispatch, bind_host=bind_host, port=port, most_idle=most_clients, access=access
        )
        self._notifier = Notifier(self._publishers_of, timeout)
        self._checking: asyncio.Task[None] | None = None
        self._touching: asyncio.TimerHandle | None = None
        self._calls = 0
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

    @property
    def session(self) -> str:
        """The /run_id of the session that was taken up; "" for a new one."""
        found = self.parameters.get("/run_id") if self.parameters.has("/run_id") else ""
        # It becomes the name of a folder, and anybody may have set it.
        return found if isinstance(found, str) and re.fullmatch(r"[\w-]{1,64}", found) else ""

    async def start(self) -> None:
        """Take up what a killed master left, and listen. Raises OSError."""
        nodes = await self._open_journal() if self._journal_path else {}
        try:
            await self._server.start()
        except BaseException:
            if self._journal:
                self._journal.close()
            raise
        if nodes:
            self._checking = asyncio.ensure_future(self._check(nodes))

    async def close(self, *, keep_journal: bool = False) -> None:
        """Stop, as a master should: the next one starts empty. Idempotent.

        With ``keep_journal`` the next one goes on where this one ended.
        """
        if self._checking:
            self._checking.cancel()
            await asyncio.gather(self._checking, return_exceptions=True)
        if self._touching:
            self._touching.cancel()
        await self._server.close()
        await self._notifier.close()
        self._note = _nothing
        if self._journal:
            if keep_journal:
                self._journal.close()
            else:
                self._journal.remove()

    def dispatch(self, method: str, args: Sequence[Any]) -> Any:
        """The answer to one call. Raises RpcFault on a method that is not there."""
        self._calls += 1
        entry = self._methods.get(method)
        if entry is None:
            return self._system(method, args)
        if not args:
            return [_ERROR, "missing required caller_id parameter", entry.refused]
        if not isinstance(args[0], str):
            return [_ERROR, "caller_id must be a string", entry.refused]
        if not entry.fewest <= len(args) <= entry.most:
            return [_ERROR, "Error: bad call arity", entry.refused]
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
        _log.info("shutdown request from %s: %s", caller_id, msg)
        self.stopped.set()
        return [_SUCCESS, "shutdown", 0]

    def get_status(self, caller_id: str) -> Answer:
        """How this master is: minirospy's own, for `minirospy master --status`."""
        types = self.registry.topic_types()
        return [
            _SUCCESS,
            "status",
            {
                "version": minirospy.__version__,
                "pid": os.getpid(),
                "uptime": time.monotonic() - self._started,
                "nodes": len(self.registry.nodes()),
                "topics": len(self.registry.publishers().keys() | self.registry.subscribers().keys()),
                "types": len(types),
                "services": len(self.registry.services()),
                "parameters": len(self.parameters.names()),
                "calls": min(self._calls, 2**31 - 1),
                "clients": self._server.clients,
                "refused": self._server.refused,
                "journal": self._journal_line(),
            },
        ]

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
        self._note("+pub", caller_id, topic, type_, uri)
        self.say(f"+PUB [{topic}] {caller_id} {uri}")
        return [_SUCCESS, f"Registered [{caller_id}] as publisher of [{topic}]", peers]

    def unregister_publisher(self, caller_id: str, topic: Any, caller_api: Any) -> Answer:
        """A node publishes a topic no more."""
        topic, uri = _name(topic, "topic", caller_id), _uri(caller_api, "caller_api")
        actions = self.registry.unregister_publisher(caller_id, topic, uri)
        if actions is not None:
            self._act(actions)
            self._note("-pub", caller_id, topic, uri)
            self.say(f"-PUB [{topic}] {caller_id} {uri}")
        return self._unregistered(caller_id, topic, actions is not None)

    def register_subscriber(self, caller_id: str, topic: Any, topic_type: Any, caller_api: Any) -> Answer:
        """A node subscribes to a topic; the URIs of its publishers."""
        topic = _name(topic, "topic", caller_id)
        type_, uri = _type(topic_type, "topic_type"), _uri(caller_api, "caller_api")
        peers, actions = self.registry.register_subscriber(caller_id, topic, type_, uri)
        self._act(actions)
        self._note("+sub", caller_id, topic, type_, uri)
        self.say(f"+SUB [{topic}] {caller_id} {uri}")
        return [_SUCCESS, f"Subscribed to [{topic}]", peers]

    def unregister_subscriber(self, caller_id: str, topic: Any, caller_api: Any) -> Answer:
        """A node subscribes to a topic no more."""
        topic, uri = _name(topic, "topic", caller_id), _uri(caller_api, "caller_api")
        gone = self.registry.unregister_subscriber(caller_id, topic, uri)
        if gone:
            self._note("-sub", caller_id, topic, uri)
            self.say(f"-SUB [{topic}] {caller_id} {uri}")
        return self._unregistered(caller_id, topic, gone)

    def register_service(self, caller_id: str, service: Any, service_api: Any, caller_api: Any) -> Answer:
        """A node offers a service."""
        service = _name(service, "service", caller_id)
        service_uri, uri = _uri(service_api, "service_api"), _uri(caller_api, "caller_api")
        actions = self.registry.register_service(caller_id, service, service_uri, uri)
        self._act(actions)
        self._note("+srv", caller_id, service, service_uri, uri)
        self.say(f"+SERVICE [{service}] {caller_id} {uri}")
        return [_SUCCESS, f"Registered [{caller_id}] as provider of [{service}]", 1]

    def unregister_service(self, caller_id: str, service: Any, service_api: Any) -> Answer:
        """A node offers a service no more."""
        service, uri = _name(service, "service", caller_id), _uri(service_api, "service_api")
        if self.registry.unregister_service(caller_id, service, uri):
            self._note("-srv", caller_id, service, uri)
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
        self._act(updates)
        self._note("set", name, value)
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
            updates = self.parameters.delete(name, caller_id)
        except KeyError:
            return [_ERROR, f"parameter [{name}] is not set", 0]
        self._act(updates)
        self._note("del", name)
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
        name, uri = _key(key, caller_id), _uri(caller_api, "caller_api")
        actions = self.registry.register_parameter(caller_id, _parameter(name), uri)
        value = self.parameters.subscribe(name, caller_id, uri)
        self._act(actions)
        self._note("+par", caller_id, name, uri)
        return [_SUCCESS, f"Subscribed to parameter [{name}]", value]

    def unsubscribe_param(self, caller_id: str, caller_api: Any, key: Any) -> Answer:
        """Tell it no more."""
        name, uri = _key(key, caller_id), _uri(caller_api, "caller_api")
        if self.parameters.unsubscribe(name, caller_id, uri):
            self.registry.unregister_parameter(caller_id, _parameter(name), uri)
            self._note("-par", caller_id, name, uri)
        return [_SUCCESS, f"Unsubscribe to parameter [{name}]", 1]

    # --- helpers

    def _publishers_of(self, topic: str) -> list[str]:
        return self.registry.publisher_uris(topic)

    def _unregistered(self, caller_id: str, topic: str, gone: bool) -> Answer:
        if gone:
            return [_SUCCESS, f"Unregistered [{caller_id}] as provider of [{topic}]", 1]
        if self.registry.node_uri(caller_id) is None:
            return [_SUCCESS, f"[{caller_id}] is not a registered node", 0]
        return [_SUCCESS, f"[{caller_id}] is not a known provider of [{topic}]", 0]

    def _act(self, actions: Iterable[Notice]) -> None:
        for action in actions:
            if isinstance(action, NodeShutdown):
                self.parameters.unsubscribe_node(action.name, action.uri)
                _log.warning("another node took the name %s: %s is told to stop", action.name, action.uri)
            self._notifier.send(action)

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

    # --- the journal

    def _journal_line(self) -> str:
        if self._journal is None:
            return "none"
        if self._journal.trouble:
            return f"failing: {self._journal.trouble}"
        return f"{self._journal.path} ({self._journal.size} bytes)"

    async def _open_journal(self) -> dict[str, str]:
        """Open the journal and take up what stands in it; the nodes to be checked, and their URIs."""
        from minirospy.runtime.journal import Journal, JournalBusyError

        assert self._journal_path
        journal = Journal(self._journal_path, self._snapshot)
        try:
            left = journal.open()
            if left and not self._fresh:
                await self._take_up(left)
            journal.rewrite()
        except JournalBusyError as error:
            # Its master may well be the one that has the port, which the caller then finds out.
            self.news.append(f"no journal: {error}")
            return {}
        except OSError as error:
            journal.close()
            self.news.append(f"no journal, a crash of the master would lose the graph: {error}")
            return {}
        self._journal = journal
        self._note = journal.append
        self._touch()
        return self.registry.nodes()

    async def _take_up(self, left: Any) -> None:
        recovered, age = left.recovered, left.age
        for record in recovered.records:
            try:
                self._replay(*record)
            except (TypeError, ValueError, KeyError) as error:
                self.news.append(f"journal: a record was left out: {error}")
        uri = self.registry.node_uri(_OWN_NODE)
        if uri:
            # The /rosout node went with its master; this one brings its own.
            self.registry.forget(_OWN_NODE, uri)
        if recovered.damage:
            self.news.append(
                f"journal: {recovered.damage}; recovered up to the last whole record "
                f"({len(recovered.records)} of them), a copy is kept as {self._journal_path}.damaged"
            )
        nodes, parameters = self.registry.nodes(), self.parameters.names()
        if not nodes and not parameters:
            return
        what = (
            f"{_many(nodes, 'node')} and {_many(parameters, 'parameter')} "
            f"of the master that stopped {_ago(age)} ago"
        )
        if not (left.same_boot and age < _RESTART_SECONDS) and not await self._anybody_lives(nodes):
            self.registry, self.parameters = Registry(), ParameterTree()
            self.news.append(f"journal: {what} are left behind: none of these nodes answers")
            return
        self.news.append(f"journal: recovered {what}")

    def _replay(self, what: str, *args: Any) -> None:
        """One change, as it was noted; whom it told then needs no word now."""
        registry, parameters = self.registry, self.parameters
        actions: Iterable[Notice] = ()
        match what, args:
            case "+pub", (node, topic, type_, uri):
                actions = registry.register_publisher(node, topic, type_, uri).actions
            case "+sub", (node, topic, type_, uri):
                actions = registry.register_subscriber(node, topic, type_, uri).actions
            case "+srv", (node, service, service_uri, uri):
                actions = registry.register_service(node, service, service_uri, uri)
            case "+par", (node, key, uri):
                actions = registry.register_parameter(node, _parameter(key), uri)
                parameters.subscribe(key, node, uri)
            case "-pub", (node, topic, uri):
                registry.unregister_publisher(node, topic, uri)
            case "-sub", (node, topic, uri):
                registry.unregister_subscriber(node, topic, uri)
            case "-srv", (node, service, service_uri):
                registry.unregister_service(node, service, service_uri)
            case "-par", (node, key, uri):
                if parameters.unsubscribe(key, node, uri):
                    registry.unregister_parameter(node, _parameter(key), uri)
            case "gone", (node, uri):
                self._forget(node, uri)
            case "type", (topic, type_):
                registry.set_type(topic, type_)
            case "set", (key, value):
                parameters.set(key, value, "")
            case "del", (key,):
                parameters.delete(key, "")
            case _:
                raise ValueError(f"{what!r} with {len(args)} arguments is unknown")
        for action in actions:
            if isinstance(action, NodeShutdown):
                parameters.unsubscribe_node(action.name, action.uri)

    def _snapshot(self) -> Iterator[list[Any]]:
        """The changes that lead from nothing to the present state, with the order of every table."""
        registry = self.registry
        uris, types = registry.nodes(), registry.topic_types()
        yield from (["type", topic, type_] for topic, type_ in types.items())
        yield from (
            ["+pub", node, topic, types[topic], uris[node]] for node, topic in registry.publications()
        )
        yield from (["+sub", node, topic, "*", uris[node]] for node, topic in registry.all_subscriptions())
        yield from (["+srv", node, name, uri, uris[node]] for node, name, uri in registry.offers())
        yield from (["+par", node, key, uri] for node, uri, key in self.parameters.subscriptions())
        yield ["set", "/", self.parameters.get("/")]

    def _touch(self) -> None:
        self._journal.touch()
        self._touching = asyncio.get_running_loop().call_later(_TOUCH_SECONDS, self._touch)

    # --- the nodes of a master that was killed

    async def _anybody_lives(self, nodes: Mapping[str, str]) -> bool:
        rpc = AsyncRpcClient()
        calls = [_lives(rpc, name, uri, _QUICK_CHECK_SECONDS) for name, uri in nodes.items()]
        try:
            return any(await asyncio.gather(*calls))
        finally:
            await rpc.close()

    async def _check(self, nodes: Mapping[str, str]) -> None:
        """Forget the nodes that are gone; tell the others what they may have missed."""
        rpc, slots = AsyncRpcClient(), asyncio.Semaphore(_CHECKS_AT_ONCE)

        async def check(name: str, uri: str) -> bool:
            async with slots:
                lives = await _lives(rpc, name, uri, _CHECK_SECONDS, _CHECK_TRIES)
            if not lives:
                self._act(self._forget(name, uri))
                self._note("gone", name, uri)
                return False
            if self.registry.node_uri(name) == uri:
                self._act(PublisherUpdate(uri, topic) for topic in self.registry.subscriptions(name))
            return True

        try:
            found = await asyncio.gather(*(check(name, uri) for name, uri in nodes.items()))
            self._act(
                ParameterUpdate(uri, key, self.parameters.get(key) if self.parameters.has(key) else {})
                for _, uri, key in list(self.parameters.subscriptions())
            )
        finally:
            await rpc.close()
        _log.warning("of %s %d answer, the others are forgotten", _many(found, "recovered node"), sum(found))

    def _forget(self, name: str, uri: str) -> list[Any]:
        self.parameters.unsubscribe_node(name, uri)
        return list(self.registry.forget(name, uri))


def _nothing(*_: object) -> None:
    """What stands where a journal or a log would."""


async def _lives(rpc: AsyncRpcClient, name: str, uri: str, timeout: float, tries: int = 1) -> bool:
    """Whether the node still is where it was; any answer will do, unless it is another node's name."""
    for _ in range(tries):
        try:
            answer = await rpc.call(uri, "getName", "/master", timeout=timeout)
        except RpcUnreachable as error:
            if isinstance(error.__cause__, (ConnectionRefusedError, EOFError)):
                return False
        except RpcError:
            # roscpp has no getName, and says so.
            return True
        else:
            return not (
                isinstance(answer, list) and answer[:1] == [1] and answer[2:] not in ([name], [0], [""])
            )
    return False


def _arity(function: Callable[..., Answer]) -> tuple[int, int]:
    most = function.__code__.co_argcount - 1
    return most - len(getattr(function, "__defaults__", None) or ()), most


def _many(things: Sized, name: str) -> str:
    return f"{len(things)} {name}" + ("" if len(things) == 1 else "s")


def _ago(seconds: float) -> str:
    for unit, name in ((86400.0, "days"), (3600.0, "hours"), (60.0, "minutes")):
        if seconds >= 2 * unit:
            return f"{seconds / unit:.0f} {name}"
    return f"{seconds:.0f} s"


def _parameter(key: str) -> str:
    """A parameter's name among a node's entries, where topics and services stand too."""
    return key.rstrip("/") or "/"


def _rows(table: Mapping[str, Any]) -> list[list[Any]]:
    return [[name, value] for name, value in table.items()]


def _name(value: Any, what: str, caller_id: str) -> str:
    """A graph resource name, resolved as the caller sees it."""
    if not isinstance(value, str) or not value:
        raise _Refusal(f"ERROR: parameter [{what}] must be a non-empty string")
    # rosmaster lets in much that is no legal name: many a robot's topics have a dash.
    if ":" in value or " " in value:
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
    if not isinstance(value, str):
        raise _Refusal("ERROR: parameter [key] must be a string")
    if not value:
        raise _Refusal("ERROR: parameter [key] must be specified and non-empty")


def _key(value: Any, caller_id: str) -> str:
    """A parameter's name, resolved; rosmaster lets any characters in."""
    _check_key(value)
    return _resolve(value, caller_id)


def _type(value: Any, what: str) -> str:
    """A type ``pkg/Name``, or ``*``."""
    if not isinstance(value, str) or not value:
        raise _Refusal(f"ERROR: parameter [{what}] must be a non-empty string")
    if value != "*" and value.count("/") != 1:
        raise _Refusal(f"ERROR: parameter [{what}] is not a valid package resource name")
    return value


def _uri(value: Any, what: str) -> str:
    if not isinstance(value, str) or not value:
        raise _Refusal(f"ERROR: parameter [{what}] is not an XMLRPC URI")
    if not value.startswith(("http://", "rosrpc://")):
        raise _Refusal(f"ERROR: parameter [{what}] is not an RPC URI")
    return value
