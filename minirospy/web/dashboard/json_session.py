"""Sessions of the page's endpoints: clients send operations and receive responses as JSON.

An operation is an object with its name, ``{"op": NAME, ...}``. If the client may not execute it, if the string is too long
or not an operation, or if the operation fails, the response is ``{"error": text}`` with one line of text. Operations
run one after another in a task of the session. The state that is sent to a client is read after changes, not at regular
intervals.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import math
import sys
import time
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, ClassVar, Generic, TypeVar

from minirospy.aio.tasks import PAUSE_SECONDS, ErrorReporter
from minirospy.base.errors import MinirospyError

if TYPE_CHECKING:
    from minirospy.web.server.client import WebClient

__all__ = ["Fields", "Handler", "JsonEndpoint", "JsonSession", "number", "text_of", "texts_of", "wait_until"]

_log = logging.getLogger(__name__)

_MAX_ERROR_LENGTH = 1000
_VALUE_FACTOR = 4
"""Bytes of memory that a parsed operation takes per byte of JSON text, measured for objects and lists of numbers."""

_INTERNAL_ERROR = 1011  # WebSocket close code for an internal error, RFC 6455, section 7.4.1

CLOCK_SECONDS = time.get_clock_info("monotonic").resolution
"""Resolution of the loop's clock in seconds: 16 ms on Windows before Python 3.13."""

_T = TypeVar("_T")
Fields = Mapping[str, object]
Handler = Callable[[Fields], Awaitable[object]]
"""Executes an operation; its result is sent to the client."""


