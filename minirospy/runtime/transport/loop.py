"""The bridge between a program's threads and the one asyncio loop of the process."""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import functools
import threading
from collections.abc import Callable, Coroutine
from typing import TypeVar

from minirospy.runtime.transport.limits import naming_thread_limit

__all__ = ["LoopClosedError", "LoopThread", "new_event_loop"]

_T = TypeVar("_T")


def new_event_loop() -> asyncio.AbstractEventLoop:
    """Return a loop that can watch plain sockets, on every OS (Windows' default loop cannot)."""
    return asyncio.SelectorEventLoop()


class LoopClosedError(RuntimeError):
    """The event loop has ended."""


class LoopThread:
    """An event loop in a daemon thread. Closing is idempotent. Raise ThreadLimitError."""

    def __init__(self, name: str = "minirospy-loop") -> None:
        self.loop = new_event_loop()
        # A signal handler may run while its thread holds it.
        self._lock = threading.RLock()
        self._is_ending = False
        self._end = asyncio.Event()
        self._thread = threading.Thread(target=self._serve, name=name, daemon=True)
        try:
            with naming_thread_limit():
                self._thread.start()
        except BaseException:
            self.loop.close()
            raise

    def run(self, coroutine: Coroutine[object, object, _T], timeout: float | None = None) -> _T:
        """Run ``coroutine`` on the loop and wait for its result.

        Raises TimeoutError after ``timeout`` seconds, LoopClosedError where the loop ends before it is done,
        and RuntimeError on the loop's own thread, which would wait for itself.
        """
        return self.start(coroutine)(timeout)

    def start(self, coroutine: Coroutine[object, object, _T]) -> Callable[[float | None], _T]:
        """Start ``coroutine`` as the first half of :meth:`run`, in the order of these calls; return the function that waits."""
        if threading.current_thread() is self._thread:
            coroutine.close()
            raise RuntimeError("a blocking call on the event loop's thread would wait for itself")
        with self._lock:
            if self._is_ending:
                coroutine.close()
                raise LoopClosedError("the event loop is closed")
            future = asyncio.run_coroutine_threadsafe(coroutine, self.loop)
        return functools.partial(self._wait, future)

    def _wait(self, future: concurrent.futures.Future[_T], timeout: float | None) -> _T:
        try:
            return future.result(timeout)
        except concurrent.futures.CancelledError as error:
            raise LoopClosedError("the event loop was closed meanwhile") from error
        except concurrent.futures.TimeoutError:
            future.cancel()
            raise TimeoutError from None
        except BaseException:
            future.cancel()
            raise

    def post(self, function: Callable[..., object], *args: object) -> None:
        """Call ``function`` on the loop soon; no effect once the loop is closed."""
        with contextlib.suppress(RuntimeError):
            self.loop.call_soon_threadsafe(function, *args)

    def close(self) -> None:
        """End the loop: what still runs on it is cancelled."""
        if not self._thread.is_alive():
            return
        # Not loop.stop(): a second one would interrupt the last steps of the thread.
        self.post(self._end.set)
        if threading.current_thread() is not self._thread:
            self._thread.join(2.0)

    def _serve(self) -> None:
        asyncio.set_event_loop(self.loop)
        try:
            self.loop.run_until_complete(self._end.wait())
        finally:
            with self._lock:
                self._is_ending = True
            # What was started by then becomes a task here, and what has just ended reports it: else callers would wait for ever.
            self.loop.run_until_complete(asyncio.sleep(0))
            tasks = asyncio.all_tasks(self.loop)
            for task in tasks:
                task.cancel()
            if tasks:
                self.loop.run_until_complete(asyncio.gather(*tasks, return_exceptions=True))
            self.loop.run_until_complete(asyncio.sleep(0))
            self.loop.close()
