"""Measure how much memory code allocates."""

from __future__ import annotations

import tracemalloc

__all__ = ["Allocations"]


class Allocations:
    """Measures allocations inside the ``with`` block: ``peak()`` since ``mark()``."""

    def __enter__(self) -> Allocations:
        tracemalloc.start()
        self._before = 0
        return self

    def __exit__(self, *_: object) -> None:
        tracemalloc.stop()

    def mark(self) -> None:
        """Start counting here."""
        tracemalloc.reset_peak()
        self._before, _ = tracemalloc.get_traced_memory()

    def peak(self) -> int:
        """Return the peak growth of the memory in use, in bytes."""
        _, peak = tracemalloc.get_traced_memory()
        return peak - self._before