class JsonSession:
    """The session of one client. Subclasses define the operations, and send changes in :meth:`follow`."""

    subject: ClassVar[str]
    """The subject of the operations, for error messages."""

    owners_only: ClassVar[str] = ""
    """The operations that require the token, as described in error messages; "" if other clients may use some of them."""

    longest: ClassVar[int] = 256_000
    """Maximum number of characters in an operation. Parsing delays all clients, so it must be short."""

    max_waiting: ClassVar[int] = 100
    pace: ClassVar[float] = 0.05  # minimum interval in seconds between calls of :meth:`follow`

    def __init__(self, client: WebClient, handlers: Mapping[str, Handler]) -> None:
        """Create the session. ``handlers`` maps the name of each operation to the function that executes it."""
        self.client = client
        self.is_ended = False
        self._handlers = handlers
        self._operations: deque[tuple[str, Fields, int]] = deque()
        """The queued operations: name, fields, and memory in bytes."""
        self._carried_out_size = 0  # memory used by the operations being executed, in bytes
        self._operation_size = 0  # memory used by the operation received last, in bytes
        self._thread = ThreadPoolExecutor(1, type(self).__name__)
        self._loop = asyncio.get_running_loop()
        self._wake = asyncio.Event()
        self._looked = -math.inf
        self._next_look = -math.inf
        self._is_change_posted = False
        self._has_failed = False
        self._reporter = ErrorReporter(_log, f"serving {self.subject}")
        self._task = asyncio.ensure_future(self._run())

    # --- overridden or called by subclasses

    def refusal(self) -> str:
        """Return why this client may not execute operations, or "" if it may."""
        if self.owners_only and not self.client.is_owner:
            return self.client.why_not_owner(self.owners_only)
        return ""

    def parse(self, fields: Fields) -> tuple[str, Fields]:
        """Split an operation into its name and its fields. Raise ValueError, TypeError or LookupError if it is invalid."""
        return str(fields["op"]), fields

    async def started(self) -> None:
        """Send the first messages of the session."""
        self.send({"writes": not self.refusal()})
        if self.owners_only and (why := self.refusal()):
            self.send_error(why)

    async def follow(self) -> float | None:
        """Send changes. Return the seconds until the next call, or None to wait for the next change."""
        return None

    async def left(self) -> None:
        """Release the client's resources after it has disconnected."""

    def dispatch(self, name: str, fields: Fields) -> None:
        """Queue an operation."""
        if len(self._operations) >= self.max_waiting:
            self.send_error("too many operations wait: this one was dropped", fields)
            return
        self._operations.append((name, fields, self._operation_size))
        self.count()
        self._wake.set()

    def count(self) -> None:
        """Count this client's memory towards the server's budget."""
        self.client.holds(self._carried_out_size + sum(size for _, _, size in self._operations))

    async def in_thread(self, work: Callable[[], _T]) -> _T:
        """Run a blocking function in the session's thread, after all functions submitted earlier."""
        return await self._loop.run_in_executor(self._thread, work)

    def send(self, fields: Fields) -> None:
        """Send these fields as a message."""
        self.client.send_text(json.dumps(fields))

    def send_error(self, text: str, fields: Fields | None = None) -> None:
        """Send an error message for the operation with ``fields``."""
        self.send({"error": text[:_MAX_ERROR_LENGTH]})

    def send_answer(self, answer: object, fields: Fields) -> None:
        """Send the result of the operation with ``fields``."""
        self.client.send_text(json.dumps(answer))

    # --- called by the client's connection

    def received_text(self, text: str) -> None:
        """Parse and queue an operation."""
        if why := self.refusal():
            self.send_error(why)
            return
        if len(text) > self.longest:
            self.send_error(f"an operation on {self.subject} has {self.longest} characters at most")
            return
        try:
            self._operation_size = _VALUE_FACTOR * sys.getsizeof(text)
            fields = json.loads(text)
            if not isinstance(fields, dict):
                raise TypeError("not an object")
            name, fields = self.parse(fields)
            if name not in self._handlers:
                raise ValueError(name[:80])
        except (ValueError, TypeError, LookupError, OverflowError, RecursionError) as error:
            self.send_error(f"not an operation on {self.subject}: {_line(error)}")
        else:
            self.dispatch(name, fields)

    def received_binary(self, data: bytes) -> None:
        """Report an error, because clients must not send binary messages."""
        self.send_error("binary messages have no meaning here")

    def ended(self) -> None:
        """End the session. Idempotent: a second call does not interrupt the release of resources."""
        if not self.is_ended:
            self.is_ended = True
            self._task.cancel()

    # --- changes

    def changed(self) -> None:
        """Schedule a call of :meth:`follow`. Must be called on the loop."""
        self._next_look = min(self._next_look, self._looked + self.pace)
        self._wake.set()

    def post_change(self) -> None:
        """Schedule a call of :meth:`follow`. May be called from any thread and at any rate."""
        if not self._is_change_posted:
            self._is_change_posted = True
            with contextlib.suppress(RuntimeError):  # the loop has been closed
                self._loop.call_soon_threadsafe(self.changed)

    # --- session task

    async def _run(self) -> None:
        try:
            await self.started()
            while True:
                self._wake.clear()
                while self._operations:
                    name, fields, self._carried_out_size = self._operations.popleft()
                    await self.carry_out(name, fields)
                    self._carried_out_size = 0
                    self.count()
                    self.changed()
                await self._look()
                if not self._operations:
                    await wait_until(self._wake, self._next_look)
        except Exception as error:  # noqa: BLE001 - the page connects again, and the fault is in the log
            self._reporter.report(error)
            self.client.close(_INTERNAL_ERROR, "the dashboard failed: its terminal shows why")
        finally:
            try:
                await self.left()
            except Exception as error:  # noqa: BLE001 - nobody is there to be notified
                self._reporter.report(error)
            self._thread.shutdown(wait=False)

    async def _look(self) -> None:
        now = self._loop.time()
        if now < self._next_look:
            return
        self._looked, self._next_look = now, math.inf
        self._is_change_posted = False
        if not (self.owners_only and self.refusal()):
            try:
                pause = await self.follow()
                self._has_failed = False
            except Exception as error:  # noqa: BLE001 - it may succeed the next time; until then the page says so
                self._reporter.report(error)
                if not self._has_failed:
                    # Send only the type of an unexpected error: its message may contain details that clients must not see.
                    why = (
                        _line(error) if isinstance(error, MinirospyError | OSError) else type(error).__name__
                    )
                    self.send_error(f"the dashboard failed to show {self.subject}: {why}")
                self._has_failed = True
                pause = PAUSE_SECONDS
            if pause is not None:
                self._next_look = min(self._next_look, now + pause)

    async def carry_out(self, name: str, fields: Fields) -> None:
        """Execute an operation; send its result or its error."""
        try:
            answer = await self._handlers[name](fields)
        except (MinirospyError, OSError) as error:
            self.send_error(_line(error), fields)
        except (ValueError, TypeError, LookupError, OverflowError, RecursionError) as error:
            self.send_error(f"not an operation on {self.subject}: {name}: {_line(error)}", fields)
        except Exception as error:  # noqa: BLE001 - the page waits for the answer, whatever happened here
            self._reporter.report(error)
            self.send_error(f"the dashboard failed on this operation: {type(error).__name__}", fields)
        else:
            if answer is not None:
                self.send_answer(answer, fields)


