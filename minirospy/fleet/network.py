"""A gateway's Zenoh session, with its tokens, messages and queries. No other module calls Zenoh.

Zenoh's callbacks run in Zenoh's own threads. This module calls its handlers on the event loop, except for messages, which
are queued first. Calls to Zenoh may block, so they all run, in order, in a single thread, or in the thread for a priority
(:mod:`sender`).
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import functools
import importlib
import json
import logging
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import TypeVar

from minirospy.aio.tasks import ErrorReporter, keep_running
from minirospy.base.errors import BridgeError, MinirospyError
from minirospy.base.escape import escaped
from minirospy.fleet.rules import Priority
from minirospy.zenoh.library import (
    DEFAULT_ENDPOINT,
    DEFAULT_PORT,
    Declared,
    EndpointError,
    NetworkOptions,
    Outlet,
    Query,
    Reply,
    Sample,
    Session,
    configured,
    is_loopback_endpoint,
    one_line,
    require_zenoh,
    to_endpoint,
    unresolved,
)
from minirospy.zenoh.linger import LingerRemover

__all__ = [
    "DEFAULT_ENDPOINT",
    "DEFAULT_PORT",
    "Beacon",
    "Declared",
    "EndpointError",
    "FleetNetwork",
    "NetworkOptions",
    "Outlet",
    "QueryFailed",
    "is_loopback_endpoint",
    "require_zenoh",
    "to_endpoint",
]

_log = logging.getLogger(__name__)
_T = TypeVar("_T")

# maximum size in bytes of a query or reply, such as a service's response or a definition
MAX_TEXT = 16 << 20
# maximum number of replies to a query: peers could send any number, and a fleet has at most 5,000 gateways
MAX_REPLIES = 10_000
# a query that ends without a reply before this fraction of its timeout has lost its link
EARLY_SHARE = 0.9
RETRY_SECONDS = 1.0
LINGER_SECONDS = 2.0
MAX_QUERIES = 200
"""Maximum number of concurrent service calls and parameter queries; further ones are rejected."""
MAX_CONTROL_QUERIES = 50
"""Maximum number of concurrent pings, status queries and definition queries.

