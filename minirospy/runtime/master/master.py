"""The master: its server, its calls to nodes, its journal, and the check for dead nodes after it replaces a killed master.

``core/graph/master_api.py`` computes the responses.
"""

from __future__ import annotations

import asyncio
import gc
import logging
import os
import re
import socket
import time
from collections.abc import Mapping, Sequence, Sized
from pathlib import Path
from typing import TYPE_CHECKING

import minirospy
from minirospy.base.closing import close_all
from minirospy.base.errors import MinirospyError, RpcError, RpcUnreachable
from minirospy.base.heap import return_large_blocks
from minirospy.base.steps import ALONE, Steps, finish
from minirospy.core.graph.calls import Answer
from minirospy.core.graph.master_api import MasterApi, Notice, nothing
from minirospy.core.graph.parameters import ParameterTree, ParameterUpdate
from minirospy.core.graph.registry import NodeShutdown, PublisherUpdate, Registry
from minirospy.core.wire.http import MAX_BODY
from minirospy.core.wire.xmlrpc import Serialized, serialize_response_in_steps
from minirospy.runtime.master.dead_nodes import find_dead
from minirospy.runtime.master.notifier import Notifier
from minirospy.runtime.master.replay import Replay, changes_to, forget_node
from minirospy.runtime.rpc.async_client import AsyncRpcClient
from minirospy.runtime.rpc.server import RpcServer
from minirospy.runtime.transport.access import Access
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

if TYPE_CHECKING:
    from minirospy.runtime.master.journal import Journal, Left
    from minirospy.runtime.node.node import Node

__all__ = ["Master"]

_log = logging.getLogger(__name__)

_CHECK_SECONDS = 3.0
_CHECK_TRIES = 3
_MAX_CONCURRENT_CHECKS = 100
QUICK_CHECK_SECONDS = 1.0
_TOUCH_SECONDS = 30.0
LOCK_SECONDS = 3.0
# Seconds between attempts to lock the journal: the system may release a killed master's port before the journal's lock
_LOCK_PAUSE = 0.02

# maximum age in seconds of a killed master's journal for a new master to resume its session
_RESTART_SECONDS = 600.0

_COLLECT_SECONDS = 60.0
_COLLECT = (2000, 5, 1_000_000_000)
"""The garbage collector's thresholds.

It examines at most 10,000 objects, in about 4 ms; the oldest generation is not collected automatically.
"""

SWEEP_SECONDS = 10.0  # seconds between checks for dead nodes if the master is nearly full
_MAX_FORGOTTEN_PER_ITERATION = 20  # maximum number of dead nodes to remove per loop iteration

_OWN_NODE = "/rosout"


