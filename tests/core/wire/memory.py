"""How much memory code allocates."""

from __future__ import annotations

import tracemalloc

__all__ = ["Allocations"]


class Allocations:
    """What is allocated inside the ``with`` block: ``peak()`` since ``mark()``."""

    def __enter__(self) -> Allocations:
        tracemalloc.start()
        self._before = 0
        return self

    def __exit__(self, *_: object) -> None:
        tracemalloc.stop()

    def mark(self) -> None:
        """Count from here on."""
        tracemalloc.reset_peak()
        self._before, _ = tracemalloc.get_traced_memory()

    def peak(self) -> int:
        """Return by how many bytes the memory in use has grown at its peak."""
        _, peak = tracemalloc.get_traced_memory()
        return peak - self._before
