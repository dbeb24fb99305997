"""base/heap: memory that a master frees is returned to the system."""

from __future__ import annotations

import asyncio
import gc
import platform
import subprocess
import sys

import pytest

from minirospy.base.heap import return_free_memory, return_large_blocks
from minirospy.runtime.master import master as masters

PROGRAM = """
from minirospy.base.heap import return_large_blocks

def megabytes():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096 / 1e6

if {is_called}:
    return_large_blocks()
before = megabytes()
# One of 30 MB that is freed: the C library takes blocks of that size from its heap from here on.
block = bytearray(30_000_000)
del block
kept, freed = [], []
for _ in range(100):
    freed.append(bytearray(b"x") * 1_000_000)
    kept.append(bytearray(2000))
del freed
print(megabytes() - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="another C library")
def test_freed_bodies_are_given_back_to_the_system() -> None:
    taken = [
        float(
            subprocess.run(
                [sys.executable, "-c", PROGRAM.format(is_called=is_called)],
                capture_output=True,
                check=True,
                text=True,
                timeout=60,
            ).stdout
        )
        for is_called in (True, False)
    ]
    assert taken[0] < 10
    # Without the call, the small blocks keep the large ones between them allocated.
    assert taken[1] > 50


def test_garbage_collector_looks_at_few_objects_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    thresholds: list[tuple[int, ...]] = []
    monkeypatch.setattr(gc, "set_threshold", lambda *values: thresholds.append(values))
    monkeypatch.setattr(masters, "return_large_blocks", lambda: None)

    async def scene() -> None:
        master = masters.Master(owns_process=True, same_host=False)
        await master.start()
        await master.close()

    asyncio.run(scene())
    assert thresholds[0][0] * thresholds[0][1] <= 10_000


def test_python_without_ctypes_keeps_its_default_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ctypes", None)  # an import raises ImportError, as without libffi
    return_large_blocks()
    return_free_memory()
