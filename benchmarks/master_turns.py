"""A master that writes each long turn of its event loop to a file: the moment of its end, and its CPU seconds.

    python benchmarks/master_turns.py FILE [options of minirospy master]

For ``benchmarks/master_attack.py``: what a turn takes is what a client waits for the master itself, whatever else the
machine does. A turn is one callback of the loop.
"""

from __future__ import annotations

import sys
import time
from asyncio import events

from minirospy.cli.ros.master import main

LONG = 0.002
"""Seconds; shorter turns are not written."""


def record_turns(path: str) -> None:
    """Write the long turns of every event loop of this process from here on."""
    run, file = events.Handle._run, open(path, "w", buffering=1, encoding="ascii")  # noqa: SIM115 - until the end

    def measured(handle: events.Handle) -> None:
        before = time.thread_time()
        run(handle)
        taken = time.thread_time() - before
        if taken > LONG:
            file.write(f"{time.monotonic()} {taken}\n")

    events.Handle._run = measured  # type: ignore[assignment]


if __name__ == "__main__":
    record_turns(sys.argv[1])
    sys.exit(main(sys.argv[2:]))