_S = TypeVar("_S", bound=JsonSession)


class JsonEndpoint(Generic[_S]):
    """Serves a WebSocket sub-protocol: calls ``session`` to create the session of each client."""

    def __init__(self, subprotocol: str, session: Callable[[WebClient], _S]) -> None:
        self.sessions: set[_S] = set()
        self._subprotocol = subprotocol
        self._session = session
        self.is_closed = False
        self._tasks: set[asyncio.Task[None]] = set()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._is_change_posted = False

    def select(self, offered: Sequence[str]) -> str:
        """Choose one of the offered sub-protocols. Raise LookupError if none of ``offered`` is supported."""
        if self._subprotocol in offered:
            return self._subprotocol
        raise LookupError(f"sub-protocol {self._subprotocol} is required")

    def open(self, client: WebClient) -> _S:
        """Start serving a client."""
        self._loop = asyncio.get_running_loop()
        session = self._session(client)
        self.sessions.add(session)
        session._task.add_done_callback(lambda _: self._left(session))
        if self.is_closed:
            session.ended()
        return session

    def _left(self, session: _S) -> None:
        self.sessions.discard(session)
        self.left(session)

    def left(self, session: _S) -> None:
        """Do nothing; subclasses override this method to handle the end of a session."""

    def changed(self) -> None:
        """Notify all sessions that something has changed. Must be called on the loop."""
        self._is_change_posted = False
        for session in self.sessions:
            session.changed()

    def post_change(self) -> None:
        """Notify all sessions that something has changed. May be called from any thread and at any rate."""
        if self._loop and not self._is_change_posted:
            self._is_change_posted = True
            with contextlib.suppress(RuntimeError):  # the loop has been closed
                self._loop.call_soon_threadsafe(self.changed)

    def spawn(self, work: Coroutine[object, object, None]) -> asyncio.Task[None]:
        """Run a coroutine to its end, even if its client disconnects. :meth:`close` waits for it."""
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._spawned_ended)
        return task

    def _spawned_ended(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        # MinirospyErrors have been reported to the client, if it is still connected.
        if not task.cancelled() and (error := task.exception()) and not isinstance(error, MinirospyError):
            _log.error("%s: %s", type(self).__name__, error, exc_info=error)

    async def close(self) -> None:
        """End all sessions, and wait for their tasks. Idempotent."""
        self.is_closed = True
        sessions = list(self.sessions)
        for session in sessions:
            session.ended()
        await asyncio.gather(*(session._task for session in sessions), return_exceptions=True)
        await asyncio.gather(*self._tasks, return_exceptions=True)


async def wait_until(event: asyncio.Event, end: float) -> None:
    """Wait for an event, or until the loop's clock is past ``end``."""
    # Do not use asyncio.wait_for: before Python 3.12, it may lose a cancellation that coincides with the event.
    # A loop may run a timer early, by up to the clock's resolution: add it, or callers that compare times would spin.
    loop = asyncio.get_running_loop()
    timer = loop.call_at(end + CLOCK_SECONDS, event.set) if end < math.inf else None
    try:
        await event.wait()
    finally:
        if timer:
            timer.cancel()


def text_of(fields: Fields, name: str) -> str:
    """Return a string field of an operation. Raise LookupError if it is missing, TypeError if it is not a string."""
    value = fields[name]
    if not isinstance(value, str):
        raise TypeError(f"{name} is a text")
    return value


def texts_of(fields: Fields, name: str) -> list[str]:
    """Return a field of an operation that is a list of strings.

    Raise LookupError if it is missing, TypeError if it is not a list.
    """
    value = fields[name]
    if not isinstance(value, list):
        raise TypeError(f"{name} is a list of texts")
    return [str(each) for each in value]


def number(value: object) -> float:
    """Return a field of an operation as a finite number. Raise TypeError or OverflowError if it is not one."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise TypeError(f"{value!r:.40} is not a number")
    return float(value)


def _line(error: Exception) -> str:
    """Format an error's message as one line."""
    if isinstance(error, KeyError):
        return f"{error.args[0]!s:.80} is missing"
    return " ".join(str(error).split()) or type(error).__name__
