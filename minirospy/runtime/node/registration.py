"""The registrations of a node: what the master knows of it, and what it should know.

Registrations are ordered, retried until the master has them, made again after it has restarted, and undone when the node closes.
Source: http://wiki.ros.org/ROS/Master_API.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias
from weakref import WeakValueDictionary

from minirospy.base.environment import Environment
from minirospy.base.errors import (
    MasterUnreachableError,
    RpcError,
    RpcFault,
    RpcProtocolError,
    RpcRefused,
    RpcUnreachable,
)
from minirospy.base.names import is_legal_name
from minirospy.runtime.node.services import ServiceServer
from minirospy.runtime.node.topics import Publication, Subscription
from minirospy.runtime.rpc.async_client import AsyncRpcClient
from minirospy.runtime.rpc.master_proxy import master_unreachable, unwrap
from minirospy.runtime.transport.workers import InOrder, Workers

__all__ = ["Registrations"]

_log = logging.getLogger(__name__)
_CALL_SECONDS = 30.0
"""How long a call of the master may take: one of many nodes that start together on a small computer waits for its turn."""

_LOOK_SECONDS = 5.0
"""How long the master may take to answer whether it knows this node: it is asked again soon."""

_SILENT_SECONDS, _STILL_SILENT_SECONDS = 10.0, 2.0
"""A closing node gives up on a master that answers nothing for this long; the shorter limit is for one that was already
silent before. The total is not limited: a busy master that answers call after call is waited for."""

_CLOSING_CALL_SECONDS = 3600.0
_PROBE_SECONDS = 3.0
"""How often a closing node checks that the master answers anything."""

_NOTICE_SECONDS = 3.0
"""A node that is still waiting for the master after this says so."""

_CALLS_AT_ONCE = 100
"""Unregistrations in one system.multicall."""

_Part: TypeAlias = Publication | Subscription | ServiceServer
_Key: TypeAlias = tuple[str, str]
"""The kind of a part, as in the names of the master's calls ("Publisher"), and its topic or name."""
_Call: TypeAlias = tuple[str, tuple[object, ...]]
"""A method of the Master API, and its arguments after the caller's name."""


