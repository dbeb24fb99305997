"""Interrupt a thread where Ctrl-C does harm: just after it has acquired the lock of an object of the module threading."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from types import FrameType

__all__ = ["ends_elsewhere", "interrupt_in_lock"]


def interrupt_in_lock(call: Callable[[], object]) -> None:
    """Call a function; raise KeyboardInterrupt in it between the acquisition of a lock and the start of its ``with`` block.

    This affects only locks that Python code acquires, such as those of Event, Condition and Queue. If the function
    acquires none of them, it runs to its end.
    """

    def interrupt(frame: FrameType, event: str, _: object) -> None:
        code = frame.f_code
        if event == "return" and code.co_name == "__enter__" and code.co_filename == threading.__file__:
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
