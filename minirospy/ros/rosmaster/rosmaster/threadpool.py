"""rosmaster.threadpool: threads for calls to nodes. At most one task per marker runs at a time."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import NamedTuple

from minirospy.base.clock import SignalSafeCondition

__all__ = ["MarkedThreadPool"]


class _Task(NamedTuple):
    marker: object
    function: Callable[..., object]
    args: tuple[object, ...]
    on_result: Callable[[object], object] | None


class MarkedThreadPool:
    """Runs tasks in daemon threads, in order, with at most one task at a time per marker.

    The master uses a node's URI as the marker, so that a slow node occupies only one thread.
    """

    def __init__(self, numThreads: int) -> None:
        self._lock = threading.RLock()
        self._changed = threading.Condition(self._lock)
        self._removed = SignalSafeCondition()
        """Notified after each removal of a task or thread; join_all() waits for it, also in the main thread."""
        self._tasks: list[_Task] = []
        self._markers: list[object] = []
        self._threads: list[threading.Thread] = []
        self._is_joining = False
        self.set_thread_count(numThreads)

    def set_thread_count(self, newNumThreads: int) -> bool:
        """Start or stop threads to reach this count; return False if that is impossible."""
        with self._lock:
            if self._is_joining:
                return False
            self._resize(newNumThreads)
            return True

    def get_thread_count(self) -> int:
        """Return the number of threads."""
        with self._lock:
            return len(self._threads)

    def queue_task(
        self,
        marker: object,
        task: Callable[..., object],
        args: tuple[object, ...] | None = None,
        taskCallback: Callable[[object], object] | None = None,
    ) -> bool:
        """Call ``task(*args)`` in a thread, then ``taskCallback`` with the result; return whether the task was accepted."""
        with self._lock:
            if self._is_joining or not callable(task):
                return False
            self._tasks.append(_Task(marker, task, args or (), taskCallback))
            self._changed.notify_all()
            return True

    def join_all(self, wait_for_tasks: bool = True, wait_for_threads: bool = True) -> None:
        """Stop the threads, first running the queued tasks if requested. The pool can be reused afterwards."""
        with self._lock:
            self._is_joining = True
        if wait_for_tasks:
            self._removed.wait_for(lambda: not (self._tasks and self._threads))
        with self._lock:
            threads = list(self._threads)
            self._resize(0)
        for thread in threads if wait_for_threads else ():
            if thread is not threading.current_thread():
                thread.join()
        with self._lock:
            self._is_joining = False

    def _resize(self, count: int) -> None:
        while len(self._threads) < count:
            thread = threading.Thread(target=self._work, name="rosmaster.threadpool", daemon=True)
            self._threads.append(thread)
            thread.start()
        del self._threads[: len(self._threads) - count]
        self._changed.notify_all()
        self._removed.notify_all()

    def _work(self) -> None:
        while task := self._next():
            try:
                try:
                    result = task.function(*task.args)
                finally:
                    self._release(task.marker)
                if task.on_result:
                    task.on_result(result)
            except Exception:
                # Catch all exceptions: a caller's task may raise any.
                logging.getLogger("rosmaster.threadpool").exception("a task failed")

    def _next(self) -> _Task | None:
        """Return the first task whose marker is free, or None if this thread must exit."""
        with self._lock:
            while threading.current_thread() in self._threads:
                for task in self._tasks:
                    if task.marker is None or task.marker not in self._markers:
                        self._tasks.remove(task)
                        self._markers.append(task.marker)
                        self._changed.notify_all()
                        self._removed.notify_all()
                        return task
                self._changed.wait()
        return None

    def _release(self, marker: object) -> None:
        with self._lock:
            self._markers.remove(marker)
            self._changed.notify_all()