The limit is separate so that blocked service calls do not delay them.
"""


# --- the network


async def _remove_linger() -> None:
    """Remove SO_LINGER from all of Zenoh's links every LINGER_SECONDS, which is less than the links' lease of 10 s."""
    remover = LingerRemover()
    while True:
        remover.look()
        await asyncio.sleep(LINGER_SECONDS)


class QueryFailed(MinirospyError):
    """Raised if a query gets no reply, or an error in reply."""


class FleetNetwork:
    """A Zenoh session, created by :meth:`open`. Handlers are called on the event loop on which :meth:`open` was called."""

    def __init__(
        self, session: Session, loop: asyncio.AbstractEventLoop, *, has_many_links: bool = False
    ) -> None:
        self._session = session
        self._loop = loop
        self._zenoh = importlib.import_module("zenoh")
        # A single thread preserves the order of the calls, and therefore of the declarations that peers see.
        self._caller = concurrent.futures.ThreadPoolExecutor(1, "fleet-calls")
        self._answering: set[asyncio.Task[None]] = set()
        self._calls = _Share(MAX_QUERIES)
        self._control = _Share(MAX_CONTROL_QUERIES)
        self._is_closed = False
        self._reporter = ErrorReporter(_log, "taking a message or query of the fleet")
        reporter = ErrorReporter(_log, "the search for links of Zenoh")
        self._lingering = (
            asyncio.ensure_future(keep_running(_remove_linger, reporter)) if has_many_links else None
        )

    @classmethod
    async def open(cls, options: NetworkOptions, *, waits: bool = True) -> FleetNetwork:
        """Open a session; if ``waits``, retry until a peer is reached.

        Raise BridgeError if the configuration is invalid, or if there is no peer and ``waits`` is false.
        """
        has_many_links = bool(options.listen or options.config)
        require_zenoh(has_many_links=has_many_links)
        zenoh = importlib.import_module("zenoh")
        loop = asyncio.get_running_loop()
        config = configured(options)
        endpoints = ", ".join(json.loads(config.get_json("connect/endpoints") or "[]"))
        is_reported = False

        while True:
            try:
                session = await loop.run_in_executor(None, functools.partial(zenoh.open, config))
                return cls(session, loop, has_many_links=has_many_links)
            except zenoh.ZError as error:
                text = one_line(error)
                if "Unable to connect" not in text:
                    raise BridgeError(f"the fleet's network cannot be opened: {text}") from error
                unknown = await loop.run_in_executor(
                    None, unresolved, json.loads(config.get_json("connect/endpoints") or "[]")
                )
                why = f" ({', '.join(map(escaped, unknown))} does not resolve)" if unknown else ""
                if not waits:
                    raise BridgeError(
                        f"nothing of the fleet answers at {endpoints}{why}: give --connect, or start `minirospy fleet router`"
                    ) from error
            if not is_reported:
                _log.warning("nothing of the fleet answers at %s yet%s. Will keep trying.", endpoints, why)
                is_reported = True
            await asyncio.sleep(RETRY_SECONDS)

    @property
    def peers(self) -> int:
        """Return the number of connected routers and gateways."""
        if self._is_closed:
            return 0
        return len(self._session.info.routers_zid()) + len(self._session.info.peers_zid())

    async def close(self) -> None:
        """Close the session and all its declarations. Idempotent."""
        if self._is_closed:
            return
        self._is_closed = True
        tasks = [*self._answering, *([self._lingering] if self._lingering else [])]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        # Undeclaring fails on a broken link, but the peer then detects the loss itself.
        with contextlib.suppress(self._zenoh.ZError):
            await self._loop.run_in_executor(self._caller, self._session.close)
        self._caller.shutdown(wait=False)

    # --- tokens

    def declare_token(self, key: str) -> Deferred:
        """Declare a liveliness token."""
        return self._declare(lambda: self._session.liveliness().declare_token(key))

    def watch_tokens(self, pattern: str, changed: Callable[[str, bool], object]) -> Deferred:
        """Call ``changed(key, is_there)`` for each existing token, and whenever a token appears or disappears."""
        put = self._zenoh.SampleKind.PUT

        def arrived(sample: Sample) -> None:
            self._soon(changed, str(sample.key_expr), sample.kind == put)

        return self._declare(
            lambda: self._session.liveliness().declare_subscriber(
                pattern, self._direct(arrived), history=True
            )
        )

    async def tokens(self, pattern: str, seconds: float) -> list[str]:
        """Query existing tokens for at most ``seconds``; return their keys."""
        found: list[str] = []

        def arrived(reply: Reply) -> bool:
            if reply.ok is not None and len(found) < MAX_REPLIES:
                found.append(str(reply.ok.key_expr))
            return len(found) >= MAX_REPLIES

        await self._collected(
            lambda handler: self._session.liveliness().get(pattern, handler, timeout=seconds), arrived
        )
        return list(found)

    # --- messages

    def subscribe(
        self, key: str, deliver: Callable[[str, bytes, bytes], object], *, from_others: bool = False
    ) -> Deferred:
        """Call ``deliver(key, message, attachment)`` for each message, in one of Zenoh's threads; ``deliver`` must not block.

        If ``from_others``, ignore messages from this session.
        """
        options = {"allowed_origin": self._zenoh.Locality.REMOTE} if from_others else {}

        def arrived(sample: Sample) -> None:
            attachment = sample.attachment
            try:
                deliver(
                    str(sample.key_expr),
                    sample.payload.to_bytes(),
                    attachment.to_bytes() if attachment else b"",
                )
            except Exception as error:  # noqa: BLE001 - otherwise Zenoh would print the error, or end its thread
                self._reporter.report(error)

        return self._declare(lambda: self._session.declare_subscriber(key, self._direct(arrived), **options))

    def watch_matching(self, key: str, changed: Callable[[bool], object]) -> Deferred:
        """Call ``changed(is_there)`` when a key gets its first subscriber in another session, and when it loses the last one."""

        def declare() -> Declared:
            publisher = self._session.declare_publisher(key, **self._to_others)
            listener = publisher.declare_matching_listener(
                self._direct(lambda status: self._soon(changed, status.matching))
            )
            if publisher.matching_status.matching:
                self._soon(changed, True)
            return _Together(listener, publisher)

        return self._declare(declare)

    def beacon(self, key: str) -> Beacon:
        """Return a publisher of empty messages to other sessions, with the lowest priority."""
        zenoh = self._zenoh
        return Beacon(
            self._caller,
            lambda: self._session.declare_publisher(
                key,
                priority=zenoh.Priority.BACKGROUND,
                congestion_control=zenoh.CongestionControl.DROP,
                reliability=zenoh.Reliability.BEST_EFFORT,
                **self._to_others,
            ),
            zenoh.ZError,
        )

    @property
    def _to_others(self) -> dict[str, object]:
        return {"allowed_destination": self._zenoh.Locality.REMOTE}

    def outlet_to_others(self, key: str, priority: Priority) -> Outlet:
        """Return a publisher like :meth:`outlet`, except that this session does not receive its own messages."""
        return self.outlet(key, priority, **self._to_others)

    def outlet(self, key: str, priority: Priority, **options: object) -> Outlet:
        """Return a publisher for a key, created with Zenoh's ``options``.

        This method and the publisher's ``put`` may block, so call both in a priority's thread.
        """
        zenoh = self._zenoh
        priorities = {
            Priority.TELEOP: zenoh.Priority.INTERACTIVE_HIGH,
            Priority.DATA: zenoh.Priority.DATA,
            Priority.BULK: zenoh.Priority.BACKGROUND,
        }
        return self._session.declare_publisher(
            key,
            priority=priorities[priority],
            congestion_control=zenoh.CongestionControl.BLOCK,
            express=priority is Priority.TELEOP,
            **options,
        )

    # --- queries

    def answer(
        self,
        pattern: str,
        handler: Callable[[str, bytes], Awaitable[bytes]],
        *,
        is_control: bool = False,
        from_others: bool = False,
    ) -> Deferred:
        """Declare a queryable for ``pattern`` that replies with the results of ``handler``.

        ``handler(key, request)`` returns the reply, or raises MinirospyError with the reason for a refusal.
        Set ``is_control`` for the fleet's own queries, whose handlers never wait for user nodes. If ``from_others``, ignore
        queries from this session.
        """
        options = {"allowed_origin": self._zenoh.Locality.REMOTE} if from_others else {}
        share = self._control if is_control else self._calls
        # The key to reply under, even if the query has wildcards; "" means the query's key.
        key = "" if "*" in pattern else pattern

        def arrived(query: Query) -> None:
            self._soon(self._start_answer, query, handler, share, key)

        return self._declare(
            lambda: self._session.declare_queryable(pattern, self._direct(arrived), complete=True, **options)
        )

    async def query(
        self, key: str, request: bytes = b"", *, seconds: float, of_others: bool = False
    ) -> bytes:
        """Send a query and return the first reply. Raise QueryFailed if there is no reply, or if the reply is an error.

        If ``of_others``, query only other sessions; if several sessions match, query the best match.
        """
        options = {"target": self._zenoh.QueryTarget.BEST_MATCHING, **self._to_others} if of_others else {}
        started = self._loop.time()
        found = await self.queries(key, request, seconds=seconds, most=1, **options)
        if not found:
            waited = self._loop.time() - started
            if waited < EARLY_SHARE * seconds:
                raise QueryFailed(f"no answer: nobody answers there, or the link broke after {waited:.1f} s")
            raise QueryFailed(f"no answer within {seconds:g} s")
        answer = next(iter(found.values()))
        if isinstance(answer, QueryFailed):
            raise answer
        return answer

    async def queries(
        self,
        pattern: str,
        request: bytes = b"",
        *,
        seconds: float,
        most: int = MAX_REPLIES,
        size: int = MAX_TEXT,
        **options: object,
    ) -> Mapping[str, bytes | QueryFailed]:
        """Return a dict from key to at most ``most`` replies. An error, or a reply above ``size`` bytes, is a QueryFailed.

        Zenoh's ``options`` override the defaults. Return as soon as ``most`` replies have arrived, without waiting for more.
        """
        found: dict[str, bytes | QueryFailed] = {}

        def arrived(reply: Reply) -> bool:
            if len(found) >= most:
                return True
            if reply.ok is not None:
                is_short = len(reply.ok.payload) <= size
                answer = (
                    reply.ok.payload.to_bytes()
                    if is_short
                    else QueryFailed(f"the answer has more than {size} bytes")
                )
                found.setdefault(str(reply.ok.key_expr), answer)
            elif reply.err is not None:
                text = reply.err.payload.to_bytes()[:2000].decode(errors="replace")
                found.setdefault("", QueryFailed(escaped(text)))
            return len(found) >= most

        zenoh = self._zenoh
        await self._collected(
            lambda handler: self._session.get(
                pattern,
                handler,
                payload=request,
                timeout=seconds,
                **{
                    "target": zenoh.QueryTarget.ALL,
                    # Zenoh's default would withhold all replies until the last one has arrived or the timeout has expired.
                    "consolidation": zenoh.ConsolidationMode.NONE,
                    "priority": zenoh.Priority.DATA_HIGH,
                    "congestion_control": zenoh.CongestionControl.BLOCK,
                    **options,
                },
            ),
            arrived,
        )
        return dict(found)

    # --- internal

    async def _collected(self, start: Callable[[object], object], arrived: Callable[[Reply], bool]) -> None:
        """Start a query. Return after the last reply, or as soon as ``arrived`` returns True."""
        if self._is_closed:
            raise QueryFailed("the gateway is closed")
        ended = asyncio.Event()

        def replied(reply: Reply) -> None:
            if arrived(reply):
                self._soon(ended.set)

        handler = self._zenoh.handlers.Callback(replied, lambda: self._soon(ended.set), indirect=False)
        try:
            await self._loop.run_in_executor(self._caller, start, handler)
        except self._zenoh.ZError as error:
            raise QueryFailed(one_line(error)) from error
        await ended.wait()

    def _declare(self, declare: Callable[[], Declared]) -> Deferred:
        return Deferred(self._caller, declare, self._zenoh.ZError)

    def _direct(self, function: Callable[..., object]) -> object:
        """Return a handler that Zenoh calls in its own thread. By default, Zenoh would start one more thread per handler."""
        return self._zenoh.handlers.Callback(function, indirect=False)

    def _start_answer(
        self, query: Query, handler: Callable[[str, bytes], Awaitable[bytes]], share: _Share, key: str = ""
    ) -> None:
        # Check the limit here, because a burst creates all its tasks before the first one runs.
        is_full = len(share.tasks) >= share.limit
        refusal = f"the gateway is answering {share.limit} other queries" if is_full else ""
        task = asyncio.ensure_future(self._answer(query, handler, key, refusal))
        for tasks in [self._answering] if is_full else [self._answering, share.tasks]:
            tasks.add(task)
            task.add_done_callback(tasks.discard)

    async def _answer(
        self,
        query: Query,
        handler: Callable[[str, bytes], Awaitable[bytes]],
        own_key: str = "",
        refusal: str = "",
    ) -> None:
        key, payload = str(query.key_expr), query.payload
        reply: Callable[[], object] | None = None
        try:
            if refusal:
                raise QueryFailed(refusal)
            if payload is not None and len(payload) > MAX_TEXT:
                raise QueryFailed(f"the request has more than {MAX_TEXT} bytes")
            body = await handler(key, payload.to_bytes() if payload is not None else b"")
            reply = functools.partial(query.reply, own_key or query.key_expr, body)
        except MinirospyError as error:
            reply = functools.partial(query.reply_err, str(error).encode(errors="replace"))
        except Exception as error:  # noqa: BLE001 - the peer needs a reply, even after an error
            self._reporter.report(error)
            reply = functools.partial(query.reply_err, f"the gateway failed: {type(error).__name__}".encode())
        finally:
            if reply is None:
                query.drop()

        try:
            with contextlib.suppress(RuntimeError, self._zenoh.ZError):
                await self._loop.run_in_executor(self._caller, reply)
        finally:
            query.drop()

    def _soon(self, function: Callable[..., object], *arguments: object) -> None:
        """Schedule a function on the loop, from any thread."""
        with contextlib.suppress(RuntimeError):
            self._loop.call_soon_threadsafe(function, *arguments)


@dataclass(eq=False)
class _Share:
    """The running handlers for one kind of query, and their maximum number."""

    limit: int
    tasks: set[asyncio.Task[None]] = field(default_factory=set)


class Deferred:
    """A Zenoh entity that is declared and later undeclared in the background."""

    def __init__(
        self, caller: concurrent.futures.Executor, declare: Callable[[], Declared], fault: type[Exception]
    ) -> None:
        self._caller = caller
        self._fault = fault
        self._declared: Declared | None = None
        with contextlib.suppress(RuntimeError):
            caller.submit(self._declare, declare)

    def undeclare(self) -> None:
        """Undeclare the entity in the background. Idempotent."""
        with contextlib.suppress(RuntimeError):
            self._caller.submit(self._undeclare)

    def _declare(self, declare: Callable[[], Declared]) -> None:
        try:
            self._declared = declare()
        except self._fault as error:
            _log.debug("not declared: %s", error)

    def _undeclare(self) -> None:
        declared, self._declared = self._declared, None
        if declared is not None:
            with contextlib.suppress(self._fault):
                declared.undeclare()


@dataclass(frozen=True)
class _Together:
    """Two declarations that are undeclared at the same time."""

    first: Declared
    second: Declared

    def undeclare(self) -> None:
        self.first.undeclare()
        self.second.undeclare()


class Beacon:
    """A publisher of empty messages; created by :meth:`FleetNetwork.beacon`."""

    def __init__(
        self, caller: concurrent.futures.Executor, declare: Callable[[], Outlet], fault: type[Exception]
    ) -> None:
        self._outlet: Outlet | None = None
        self._caller = caller
        self._fault = fault
        self._is_waiting = False

        def opened() -> Declared:
            self._outlet = declare()
            return self._outlet

        self._declared = Deferred(caller, opened, fault)

    def put(self) -> None:
        """Send an empty message in the background, unless the previous one is still pending."""
        if not self._is_waiting:
            self._is_waiting = True
            with contextlib.suppress(RuntimeError):
                self._caller.submit(self._put)

    def undeclare(self) -> None:
        """Undeclare the publisher in the background. Idempotent."""
        self._declared.undeclare()

    def _put(self) -> None:
        self._is_waiting = False
        if self._outlet:
            with contextlib.suppress(self._fault):
                self._outlet.put(b"")