class Master(MasterApi):
    """A ROS master at ``http://host:port/``, listening on ``bind_host``; port 0 means any free port."""

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
        max_clients: int = 4000,
        same_host: bool = True,
        owns_process: bool = False,
    ) -> None:
        """Create the master.

        ``journal`` is the file that stores its state (None: no file); ``fresh`` discards the state in it. ``timeout``:
        seconds that a node has to respond to a call. ``same_host``: use Unix sockets for connections from and to
        processes on this machine. ``owns_process``: the process runs only the master, which may tune the garbage
        collector.
        """
        super().__init__()
        self.host = host
        self.calls = 0
        # The serialized response to getSystemState, and the registry's change count at that time.
        self._state = (-1, Serialized(()))
        # Messages to show the user at startup: what was recovered, and what could not be.
        self.news: list[str] = []
        self._started = time.monotonic()
        self._journal_path = journal
        self._fresh = fresh
        self._journal: Journal | None = None
        self._same_host = same_host
        self._owns_process = owns_process
        self.server = RpcServer(
            self.serve,
            bind_host=bind_host,
            port=port,
            max_idle=max_clients,
            access=access,
            known_as=_names_of(host, bind_host) if same_host else (),
        )
        self.notifier = Notifier(self, self.server.turns, timeout, same_host=same_host)
        self._replaced = RateLimitedLogger(_log, 10)
        self.checking: asyncio.Task[None] | None = None
        self.touching: asyncio.TimerHandle | None = None
        self._collecting: asyncio.TimerHandle | None = None
        self._sweeping: asyncio.Task[None] | None = None
        self.stopped = asyncio.Event()  # set once the master has been asked to stop

    @property
    def port(self) -> int:
        """The port that the master listens on."""
        return self.server.port

    @property
    def uri(self) -> str:
        """Return the value for ROS_MASTER_URI."""
        return f"http://{self.host}:{self.port}/"

    @property
    def session(self) -> str:
        """The /run_id of the continued session; "" if the session is new."""
        found = self.parameters.get("/run_id") if self.parameters.has("/run_id") else ""
        # Any node may have set the id, and it becomes a folder name, so accept only harmless characters.
        return found if isinstance(found, str) and re.fullmatch(r"[\w-]{1,64}", found) else ""

    @property
    def omits_topics(self) -> bool:
        """Return whether the parameter /rosout/omit_topics makes rosout.log omit the topic lists."""
        key = "/rosout/omit_topics"
        return self.parameters.has(key) and self.parameters.get(key) is True

    async def start(self) -> None:
        """Bind the port, recover a killed master's state, and start serving. Raise OSError if the port cannot be bound."""
        # Bind the port first: if two masters start together, the one that gets the port also gets the journal.
        self.server.listen()
        try:
            nodes = await self._open_journal() if self._journal_path else {}
            await self.server.start()
        except BaseException:
            await self.server.close()
            if self._journal:
                self._journal.close()
            raise
        if self._owns_process:
            return_large_blocks()
            self._collect()
        if nodes:
            self.checking = asyncio.ensure_future(self._check(nodes))
        self._sweeping = asyncio.ensure_future(self._sweep())

    async def close(self, *, keep_journal: bool = False) -> None:
        """Stop the master and remove the journal, so that the next master starts empty. Idempotent.

        With ``keep_journal`` the next master continues this session.
        """
        for task in (self.checking, self._sweeping):
            if task:
                task.cancel()
                await asyncio.gather(task, return_exceptions=True)
        for timer in (self.touching, self._collecting):
            if timer:
                timer.cancel()
        await close_all([self.server.close, self.notifier.close, self._replaced.close])
        self.record = nothing
        if self._journal:
            if keep_journal:
                self._journal.close()
            else:
                self._journal.remove()

    def attach(self, node: Node) -> None:
        """From now on, report publishers to ``node``, which runs on this loop, by a direct call instead of XML-RPC."""
        self.notifier.here[node.uri] = node.publishers_changed

    def serve(self, method: str, args: Sequence[object]) -> object:
        """Return the response to one call from a client, possibly already serialized.

        Raise RpcFault as :meth:`dispatch` does, if the method is unknown.
        """
        self.calls += 1
        if method == "getSystemState" and len(args) == 1 and isinstance(args[0], str):
            if self._state[0] == self.registry.changes:
                return self._state[1]
            steps = self._write_state()
            return finish(steps) if self.registry.is_small else steps
        return self.dispatch(method, args)

    def _write_state(self) -> Steps[Serialized]:
        """Return the serialized system state, from the cache if it is current.

        The state is cached, because serializing it is slow and tools request it often.
        """
        if self.registry.is_large:
            yield ALONE
        if self._state[0] == self.registry.changes:
            # While this request was queued, another client's request has serialized the state.
            return self._state[1]

        changes = self.registry.changes
        answer = yield from self.collect_system_state()
        pieces = yield from serialize_response_in_steps(answer, MAX_BODY)
        state = Serialized(pieces)
        if changes == self.registry.changes:
            self._state = (changes, state)
        return state

    def notify(self, action: Notice) -> None:
        """Send a notification to the node that it is for."""
        if isinstance(action, NodeShutdown):
            self.parameters.unsubscribe_node(action.name, action.uri)
            self._replaced.warning("another node took the name %s: %s is stopped", action.name, action.uri)
        self.notifier.send(action)

    def publisher_uris(self, topic: str) -> list[str]:
        """Return the URIs of a topic's publishers."""
        return self.registry.publisher_uris(topic)

    def parameter(self, key: str) -> object:
        """Return a parameter's value, or {} if it is not set."""
        return self.parameters.get(key) if self.parameters.has(key) else {}

    def subscribed_parameters(self, uri: str) -> list[str]:
        """Return the parameter keys that the node at ``uri`` has subscribed to."""
        return self.parameters.subscribed_keys(uri)

    def defer(self, uri: str, topic: str) -> None:
        """See :meth:`Notifier.defer`."""
        self.notifier.defer(uri, topic)

    def stop(self) -> None:
        """Ask the master to stop."""
        self.stopped.set()

    def get_status(self, caller_id: str) -> Answer | Steps[Answer]:
        """Return this master's status, for `minirospy master --status`; not part of ROS's API."""

        def collect() -> Steps[Answer]:
            if self.parameters.is_large:
                yield ALONE
            return self._status((yield from self.parameters.names_in_steps()))

        return finish(collect()) if self.parameters.is_small else collect()

    def _status(self, parameters: Sized) -> Answer:
        types = self.registry.topic_types()

        return [
            1,
            "status",
            {
                "version": minirospy.__version__,
                "pid": os.getpid(),
                "uptime": time.monotonic() - self._started,
                "time": time.time(),
                "nodes": len(self.registry.nodes()),
                "topics": self.registry.count_topics(),
                "types": len(types),
                "services": self.registry.count_services(),
                "parameters": len(parameters),
                "calls": min(self.calls, 2**31 - 1),
                "clients": self.server.clients,
                "refused": self.server.refused,
                "journal": self._journal_line(),
            },
        ]

    # --- journal

    def _journal_line(self) -> str:
        if self._journal is None:
            return "none"
        if self._journal.trouble:
            return f"failing: {self._journal.trouble}"
        return f"{self._journal.path} ({self._journal.size} bytes)"

    async def _open_journal(self) -> dict[str, str]:
        """Recover the state from the journal and start writing the journal; return the nodes to check, keyed by name."""
        from minirospy.runtime.master.journal import RETRY_SECONDS, Journal, JournalBusyError

        assert self._journal_path
        journal = self._journal = Journal(
            self._journal_path,
            lambda: changes_to(self.registry, self.parameters),
            start_steps=self.server.turns.start,
        )
        busy: JournalBusyError | None = None
        try:
            await _lock(journal)
        except JournalBusyError as error:
            # Another master has locked the journal.
            busy = error
        except OSError:
            # Continue without the lock, because the journal may still be readable. Journal.start() tries again to lock it.
            pass

        if busy:
            self.news.append(f"no journal: {busy}, it is tried again every {RETRY_SECONDS:.0f} s")
        elif self._fresh:
            journal.discard()
        elif left := journal.read():
            await self._take_up(left)

        journal.start()
        if journal.trouble and not busy:
            self.news.append(
                f"no journal, a crash of the master would lose the graph: {self._journal_path} cannot be written: "
                f"{journal.trouble}; set ROS_HOME (it is tried again every {RETRY_SECONDS:.0f} s)"
            )
        self.record, self.store = journal.append, journal.store
        self.touch()
        return self.registry.nodes()

    async def _take_up(self, left: Left) -> None:
        recovered, age = left.recovered, left.age
        replay = Replay(self.registry, self.parameters)
        for record in recovered.records:
            try:
                replay.apply(*record)
            except (TypeError, ValueError, KeyError, MinirospyError) as error:
                self.news.append(f"journal: a record was left out: {error}")

        uri = self.registry.node_uri(_OWN_NODE)
        if uri:
            # The /rosout node exited with the master that ran it; this master starts its own.
            self.registry.forget(_OWN_NODE, uri)

        if recovered.damage:
            kept = f"a copy is kept as {left.copy}" if left.copy else "no copy of it could be written"
            self.news.append(
                f"journal: {recovered.damage}; recovered up to the last whole record "
                f"({len(recovered.records)} of them), {kept}"
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

    def _collect(self) -> None:
        """Restrict the garbage collector to young objects. If there are only few objects, collect all of them once in a while.

        Examining all objects would block a master with many registrations, which hardly ever has cyclic garbage.
        """
        gc.set_threshold(*_COLLECT)
        if not self.registry.is_large and not self.parameters.is_large:
            gc.collect()
        self._collecting = asyncio.get_running_loop().call_later(_COLLECT_SECONDS, self._collect)

    def touch(self) -> None:
        assert self._journal
        self._journal.touch()
        # An unchanged graph triggers no writes, so a failed write would never be retried.
        self._journal.retry()
        self.touching = asyncio.get_running_loop().call_later(_TOUCH_SECONDS, self.touch)

    # --- nodes of a killed master

    async def _anybody_lives(self, nodes: Mapping[str, str]) -> bool:
        rpc = AsyncRpcClient(same_host=self._same_host)
        calls = [_lives(rpc, name, uri, QUICK_CHECK_SECONDS) for name, uri in nodes.items()]
        try:
            return any(await asyncio.gather(*calls))
        finally:
            await rpc.close()

    async def _check(self, nodes: Mapping[str, str]) -> None:
        """Remove dead nodes, and send the other nodes the notifications that they may have missed."""
        rpc, slots = AsyncRpcClient(same_host=self._same_host), asyncio.Semaphore(_MAX_CONCURRENT_CHECKS)

        async def check(name: str, uri: str) -> bool:
            async with slots:
                lives = await _lives(rpc, name, uri, _CHECK_SECONDS, _CHECK_TRIES)
            if not lives:
                self._act(self._forget(name, uri))
                self.record("gone", name, uri)
                return False
            if self.registry.node_uri(name) == uri:
                self._act(PublisherUpdate(uri, topic) for topic in self.registry.subscriptions(name))
            return True

        try:
            found = await asyncio.gather(*(check(name, uri) for name, uri in nodes.items()))
            self._act(ParameterUpdate(uri, key) for _, uri, key in list(self.parameters.subscriptions()))
        finally:
            await rpc.close()
        _log.warning("of %s %d answer, the others are forgotten", _many(found, "recovered node"), sum(found))

    async def _sweep(self) -> None:
        """When the table of registrations is nearly full, remove the nodes whose ports refuse connections.

        Otherwise the master would stay full, because this master, like rosmaster, keeps a killed node's registrations.
        """
        while True:
            await asyncio.sleep(SWEEP_SECONDS)
            if not self.registry.is_crowded:
                continue
            rpc, count = AsyncRpcClient(same_host=self._same_host), 0
            try:
                async for name, uri in find_dead(rpc, self.registry.nodes()):
                    self.parameters.unsubscribe_node(name, uri)
                    actions = self.registry.forget(name, uri)
                    self.record("gone", name, uri)
                    self.server.turns.start(self.notify_in_steps(actions))
                    count += 1
                    if count % _MAX_FORGOTTEN_PER_ITERATION == 0:
                        await asyncio.sleep(0)
            finally:
                await rpc.close()
            _log.warning(
                "the registrations are nearly full: %d nodes that refuse connections are forgotten", count
            )

    def _forget(self, name: str, uri: str) -> list[Notice]:
        return forget_node(self.registry, self.parameters, name, uri)


async def _lock(journal: Journal) -> None:
    """Lock the journal, retrying for a moment if another process has locked it. The caller has bound the port."""
    from minirospy.runtime.master.journal import JournalBusyError

    end = time.monotonic() + LOCK_SECONDS
    while True:
        try:
            journal.lock()
        except JournalBusyError:
            if time.monotonic() >= end:
                raise
        else:
            return
        await asyncio.sleep(_LOCK_PAUSE)


async def _lives(rpc: AsyncRpcClient, name: str, uri: str, timeout: float, tries: int = 1) -> bool:
    """Return whether the node still responds at its URI. Any response counts, unless it gives another node's name."""
    for _ in range(tries):
        try:
            answer = await rpc.call(uri, "getName", "/master", timeout=timeout)
        except RpcUnreachable as error:
            if isinstance(error.__cause__, (ConnectionRefusedError, EOFError)):
                return False
        except RpcError:
            # roscpp has no getName and returns an error, so an error counts as a response.
            return True
        else:
            return not (
                isinstance(answer, list) and answer[:1] == [1] and answer[2:] not in ([name], [0], [""])
            )
    return False


def _many(things: Sized, name: str) -> str:
    return f"{len(things)} {name}" + ("" if len(things) == 1 else "s")


def _ago(seconds: float) -> str:
    for unit, name in ((86400.0, "days"), (3600.0, "hours"), (60.0, "minutes")):
        if seconds >= 2 * unit:
            return f"{seconds / unit:.0f} {name}"
    return f"{seconds:.0f} s"


def _names_of(host: str, bind_host: str) -> list[str]:
    """Return the host names that ROS_MASTER_URI may contain for a master that listens on ``bind_host``."""
    names = [host]
    if bind_host in {"127.0.0.1", "0.0.0.0", "::"}:
        names.append("localhost")
    if bind_host in {"0.0.0.0", "::"}:
        names.append(socket.gethostname())
    return names
