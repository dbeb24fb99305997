"""The system's limits on threads and open files, with errors that name the limit."""

from __future__ import annotations

import contextlib
import errno
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

from minirospy.base.errors import NoThreadsAtEndError, ThreadLimitError

__all__ = ["explain", "is_file_limit", "naming_thread_limit"]

_CGROUP = Path("/sys/fs/cgroup")


@contextlib.contextmanager
def naming_thread_limit() -> Iterator[None]:
    """Raise ThreadLimitError instead of RuntimeError if a thread started in the block exceeds the system's limit."""
    try:
        yield
    except RuntimeError as error:
        # Let other errors pass: Python also raises RuntimeError here while it exits (since 3.13, a subclass).
        if sys.is_finalizing() or type(error) is not RuntimeError:
            raise
        if "interpreter shutdown" in str(error):
            raise NoThreadsAtEndError from error
        raise ThreadLimitError(threading.active_count(), _thread_limits()) from error


def is_file_limit(error: BaseException | None) -> bool:
    """Return whether an error means that this process or machine has reached its limit of open files or sockets."""
    return isinstance(error, OSError) and error.errno in (errno.EMFILE, errno.ENFILE)


def explain(error: BaseException) -> str:
    """Return an error's message. For a file limit, add the limit's name and how to raise it."""
    if not is_file_limit(error):
        return str(error)
    assert isinstance(error, OSError)
    if error.errno == errno.ENFILE:
        return "this machine has no file descriptor left (sysctl fs.file-max)"
    limit = ""
    if sys.platform != "win32":
        import resource

        limit = f" of its {resource.getrlimit(resource.RLIMIT_NOFILE)[0]}"
    return f"this process has no file descriptor left{limit}: raise the limit (ulimit -n), or connect to less"


def _thread_limits() -> list[str]:
    limits = []
    if sys.platform != "win32":
        import resource

        if (most := resource.getrlimit(resource.RLIMIT_NPROC)[0]) != resource.RLIM_INFINITY:
            limits.append(f"ulimit -u: {most}")
        if (most := resource.getrlimit(resource.RLIMIT_AS)[0]) != resource.RLIM_INFINITY:
            limits.append(f"ulimit -v: {most // 1024} KiB")
    with contextlib.suppress(OSError, IndexError):
        group = Path("/proc/self/cgroup").read_text(encoding="utf-8").strip().rpartition("::")[2]
        max_tasks = (_CGROUP / group.lstrip("/") / "pids.max").read_text(encoding="utf-8").strip()
        if max_tasks != "max":
            limits.append(f"pids.max of {group}: {max_tasks}")
    return limits
