"""A node's registrations: those that the master has, and those that it should have.

Registrations are ordered, retried until the master accepts them, repeated after it has restarted, and removed when the
node closes. Source: http://wiki.ros.org/ROS/Master_API.
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
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.node.services import ServiceServer
from minirospy.runtime.node.subscription import Subscription
from minirospy.runtime.rpc.async_client import AsyncRpcClient
from minirospy.runtime.rpc.master_proxy import master_unreachable, unwrap
from minirospy.runtime.transport.workers import InOrder, Workers

__all__ = ["Registrations"]

_log = logging.getLogger(__name__)
# Time limit in seconds for a call; long, because many nodes that start together on a small computer delay each other
_CALL_SECONDS = 30.0

# Time limit in seconds for checking whether this node is registered. It is short, because the check is repeated soon
_LOOK_SECONDS = 5.0

SILENT_SECONDS, STILL_SILENT_SECONDS = 10.0, 2.0
"""A closing node gives up after this many seconds without a response from the master; the shorter limit applies if the
master was already silent before. There is no limit on the total time: the node waits for a busy master that still
responds.
"""

_CLOSING_CALL_SECONDS = 3600.0
_PROBE_SECONDS = 3.0  # seconds between a closing node's checks that the master still responds

NOTICE_SECONDS = 3.0  # seconds before a closing node logs that it is still waiting for the master

_MAX_CALLS_PER_MULTICALL = 100  # maximum number of unregistrations per system.multicall

_Part: TypeAlias = Publication | Subscription | ServiceServer
_Key: TypeAlias = tuple[str, str]
"""A registration's kind, named as in the master's methods ("Publisher"), and the name of its topic or service."""
_Call: TypeAlias = tuple[str, tuple[object, ...]]
"""A method of the Master API, and its arguments after the caller id."""


class Registrations:
    """One node's registrations with its master, and the calls that register them. Use it on the loop only."""

    def __init__(
        self,
        name: str,
        environment: Environment,
        tables: Mapping[str, Mapping[str, _Part]],
        rpc: AsyncRpcClient,
        workers: Workers,
        watch_seconds: float,
    ) -> None:
        """Create the object. ``tables`` maps a kind ("Publisher") to a dict from name to publication, subscription or service.

        Every ``watch_seconds`` :meth:`watch` checks whether the node is still registered with the master.
        """
        self.uri = ""
        self.service_uri = ""
        """The address of the node's services. Like the Slave API's address, it is set before the first registration."""
        self.parameters: set[str] = set()  # the parameters that the node has subscribed to
        self.when_registered_again: list[Callable[[], object]] = []
        """Functions that register additional state.

        The functions are called in workers when the node registers again with a master that had lost it.
        """

        self._name = name
        self._environment = environment
        self._tables = tables
        self.rpc = rpc
        # Runs when_registered_again in order. If no thread can be started, the functions stay queued, and the watch continues.
        self._again = InOrder(workers)
        self.watch_seconds = watch_seconds

        self._known: dict[_Key, _Part | None] = {}
        """The objects registered with the master, keyed by kind and name; None marks a call that failed or is in progress."""
        self.taken: set[_Key] = set()
        """Services that another node has registered after this node, so the master's entry is that node's."""
        self._turns: WeakValueDictionary[_Key, asyncio.Lock] = WeakValueDictionary()
        self._registering: set[asyncio.Task[None]] = set()
        self.watching: asyncio.Task[None] | None = None
        self._is_master_silent = False
        self._answered = 0.0  # time of the master's last response, on the loop's clock
        self._closed = False

    def watch(self) -> None:
        """Start checking whether the node is registered with the master."""
        self.watching = asyncio.ensure_future(self._watch_master())

    async def close(self, *, announces: bool) -> None:
        """Unregister everything, and refuse further registrations. Sends the first call to the master at once.

        Waits while the master continues to respond; does not wait if it refuses connections, and gives up if it sends no
        response for ``SILENT_SECONDS``. With ``announces``, a line is logged if this is slow.
        """
        self._closed = True
        if self.watching:
            self.watching.cancel()
        await self._unregister_all(announces=announces)

    async def cancel(self) -> None:
        """Cancel the registrations in progress, and the watch."""
        tasks = [*self._registering, *([self.watching] if self.watching else [])]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def call(self, method: str, *args: object) -> Any:
        """Call the master as the node and return the value in its response.

        Raise MasterUnreachableError if it does not respond, RpcRefused with the master's message if it refuses the call.
        """
        return unwrap(method, await self.call_master(method, self._name, *args))

    async def call_master(self, method: str, *args: object) -> object:
        """Call any method of the master. Raise MasterUnreachableError if it does not respond, RpcError if the call fails."""
        uri = self._environment.master_uri
        # While the node closes, _wait_for_answers() decides when to give up.
        seconds = _CLOSING_CALL_SECONDS if self._closed else _CALL_SECONDS
        try:
            answer = await self.rpc.call(uri, method, *args, timeout=seconds)
        except RpcUnreachable as error:
            self._is_master_silent = True
            raise master_unreachable(error) from error
        self._is_master_silent = False
        self._answered = asyncio.get_running_loop().time()
        return answer

    async def _look(self, method: str, name: str) -> object:
        """Ask the master for the address of this node or of one of its services.

        Raise MasterUnreachableError or RpcError if the look-up fails.
        """
        try:
            found: object = await asyncio.wait_for(self.call(method, name), _LOOK_SECONDS)
        except asyncio.TimeoutError as error:
            self._is_master_silent = True
            raise MasterUnreachableError(self._environment.master_uri) from error
        if self._closed:
            # Before Python 3.12, asyncio.wait_for may lose a cancellation that coincides with the response.
            raise asyncio.CancelledError
        return found

    def request_again(self, topic: str) -> None:
        """Register a subscription again, because the publishers last received from the master may be outdated."""
        key = ("Subscriber", topic)
        if self._known.get(key):
            self._known[key] = None
            self._start_registering(key)

    async def update(self, key: _Key, *, again: bool = False) -> None:
        """Make the master's registration of one name match this node: register, unregister, or do nothing.

        Calls for the same name are sequential, and none is cancelled half-way. Otherwise a registration could overtake the
        preceding unregistration, which would then remove it, or the node's shutdown could overtake a registration.
        """
        task = self._start_registering(key, again=again)
        try:
            await asyncio.shield(task)
        except asyncio.CancelledError as error:
            if not task.cancelled():
                raise
            # close() has stopped waiting for the master.
            raise MasterUnreachableError(self._environment.master_uri) from error

    def _start_registering(self, key: _Key, *, again: bool = False) -> asyncio.Task[None]:
        task = asyncio.ensure_future(self._register_in_turn(key, again=again))
        self._registering.add(task)
        task.add_done_callback(self._has_registered)
        return task

    def _has_registered(self, task: asyncio.Task[None]) -> None:
        self._registering.discard(task)
        if not task.cancelled():
            # Retrieve the task's exception, because asyncio logs exceptions that are never retrieved.
            # If a caller is waiting, it receives the exception as well. If not, ignore it, because the call will be retried.
            task.exception()

    async def _register_in_turn(self, key: _Key, *, again: bool) -> None:
        async with self._turns.setdefault(key, asyncio.Lock()):
            part = self._wanted(key)
            if part is not None and self._known.get(key) is not part:
                self._known[key] = None
                self.taken.discard(key)
                await self._register(part, again=again)
                self._known[key] = part
            elif part is None and key in self._known:
                self._known[key] = None
                method, args = self._unregistration(key)
                await self.call(method, *args)
                # The check after a master's restart may already have removed the entry.
                self._known.pop(key, None)

    def _wanted(self, key: _Key) -> _Part | None:
        """Return the object to register for one name, or None if there is none."""
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

        A publisherUpdate arrives on another connection and may overtake the response, whose list is then older. Therefore
        the call is repeated if an update has arrived in the meantime.
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
        """Detect that the master has restarted and lost this node, and register again.

        Looks up one of this node's services, if it has any: the node's name may be in a restarted master already, from
        a topic registered later. The master's process id proves nothing, because it is always the same in containers,
        and a restarted master may have recovered its tables.
        """
        failures = 0
        while not self._closed:
            await asyncio.sleep(self.watch_seconds)
            if not (self._known or any(self._tables.values())):
                continue

            known = [key for key, part in self._known.items() if part and key not in self.taken]
            asked = next((key for key in known if key[0] == "Service"), known[0] if known else None)
            has_forgotten = False
            try:
                if asked and asked[0] == "Service":
                    if await self._look("lookupService", asked[1]) != self.service_uri:
                        # As in ROS, a service belongs to the node that registered it last.
                        # The master's entry therefore says nothing about this node's registration.
                        self.taken.add(asked)
                        continue
                else:
                    await self._look("lookupNode", self._name)
            except MasterUnreachableError as error:
                failures += 1
                if failures == 2:
                    _log.warning("%s. What is connected goes on; will keep trying.", error)
                continue
            except RpcRefused:
                # A missing entry proves nothing if the name has been unregistered since the look-up started.
                # It also proves nothing for an illegal name, which the master always refuses.
                if asked and (asked[0] == "Service" or is_legal_name(self._name)):
                    has_forgotten = self._known.get(asked) is not None
            except RpcError as error:
                _log.debug("looking up this node: %s", error)
                continue

            failures = 0
            if has_forgotten:
                self._known.clear()
            with contextlib.suppress(MasterUnreachableError):
                await self.register_all(again=has_forgotten)
            if has_forgotten and any(self._known.values()):
                _log.warning("the master at %s has restarted: registered again", self._environment.master_uri)
                for function in self.when_registered_again:
                    self._again.start(function)
            elif has_forgotten:
                # Logged only once per master: with nothing left in _known, the node counts as never registered with it.
                _log.warning("the master does not know this node, and refuses to")

    async def register_all(self, *, again: bool = False) -> None:
        """Register everything that the master lacks. Raise MasterUnreachableError if the master does not respond."""
        keys = [(kind, name) for kind, table in self._tables.items() for name in table]
        for key in dict.fromkeys([*keys, *self._known]):
            if key in self.taken and self._wanted(key):
                continue
            # One registration that the master always refuses must not block the other registrations.
            try:
                await self.update(key, again=again)
            except RpcError as error:
                _log.debug("registering %s: %s", key, error)

    async def _unregister_all(self, *, announces: bool) -> None:
        """Unregister everything that the node has registered with the master, in as few calls as possible."""
        # If a call for a name is in progress, unregister the name after that call, which could otherwise register it again.
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
        """Wait for the last calls to the master to finish, but give up if the master stops responding.

        If many nodes shut down together, the calls of each are queued at the master. The master's response to a short
        call, which even a busy master handles quickly, shows that it is alive.
        """
        loop = asyncio.get_running_loop()
        uri = self._environment.master_uri
        patience = STILL_SILENT_SECONDS if self._is_master_silent else SILENT_SECONDS
        text = "waiting for the master at %s to unregister this node; it is given up when it answers nothing for %g s"
        notice = loop.call_later(NOTICE_SECONDS, _log.warning, text, uri, patience) if announces else None

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
            await self.call_master("getPid", self._name)

    async def _call_all(self, calls: Sequence[_Call]) -> None:
        """Make all calls, ignoring their results. Batch them if the master supports system.multicall.

        Raise MasterUnreachableError if the master does not respond.
        """
        for start in range(0, len(calls), _MAX_CALLS_PER_MULTICALL):
            part = calls[start : start + _MAX_CALLS_PER_MULTICALL]
            batch = [{"methodName": method, "params": [self._name, *args]} for method, args in part]
            answers: object = None
            if len(part) > 1:
                with contextlib.suppress(RpcFault, RpcProtocolError):
                    answers = await self.call_master("system.multicall", batch)
            if not isinstance(answers, list) or len(answers) != len(part):
                answers = [None] * len(part)
            for (method, args), answer in zip(part, answers, strict=True):
                # If the batch fails, for example because it is too long, make the calls one by one.
                if not isinstance(answer, list):
                    with contextlib.suppress(RpcFault, RpcProtocolError, RpcRefused):
                        await self.call(method, *args)
