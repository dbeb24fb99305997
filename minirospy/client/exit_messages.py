"""Report what an interrupted process is still waiting for, and suppress the interrupt's tracebacks."""

from __future__ import annotations

import contextlib
import os
import sys
import threading
from collections.abc import Callable
from types import FrameType, TracebackType

from minirospy.base.escape import escaped

__all__ = ["report_interrupt", "report_waiting", "suppress_tracebacks"]


def report_waiting(*, is_leaving: bool) -> None:
    """Print what the process is still waiting for.

    ``is_leaving`` means that the node is waiting for the master to unregister it.
    """
    what = "the master to unregister this node" if is_leaving else _what_runs()
    advice = "Press Ctrl-C again to interrupt it, and a third time to end the process"
    # Ignore errors, because the terminal may already be closed.
    with contextlib.suppress(OSError, ValueError, AttributeError):
        print(f"shutdown: still waiting for {what}. {advice}", file=sys.stderr, flush=True)


def report_interrupt(reason: str) -> None:
    """Print a line about interrupting the main thread, with its position in the program and the reason for the shutdown."""
    main = threading.main_thread()
    place = _place(sys._current_frames().get(main.ident or 0))
    at = f" at {place}" if place else ""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        print(
            f"shutdown: thread {main.name}{at} has not ended: interrupting it as Ctrl-C does ({escaped(reason)})",
            file=sys.stderr,
            flush=True,
        )


def _what_runs() -> str:
    """Return the thread or process that delays this process's exit, and where it is in the program."""
    main = threading.main_thread()
    threads = [main, *(t for t in threading.enumerate() if t is not main and not t.daemon)]
    frames = sys._current_frames()
    for thread in threads:
        if thread.is_alive() and (place := _place(frames.get(thread.ident or 0))):
            return f"thread {thread.name} at {place}"

    # The main thread has left the program's code, so it is waiting for other threads to exit.
    if len(threads) > 1:
        return f"thread {threads[1].name}"
    loaded = sys.modules.get("multiprocessing")
    children = loaded.active_children() if loaded else []
    return f"process {children[0].name} ({children[0].pid})" if children else "the exit of the program"


def suppress_tracebacks(is_expected: Callable[[BaseException], bool]) -> None:
    """Let the program or thread exit with status 0 and without a traceback if an expected error is not caught."""
    hooks = sys.excepthook, threading.excepthook, sys.unraisablehook

    def is_interrupt(error: BaseException | None) -> bool:
        # A wait that is interrupted before it acquires its lock may raise RuntimeError. Check the original error, in __context__.
        while isinstance(error, RuntimeError):
            error = error.__context__
        return error is not None and is_expected(error)

    def of_main(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        if is_interrupt(error):
            if sys.flags.inspect:
                # Do not exit: `python -i PROGRAM` continues with an interactive session.
                return
            raise SystemExit(0)
        hooks[0](kind, error, trace)

    def of_thread(arguments: threading.ExceptHookArgs) -> None:
        if not is_interrupt(arguments.exc_value):
            hooks[1](arguments)

    def of_exit(arguments: sys.UnraisableHookArgs) -> None:
        if not is_interrupt(arguments.exc_value):
            hooks[2](arguments)

    sys.excepthook, threading.excepthook, sys.unraisablehook = of_main, of_thread, of_exit


def _place(frame: FrameType | None) -> str:
    """Return the file:line of the innermost frame in the program's own code, or "" if there is none."""
    libraries = (os.path.dirname(os.__file__), os.path.dirname(os.path.dirname(__file__)), "<frozen")
    while frame is not None and frame.f_code.co_filename.startswith(libraries):
        frame = frame.f_back
    return f"{frame.f_code.co_filename}:{frame.f_lineno}" if frame else ""
