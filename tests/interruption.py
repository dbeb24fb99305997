"""Interrupt a thread where Ctrl-C does harm: just after it has acquired the lock of an object of the module threading."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from types import FrameType

__all__ = ["ends_elsewhere", "interrupt_in_lock"]


def interrupt_in_lock(call: Callable[[], object], number: int = 1) -> None:
    """Call a function; raise KeyboardInterrupt in it between the acquisition of a lock and the start of its ``with`` block.

    Only locks that Python code acquires count, such as those of Event, Condition and Queue; the interrupt comes at lock
    ``number``. If the function acquires fewer of them, it runs to its end.
    """
    count = 0

    def interrupt(frame: FrameType, event: str, _: object) -> None:
        nonlocal count
        code = frame.f_code
        if event == "return" and code.co_name == "__enter__" and code.co_filename == threading.__file__:
            count += 1
            if count == number:
                sys.setprofile(None)
                raise KeyboardInterrupt

    sys.setprofile(interrupt)
    try:
        call()
    except KeyboardInterrupt:
        pass
    finally:
        sys.setprofile(None)


def ends_elsewhere(call: Callable[[], object], seconds: float = 60.0) -> bool:
    """Call a function in another thread; return whether it returns."""
    thread = threading.Thread(target=call, daemon=True)
    thread.start()
    thread.join(seconds)
    return not thread.is_alive()
