"""The connection between a program's threads and the process's single asyncio loop."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import threading
from collections.abc import Callable, Coroutine
from typing import TypeVar

from minirospy.runtime.transport.limits import naming_thread_limit

__all__ = ["LoopClosedError", "LoopThread", "new_event_loop"]

_T = TypeVar("_T")
CLOSE_SECONDS = 2.0  # seconds for which :meth:`LoopThread.close` waits for the loop's tasks to finish


def new_event_loop() -> asyncio.AbstractEventLoop:
    """Return a loop that can watch plain sockets, on every OS (Windows' default loop cannot)."""
    return asyncio.SelectorEventLoop()


class LoopClosedError(RuntimeError):
    """The event loop has closed."""


class LoopThread:
    """An event loop in a daemon thread. Closing is idempotent. Raise ThreadLimitError if the thread cannot be started."""

    def __init__(self, name: str = "minirospy-loop") -> None:
        self.loop = new_event_loop()
        # Use a reentrant lock: a signal handler may run while its thread holds the lock.
        self._lock = threading.RLock()
        self._is_ending = False
        self._end = asyncio.Event()
        self._thread = threading.Thread(target=self._serve, name=name, daemon=True)
        try:
            with naming_thread_limit():
                self._thread.start()
        except Exception:
            self.loop.close()
            raise
        except BaseException:
            # Ctrl-C arrived while the thread was starting; the thread itself closes the loop.
            self.post(self._end.set)
            raise

    def run(self, coroutine: Coroutine[object, object, _T], timeout: float | None = None) -> _T:
        """Run ``coroutine`` on the loop and wait for its result.

        Raise TimeoutError after ``timeout`` seconds, LoopClosedError if the loop closes before the coroutine is done,
        and RuntimeError in the loop's own thread, which would deadlock.
        """
        return self.start(coroutine)(timeout)

    def start(self, coroutine: Coroutine[object, object, _T]) -> Callable[[float | None], _T]:
        """Like :meth:`run`, but do not wait. Coroutines start in the order of the calls.

        Return a function that waits for the result; call it once.
        """
        if threading.current_thread() is self._thread:
            coroutine.close()
            raise RuntimeError("a blocking call on the event loop's thread would wait for itself")
        with self._lock:
            if self._is_ending:
                coroutine.close()
                raise LoopClosedError("the event loop is closed")
            tasks: list[asyncio.Task[_T]] = []
            pending = threading.Lock()
            pending.acquire()

            def has_ended(task: asyncio.Task[_T]) -> None:
                if not task.cancelled():
                    # Mark the exception as retrieved, because an interrupted caller never retrieves it.
                    task.exception()
                pending.release()

            def begin() -> None:
                tasks.append(self.loop.create_task(coroutine))
                tasks[0].add_done_callback(has_ended)

            self.loop.call_soon_threadsafe(begin)
        return functools.partial(self._wait, tasks, pending)

    def _wait(self, tasks: list[asyncio.Task[_T]], pending: threading.Lock, timeout: float | None) -> _T:
        # Do not use concurrent.futures.Future: its result() takes a lock that the loop needs to set the result.
        # A signal handler that interrupts result() and then waits for the loop would deadlock.
        try:
            if not pending.acquire(timeout=-1 if timeout is None else timeout):
                raise TimeoutError
            return tasks[0].result()
        except asyncio.CancelledError as error:
            raise LoopClosedError("the event loop was closed meanwhile") from error
        except BaseException:
            self.post(lambda: tasks[0].cancel())  # noqa: PLW0108 - it may be there only then
            raise

    def post(self, function: Callable[..., object], *args: object) -> None:
        """Call ``function`` on the loop soon. No effect once the loop is closed."""
        with contextlib.suppress(RuntimeError):
            self.loop.call_soon_threadsafe(function, *args)

    def close(self) -> None:
        """Close the loop; tasks that are still running are cancelled."""
        if not self._thread.is_alive():
            return
        # Do not call loop.stop(), because a second call would interrupt the thread during its last steps.
        self.post(self._end.set)
        if threading.current_thread() is not self._thread:
            self._thread.join(CLOSE_SECONDS)

    def _serve(self) -> None:
        asyncio.set_event_loop(self.loop)
        try:
            self.loop.run_until_complete(self._end.wait())
        finally:
            with self._lock:
                self._is_ending = True
            # Let posted calls become tasks and finished tasks report their results; otherwise callers would wait forever.
            self.loop.run_until_complete(asyncio.sleep(0))
            tasks = asyncio.all_tasks(self.loop)
            for task in tasks:
                task.cancel()
            if tasks:
                self.loop.run_until_complete(asyncio.gather(*tasks, return_exceptions=True))
            self.loop.run_until_complete(asyncio.sleep(0))
            self.loop.close()
