"""Settings for the C library's heap, so that freed blocks are returned to the system."""

from __future__ import annotations

import contextlib
import sys

__all__ = ["return_free_memory", "return_large_blocks"]

_M_MMAP_THRESHOLD = -3
_M_TRIM_THRESHOLD = -1
_LARGE = 256 * 1024


def return_large_blocks(least: int = _LARGE) -> None:
    """Make glibc map each block of at least ``least`` bytes separately. No effect on other systems and C libraries.

    By default glibc maps blocks of at least 128 KiB. But once a larger block (up to 32 MiB) is freed, glibc allocates
    that size from its heap, which can shrink only from its end: after some large bodies a master kept 270 MiB of unused
    memory. Growing such a block on the heap also copies it, while a mapping grows in place. Source: mallopt(3).
    """
    if sys.platform != "linux":
        return
    # Ignore errors: musl has no mallopt(), and a Python that was built without libffi has no ctypes.
    with contextlib.suppress(OSError, AttributeError, ImportError):
        import ctypes

        library = ctypes.CDLL(None)
        library.mallopt(_M_MMAP_THRESHOLD, least)
        if least > _LARGE:
            # Keep glibc's default ratio of the two thresholds. Otherwise each block above 128 KiB would grow and shrink the heap.
            library.mallopt(_M_TRIM_THRESHOLD, 2 * least)


def return_free_memory() -> None:
    """Make glibc return free memory to the system. Takes up to 0.1 s. No effect on other systems and C libraries.

    A glibc heap shrinks only from its end, and each Zenoh thread has its own heap. Source: malloc_trim(3).
    """
    if sys.platform != "linux":
        return
    with contextlib.suppress(OSError, AttributeError, ImportError):
        import ctypes

        ctypes.CDLL(None).malloc_trim(0)
