"""A master that writes each long turn of its event loop to a file: the time of its end, "turn", its CPU seconds.

    python benchmarks/master_turns.py FILE [options of minirospy master]

This is for ``benchmarks/master_attack.py``: a turn's duration is the delay that the master itself causes, independent of
the machine's load. A turn is one callback of the loop. Lines with "loop" are iterations, with all callbacks that were
due.
"""

from __future__ import annotations

import selectors
import sys
import time
from asyncio import events
from typing import Any

from minirospy.ros.rosmaster.commands.master import main

LONG = 0.002  # seconds; shorter turns are not recorded


def record_turns(path: str) -> None:
    """Record, from now on, the long turns and iterations of this process's event loop."""
    run, file = events.Handle._run, open(path, "w", buffering=1, encoding="ascii")  # noqa: SIM115 - until the end
    select, since = selectors.DefaultSelector.select, time.thread_time()

    def measured(handle: events.Handle) -> None:
        before = time.thread_time()
        run(handle)
        taken = time.thread_time() - before
        if taken > LONG:
            file.write(f"{time.monotonic()} turn {taken}\n")

    def selected(selector: selectors.DefaultSelector, timeout: float | None = None) -> list[Any]:
        nonlocal since
        taken = time.thread_time() - since
        if taken > LONG:
            file.write(f"{time.monotonic()} loop {taken}\n")
        found = select(selector, timeout)
        since = time.thread_time()
        return found

    selectors.DefaultSelector.select = selected  # type: ignore[method-assign,assignment]
    events.Handle._run = measured  # type: ignore[assignment]


if __name__ == "__main__":
    record_turns(sys.argv[1])
    sys.exit(main(sys.argv[2:]))
