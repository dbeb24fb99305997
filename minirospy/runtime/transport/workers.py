"""Worker threads that run user code, so that it never runs on the loop."""

from __future__ import annotations

import logging
import queue
import threading
from collections import deque
from collections.abc import Callable

from minirospy.base.errors import ThreadLimitError
from minirospy.runtime.transport.limits import naming_thread_limit

__all__ = ["InOrder", "Workers"]

_IDLE_SECONDS = 10.0
_log = logging.getLogger(__name__)


class Workers:
    """A pool of daemon threads. A thread stays for a while after its function returns, because starting one is expensive.

    Their number is not limited: each connection that waits for bytes uses one, and the number of peers is limited when they
    are accepted.
    """

    def __init__(self) -> None:
        self._work: queue.SimpleQueue[tuple[Callable[..., object], tuple[object, ...]]] = queue.SimpleQueue()
        # Use a reentrant lock: while the main thread holds it, a signal handler may run a shutdown hook, which starts a worker.
        self._lock = threading.RLock()
        self._idle = 0

    def start(self, function: Callable[..., object], *args: object) -> None:
        """Run ``function(*args)`` in a worker, and log an uncaught exception.

        Raise ThreadLimitError if no thread can be started.
        """
        with self._lock:
            if self._idle:
                # A claimed worker always takes this work: before it exits, an idle worker removes itself from the idle ones.
                self._idle -= 1
                self._work.put((function, args))
                return
        with naming_thread_limit():
            threading.Thread(
                target=self._run, args=(function, args), name="minirospy-worker", daemon=True
            ).start()

    def _run(self, function: Callable[..., object], args: tuple[object, ...]) -> None:
        while True:
            try:
                function(*args)
            except BaseException:  # noqa: BLE001 - the edge to user code: a fault there, or sys.exit(), must not end the worker
                _log.exception("fault in a worker")
            del function, args
            with self._lock:
                self._idle += 1
            try:
                function, args = self._work.get(timeout=_IDLE_SECONDS)
            except queue.Empty:
                with self._lock:
                    if self._idle:
                        self._idle -= 1
                        return
                # This worker was claimed just as it was about to exit, so work for it will arrive in a moment.
                function, args = self._work.get()


class InOrder:
    """Runs functions in workers, one at a time, in the order of the calls to :meth:`start`."""

    def __init__(self, workers: Workers) -> None:
        self._workers = workers
        self._waiting: deque[tuple[Callable[..., object], tuple[object, ...]]] = deque()
        self._lock = threading.RLock()
        self._is_running = False

    def start(self, function: Callable[..., object], *args: object) -> None:
        """Run ``function(*args)`` after the functions passed earlier. Log an uncaught exception."""
        with self._lock:
            self._waiting.append((function, args))
            if self._is_running:
                return
            self._is_running = True
        try:
            self._workers.start(self._run)
        except ThreadLimitError as error:
            # No thread could be started, so leave the functions queued until the next call to start().
            with self._lock:
                self._is_running = False
            _log.error("a callback is late: %s", error)

    def _run(self) -> None:
        while True:
            with self._lock:
                if not self._waiting:
                    self._is_running = False
                    return
                function, args = self._waiting.popleft()
            try:
                function(*args)
            except BaseException:  # noqa: BLE001 - the edge to user code: the others run all the same
                _log.exception("fault in a worker")
