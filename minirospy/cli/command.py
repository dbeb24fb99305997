"""What every command does the same way: how it ends.

A command is a typed function that raises; `main(argv)` hands it to :func:`run`, which turns what was
raised into one line on stderr and an exit status:

====== =====================================================================
status when
====== =====================================================================
0      done; a stream (`rostopic echo`) ended by Ctrl-C or by a closed pipe
1      it could not be done: no master, an unknown name, a peer that fails
2      typed wrong: unknown option, missing argument
====== =====================================================================
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from typing import Any, NoReturn

from minirospy.errors import MessageException, MinirospyError, ROSException, ServiceException, UsageError

__all__ = ["Parser", "run"]


class _Help(argparse.HelpFormatter):
    """Help as wide as the terminal; argparse asks shutil for that, whose import costs more than its own."""

    def __init__(self, prog: str, *args: Any, **kwargs: Any) -> None:
        try:
            width = os.get_terminal_size(sys.__stdout__.fileno()).columns if sys.__stdout__ else 80
        except (OSError, ValueError):
            width = 80
        super().__init__(prog, *args, **{"width": max(width, 40) - 2, **kwargs})


class Parser(argparse.ArgumentParser):
    """An argument parser whose complaint is one line that ends with what to type for help."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **{"formatter_class": _Help, **kwargs})

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message} (`{self.prog} -h` shows what there is)")


def run(name: str, body: Callable[[], int | None]) -> int:
    """The exit status of ``body``; a named error becomes ``name: ERROR: text`` on stderr."""
    try:
        status = body() or 0
        sys.stdout.flush()
        return status
    except UsageError as error:
        return _complain(name, error, 2)
    except (MinirospyError, ROSException, ServiceException, MessageException) as error:
        return _complain(name, error, 1)
    except BrokenPipeError:
        # The reader (`| head`) has gone: quiet, also for the interpreter's own flush at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        return 0


def _complain(name: str, error: Exception, status: int) -> int:
    sys.stdout.flush()
    print(f"{name}: ERROR: {error}", file=sys.stderr)
    return status
