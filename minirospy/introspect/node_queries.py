"""Query nodes for information that the master does not have, such as the types of their services."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Collection
from functools import partial
from typing import Generic, TypeVar

from minirospy.aio.tasks import ErrorReporter
from minirospy.base.errors import MinirospyError, ServiceException

__all__ = ["MAX_CONCURRENT", "NodeQueries"]

MAX_CONCURRENT = 64
"""Maximum number of concurrent first queries. A hanging node occupies only one of them."""

_MAX_CONCURRENT_RETRIES = 32
"""Maximum number of concurrent retries, separate so that retries do not delay first queries."""
QUERY_SECONDS = 5.0
AGAIN_SECONDS = 10.0  # seconds until a node that did not respond is queried again
REFUSED_SECONDS, _REFUSED_EACH = 0.5, 0.02
"""Seconds to wait after a refused query: a base value, and an increment per failed query.

A refused query is cheap, and a killed server may be restarted soon, so refused queries are retried sooner than others. With
500 dead nodes, each is queried every 10 s.
"""

_Key = TypeVar("_Key")
_Found = TypeVar("_Found")


class NodeQueries(Generic[_Key, _Found]):
    """Queries nodes and stores one result per key, such as a service's name and nodes. Runs on the loop.

    Queries that fail are retried later, and do not delay others.
    """

    def __init__(
        self,
        query: Callable[[_Key], Awaitable[_Found]],
        reporter: ErrorReporter,
        *,
        arrived_late: Callable[[], object] = lambda: None,
    ) -> None:
        """Create the object. ``arrived_late`` is called if a response arrives after :meth:`look` has returned."""
        self.found: dict[_Key, _Found] = {}
        self._query = query
        self._reporter = reporter
        self._arrived_late = arrived_late
        self._present: set[_Key] = set()
        self.tasks: dict[_Key, asyncio.Task[None]] = {}
        self.not_before: dict[_Key, float] = {}
        self._first = asyncio.Semaphore(MAX_CONCURRENT)
        self._again = asyncio.Semaphore(_MAX_CONCURRENT_RETRIES)

    async def look(self, present: Collection[_Key], seconds: float) -> None:
        """Query new keys, and remove absent ones. Return when all new keys have results, or after ``seconds``."""
        kept = self._present = set(present)
        self.found = {key: found for key, found in self.found.items() if key in kept}
        self.not_before = {key: until for key, until in self.not_before.items() if key in kept}
        is_late = False

        async def query(key: _Key, turns: asyncio.Semaphore) -> None:
            async with turns:
                if key in self._present and await self._query_once(key) and is_late:
                    self._arrived_late()

        new = []
        now = asyncio.get_running_loop().time()
        for key in present:
            if key in self.found or key in self.tasks or now < self.not_before.get(key, 0.0):
                continue
            has_failed = key in self.not_before
            task = asyncio.ensure_future(query(key, self._again if has_failed else self._first))
            self.tasks[key] = task
            task.add_done_callback(partial(self._ended, key))
            if not has_failed:
                new.append(task)
        try:
            if new:
                await asyncio.wait(new, timeout=seconds)
        finally:
            is_late = True

    def refresh(self, key: _Key) -> None:
        """Query a key again, because its node may respond differently now. Keep the old result until the node has responded.

        ``arrived_late`` is called if the new result differs from the old one.
        """
        if key in self.found and key not in self.tasks:
            task = asyncio.ensure_future(self._refresh(key))
            self.tasks[key] = task
            task.add_done_callback(partial(self._ended, key))

    async def close(self) -> None:
        """Cancel the queries. Idempotent."""
        tasks = list(self.tasks.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        # Clear the tasks here, because the done callbacks of tasks that have just finished have not run yet.
        self.tasks.clear()

    async def _query_once(self, key: _Key) -> bool:
        """Query a node and store the result under ``key``. Return False if the query failed, or ``key`` is no longer present."""
        started = asyncio.get_running_loop().time()
        try:
            found = await asyncio.wait_for(self._query(key), QUERY_SECONDS)
        except (MinirospyError, ServiceException, OSError, asyncio.TimeoutError, ValueError):
            is_quick = asyncio.get_running_loop().time() - started < REFUSED_SECONDS
            self._failed(key, is_quick=is_quick)
        except Exception as error:  # noqa: BLE001 - retry this node later, like one that does not respond
            self._reporter.report(error)
            self._failed(key)
        else:
            # If the key is absent now, query it again when it returns.
            if key in self._present:
                self.found[key] = found
                return True
        return False

    async def _refresh(self, key: _Key) -> None:
        async with self._again:
            try:
                found = await asyncio.wait_for(self._query(key), QUERY_SECONDS)
            except (MinirospyError, ServiceException, OSError, asyncio.TimeoutError, ValueError):
                return  # keep the old result; if the node has exited, look() removes it
            except Exception as error:  # noqa: BLE001 - keep this node's old result
                self._reporter.report(error)
                return
            if key in self._present and self.found.get(key) != found:
                self.found[key] = found
                self._arrived_late()

    def _ended(self, key: _Key, _: object) -> None:
        self.tasks.pop(key, None)

    def _failed(self, key: _Key, *, is_quick: bool = False) -> None:
        if key in self._present:
            refused = max(REFUSED_SECONDS, _REFUSED_EACH * len(self.not_before))
            pause = min(refused, AGAIN_SECONDS) if is_quick else AGAIN_SECONDS
            self.not_before[key] = asyncio.get_running_loop().time() + pause