class Registrations:
    """The registrations of one node with its master, and the calls for them. On the loop."""

    def __init__(
        self,
        name: str,
        environment: Environment,
        tables: Mapping[str, Mapping[str, _Part]],
        rpc: AsyncRpcClient,
        workers: Workers,
        watch_seconds: float,
    ) -> None:
        """``tables``: what the node has, by name, for each kind of registration, as in the names of the master's calls.

        Every ``watch_seconds`` :meth:`watch` checks whether the master still knows the node.
        """
        self.uri = ""
        self.service_uri = ""
        """The addresses of the node's Slave API and of its services; set before the first registration."""
        self.parameters: set[str] = set()
        """The parameters that the node has subscribed to."""
        self.when_registered_again: list[Callable[[], object]] = []
        """Called in workers when the master had forgotten the node: to register what else it needs."""

        self._name = name
        self._environment = environment
        self._tables = tables
        self._rpc = rpc
        # At the limit of threads they wait, and the watch goes on.
        self._again = InOrder(workers)
        self._watch_seconds = watch_seconds

        self._known: dict[_Key, _Part | None] = {}
        """What is registered with the master; None if a call failed, or has no answer yet."""
        self._turns: WeakValueDictionary[_Key, asyncio.Lock] = WeakValueDictionary()
        self._registering: set[asyncio.Task[None]] = set()
        self._watching: asyncio.Task[None] | None = None
        self._is_master_silent = False
        self._answered = 0.0
        """When the master answered last, in seconds of the loop's clock."""
        self._closed = False

    def watch(self) -> None:
        """Start checking whether the master knows the node."""
        self._watching = asyncio.ensure_future(self._watch_master())

    async def close(self, *, announces: bool) -> None:
        """Unregister everything, and register nothing more; the first call is sent before anything else is done.

        Takes as long as the master answers. One that refuses connections is not waited for; one that answers nothing is
        given up after ``_SILENT_SECONDS``. ``announces``: whether a line is logged when it takes long.
        """
        self._closed = True
        if self._watching:
            self._watching.cancel()
        await self._unregister_all(announces=announces)

    async def cancel(self) -> None:
        """Cancel the calls that the master has not answered."""
        tasks = [*self._registering, *([self._watching] if self._watching else [])]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def call(self, method: str, *args: object) -> Any:
        """Call the master as the node and return the value of its answer.

        Raise MasterUnreachableError, or RpcRefused with the master's text.
        """
        return unwrap(method, await self._call_master(method, self._name, *args))

    async def _call_master(self, method: str, *args: object) -> object:
        """Call any method of the master. Raise MasterUnreachableError, RpcError."""
        uri = self._environment.master_uri
        # Of a node that closes _wait_for_answers() decides.
        seconds = _CLOSING_CALL_SECONDS if self._closed else _CALL_SECONDS
        try:
            answer = await self._rpc.call(uri, method, *args, timeout=seconds)
        except RpcUnreachable as error:
            self._is_master_silent = True
            raise master_unreachable(error) from error
        self._is_master_silent = False
        self._answered = asyncio.get_running_loop().time()
        return answer

    async def _look(self, method: str, name: str) -> None:
        """Look up this node, or one of its services. Raise MasterUnreachableError, RpcError."""
        try:
            await asyncio.wait_for(self.call(method, name), _LOOK_SECONDS)
        except asyncio.TimeoutError as error:
            self._is_master_silent = True
            raise MasterUnreachableError(self._environment.master_uri) from error
        if self._closed:
            # asyncio.wait_for before Python 3.12 may lose the cancelling that came with the answer.
            raise asyncio.CancelledError

    def request_again(self, topic: str) -> None:
        """Register a subscription again: the list of publishers that the master sent last may be an older one."""
        key = ("Subscriber", topic)
        if self._known.get(key):
            self._known[key] = None
            self._start_registering(key)

    async def update(self, key: _Key, *, again: bool = False) -> None:
        """Register what this node has of one name, a part or nothing, if the master does not know it.

        One call after the other for each name, and none is cancelled half way: a registration could overtake the
        unregistration before it, which would undo it, or the shutdown of the node could overtake a registration.
        """
        task = self._start_registering(key, again=again)
        try:
            await asyncio.shield(task)
        except asyncio.CancelledError as error:
            if not task.cancelled():
                raise
            # close() has given up.
            raise MasterUnreachableError(self._environment.master_uri) from error

    def _start_registering(self, key: _Key, *, again: bool = False) -> asyncio.Task[None]:
        task = asyncio.ensure_future(self._register_in_turn(key, again=again))
        self._registering.add(task)
        task.add_done_callback(self._has_registered)
        return task

    def _has_registered(self, task: asyncio.Task[None]) -> None:
        self._registering.discard(task)
        if not task.cancelled():
            # A caller that waits gets its error; nobody has to, since it is tried again.
            task.exception()

    async def _register_in_turn(self, key: _Key, *, again: bool) -> None:
        async with self._turns.setdefault(key, asyncio.Lock()):
            part = self._wanted(key)
            if part is not None and self._known.get(key) is not part:
                self._known[key] = None
                await self._register(part, again=again)
                self._known[key] = part
            elif part is None and key in self._known:
                self._known[key] = None
                method, args = self._unregistration(key)
                await self.call(method, *args)
                # A check of a master that has restarted may have come first.
                self._known.pop(key, None)

    def _wanted(self, key: _Key) -> _Part | None:
        """Return what is to be registered for one name."""
        kind, name = key
        return None if self._closed else self._tables[kind].get(name)

    def _unregistration(self, key: _Key) -> _Call:
        kind, name = key
        return f"unregister{kind}", (name, self.service_uri if kind == "Service" else self.uri)

    async def _register(self, part: _Part, *, again: bool) -> None:
        if isinstance(part, Publication):
            subscribers = await self.call("registerPublisher", part.topic, part.type.name, self.uri)
            part.expected = len(subscribers)
        elif isinstance(part, Subscription):
            uris = await self._register_subscription(part)
            (part.registered_again if again else part.publishers_changed)(uris)
        else:
            await self.call("registerService", part.name, self.service_uri, self.uri)

    async def _register_subscription(self, subscription: Subscription) -> list[str]:
        """Register a subscription; return its publishers.

        A publisherUpdate comes by another connection, and may overtake the answer, which is then the older list.
        Where one came, the call is made again.
        """
        while True:
            lists = subscription.lists
            uris: list[str] = await self.call(
                "registerSubscriber", subscription.topic, subscription.type.name, self.uri
            )
            is_wanted = self._wanted(("Subscriber", subscription.topic)) is subscription
            if subscription.lists == lists or not is_wanted:
                return uris

    async def _watch_master(self) -> None:
        """Notice a master that has restarted and forgotten this node, and register again.

        It looks up a service of this node, or else its name, which the master may know again by a topic that is newer
        than the restart. The master's process id says nothing in a container, where each has the same, nor about a
        master that kept its tables.
        """
        failures = 0
        while not self._closed:
            await asyncio.sleep(self._watch_seconds)
            if not (self._known or any(self._tables.values())):
                continue

            known = [key for key, part in self._known.items() if part]
            asked = next((key for key in known if key[0] == "Service"), known[0] if known else None)
            has_forgotten = False
            try:
                if asked and asked[0] == "Service":
                    await self._look("lookupService", asked[1])
                else:
                    await self._look("lookupNode", self._name)
            except MasterUnreachableError as error:
                failures += 1
                if failures == 2:
                    _log.warning("%s. What is connected goes on; will keep trying.", error)
                continue
            except RpcRefused:
                # What was unregistered meanwhile is unknown for good reason, and an illegal name is always refused.
                if asked and (asked[0] == "Service" or is_legal_name(self._name)):
                    has_forgotten = self._known.get(asked) is not None
            except RpcError as error:
                _log.debug("looking up this node: %s", error)
                continue

            failures = 0
            if has_forgotten:
                self._known.clear()
            with contextlib.suppress(MasterUnreachableError):
                await self._register_all(again=has_forgotten)
            if has_forgotten and any(self._known.values()):
                _log.warning("the master at %s has restarted: registered again", self._environment.master_uri)
                for function in self.when_registered_again:
                    self._again.start(function)
            elif has_forgotten:
                # Once: this master does not count as one that knows this node any more.
                _log.warning("the master does not know this node, and refuses to")

    async def _register_all(self, *, again: bool = False) -> None:
        """Register all that the master does not know. Raise MasterUnreachableError."""
        keys = [(kind, name) for kind, table in self._tables.items() for name in table]
        for key in dict.fromkeys([*keys, *self._known]):
            # One that the master never accepts must not block the others.
            try:
                await self.update(key, again=again)
            except RpcError as error:
                _log.debug("registering %s: %s", key, error)

    async def _unregister_all(self, *, announces: bool) -> None:
        """Unregister everything that the master has of this node, in as few calls as it allows."""
        # A name with a call under way comes after that call, which would undo its unregistration.
        under_way = {key for key, turn in self._turns.items() if turn.locked()}
        calls = [self._unregistration(key) for key in self._known if key not in under_way]
        calls += [("unsubscribeParam", (self.uri, parameter)) for parameter in self.parameters]
        for key in self._known.keys() - under_way:
            del self._known[key]

        tasks = [asyncio.ensure_future(self._call_all(calls))]
        tasks += [asyncio.ensure_future(self.update(key)) for key in under_way]
        try:
            await self._wait_for_answers(tasks, announces=announces)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _wait_for_answers(self, tasks: Sequence[asyncio.Task[None]], *, announces: bool) -> None:
        """Wait for the last calls of the master, for as long as it answers anything.

        Of many nodes that shut down together each waits for its turn: a short call, which a busy master answers in between,
        shows that it is alive.
        """
        loop = asyncio.get_running_loop()
        uri = self._environment.master_uri
        patience = _STILL_SILENT_SECONDS if self._is_master_silent else _SILENT_SECONDS
        text = "waiting for the master at %s to unregister this node; it is given up when it answers nothing for %g s"
        notice = loop.call_later(_NOTICE_SECONDS, _log.warning, text, uri, patience) if announces else None

        self._answered = loop.time()
        pending = set(tasks)
        probe: asyncio.Task[None] | None = None
        try:
            while pending and (left := self._answered + patience - loop.time()) > 0:
                done, pending = await asyncio.wait(
                    pending, timeout=min(left, _PROBE_SECONDS), return_when=asyncio.FIRST_EXCEPTION
                )
                if any(isinstance(task.exception(), MasterUnreachableError) for task in done):
                    break
                if pending and (probe is None or probe.done()):
                    probe = asyncio.ensure_future(self._probe_master())
        finally:
            for waiting in (notice, probe):
                if waiting:
                    waiting.cancel()

    async def _probe_master(self) -> None:
        with contextlib.suppress(MasterUnreachableError, RpcError):
            await self._call_master("getPid", self._name)

    async def _call_all(self, calls: Sequence[_Call]) -> None:
        """Make all calls, whatever is answered; many in one where the master has system.multicall (not all masters do).

        Raise MasterUnreachableError.
        """
        for start in range(0, len(calls), _CALLS_AT_ONCE):
            part = calls[start : start + _CALLS_AT_ONCE]
            batch = [{"methodName": method, "params": [self._name, *args]} for method, args in part]
            answers: object = None
            if len(part) > 1:
                with contextlib.suppress(RpcFault, RpcProtocolError):
                    answers = await self._call_master("system.multicall", batch)
            if not isinstance(answers, list) or len(answers) != len(part):
                answers = [None] * len(part)
            for (method, args), answer in zip(part, answers, strict=True):
                # What the master has not answered as one of many, such as a fault for a batch that is too long.
                if not isinstance(answer, list):
                    with contextlib.suppress(RpcFault, RpcProtocolError, RpcRefused):
                        await self.call(method, *args)
