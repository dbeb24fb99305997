"""The C library's heap: large blocks are given back to the system when they are freed."""

from __future__ import annotations

import contextlib
import sys

__all__ = ["return_free_memory", "return_large_blocks"]

_M_MMAP_THRESHOLD = -3
_M_TRIM_THRESHOLD = -1
_LARGE = 256 * 1024


def return_large_blocks(least: int = _LARGE) -> None:
    """Have glibc map each block of ``least`` bytes and more by itself. No effect on other systems and C libraries.

    glibc does so for blocks of 128 KiB at first, but once a larger one is freed, up to 32 MiB, it takes those of that size
    from its heap, which shrinks from its end only: after some large bodies a master kept 270 MiB that nobody used. To
    grow such a block on the heap is to copy it, too, while a mapping grows in place. Source: mallopt(3).
    """
    if sys.platform != "linux":
        return
    import ctypes

    # musl has no such function; a Python without libffi has no ctypes.
    with contextlib.suppress(OSError, AttributeError):
        library = ctypes.CDLL(None)
        library.mallopt(_M_MMAP_THRESHOLD, least)
        if least > _LARGE:
            # As glibc has it: else the heap's end goes back and forth with each block of 128 KiB and more.
            library.mallopt(_M_TRIM_THRESHOLD, 2 * least)


def return_free_memory() -> None:
    """Have glibc give what is free back to the system. No effect on other systems and C libraries; takes up to 0.1 s.

    glibc's heaps shrink from their ends only, and each of Zenoh's threads has one. Source: malloc_trim(3).
    """
    if sys.platform != "linux":
        return
    import ctypes

    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)
