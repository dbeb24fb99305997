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

__all__ = ["Parser", "complain", "refuse_bag", "run"]


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
        raise UsageError(f"{message}{self._nearest(message)} (`{self.prog} -h` shows what there is)")

    def _nearest(self, message: str) -> str:
        """The option that may have been meant, where ``message`` complains of one that does not exist."""
        import difflib

        _, found, words = message.partition("unrecognized arguments: ")
        option = words.split()[0].partition("=")[0] if found else ""
        near = difflib.get_close_matches(option, self._option_string_actions, n=1)
        return f"; did you mean {near[0]}?" if near and option.startswith("--") else ""


def refuse_bag(command: str) -> NoReturn:
    """What an option that reads a bag file ends with. Raises MinirospyError: exit status 1."""
    raise MinirospyError(f"`{command} -b`: bag files cannot be read yet, they come with a later version")


def run(name: str, body: Callable[[], int | None]) -> int:
    """The exit status of ``body``; a named error becomes ``name: ERROR: text`` on stderr."""
    try:
        status = body() or 0
        sys.stdout.flush()
        return status
    except UsageError as error:
        return complain(name, error, 2)
    except (MinirospyError, ROSException, ServiceException, MessageException) as error:
        return complain(name, error)
    except BrokenPipeError:
        # The reader (`| head`) has gone: quiet, also for the interpreter's own flush at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        # A disk that is full, a folder that may not be written: the file's name, and the system's words.
        why = error.strerror or str(error)
        return complain(name, MinirospyError(f"{error.filename}: {why}" if error.filename else why))
    except KeyboardInterrupt:
        return 0


def complain(name: str, error: Exception, status: int = 1) -> int:
    """One line on stderr, after all that was printed before; ``status`` comes back."""
    sys.stdout.flush()
    print(f"{name}: ERROR: {error}", file=sys.stderr)
    return status
