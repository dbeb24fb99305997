"""What every command does the same way: how it reads its words, is a node of the graph, and ends.

A command is a typed function that raises; `main(argv)` hands it to :func:`run`, which turns what was
raised into one line on stderr and an exit status:

====== =====================================================================
status when
====== =====================================================================
0      done; a stream, a wait or a question ended by Ctrl-C or a closed pipe
1      it could not be done: no master, an unknown name, a peer that fails
2      typed wrong: unknown option, missing argument
130    work that Ctrl-C ended half done: INTERRUPTED
====== =====================================================================
"""

from __future__ import annotations

import argparse
import contextlib
import io
import itertools
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, NoReturn

from minirospy.errors import (
    MessageException,
    MinirospyError,
    ROSException,
    ServiceException,
    UsageError,
    did_you_mean,
)
from minirospy.escape import SafeTerminal, escaped

if TYPE_CHECKING:
    from minirospy.introspect.graph import Graph
    from minirospy.introspect.streams import ToolNode
    from minirospy.names import Arguments

__all__ = [
    "INTERRUPTED",
    "Parser",
    "complain",
    "hint_near",
    "one_argument",
    "refuse_bag",
    "run",
    "tool_node",
    "warn",
    "warn_unpublished",
]


INTERRUPTED = 130
"""As a shell has it of a program that SIGINT ended: `catkin_make && roslaunch ...` goes no further."""


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

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        self._check_options(args)
        return super().parse_known_args(args, namespace)

    def parse_known_intermixed_args(self, args: Any = None, namespace: Any = None) -> Any:
        self._check_options(args)
        return super().parse_known_intermixed_args(args, namespace)

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message} (`{self.prog} -h` shows what there is)")

    def _check_options(self, args: Sequence[str] | None) -> None:
        """Tell of a long option that does not exist before a missing argument: that may be what it has swallowed."""
        if any(action.nargs == argparse.REMAINDER for action in self._actions):
            return  # some of the options are another program's
        for word in itertools.takewhile("--".__ne__, sys.argv[1:] if args is None else args):
            option = word.partition("=")[0]
            if option.startswith("--") and not any(
                known.startswith(option) for known in self._option_string_actions
            ):
                self.error(
                    f"unrecognized arguments: {word}{did_you_mean(option, self._option_string_actions, 1)}"
                )


def one_argument(prog: str, description: str, name: str, help_: str, argv: Sequence[str]) -> str:
    """The one word, as typed, that a command takes."""
    parser = Parser(prog, description=description)
    parser.add_argument(name, help=help_)
    return str(getattr(parser.parse_args(argv), name))


def refuse_bag(command: str) -> NoReturn:
    """What an option that reads a bag file ends with. Raises MinirospyError: exit status 1."""
    raise MinirospyError(f"`{command} -b`: bag files cannot be read yet, they come with a later version")


def run(name: str, body: Callable[[], int | None], interrupted: int = 0) -> int:
    """The exit status of ``body`` (at Ctrl-C ``interrupted``); a named error becomes ``name: ERROR: text`` on stderr."""
    _open_streams()
    try:
        status = body() or 0
        sys.stdout.flush()
        return status
    except UsageError as error:
        return complain(name, error, 2)
    except (MinirospyError, ROSException, ServiceException, MessageException) as error:
        return complain(name, error)
    except UnicodeEncodeError as error:
        wrong = error.object[error.start : error.end]
        return complain(name, UsageError(f"{wrong!r} was typed, which is no UTF-8 text"), 2)
    except BrokenPipeError:
        # The reader (`| head`) has gone.
        _flush()
        return 0
    except OSError as error:
        # A disk that is full, a folder that may not be written: the file's name, and the system's words.
        why = error.strerror or str(error)
        return complain(name, MinirospyError(f"{error.filename}: {why}" if error.filename else why))
    except KeyboardInterrupt:
        return interrupted


def _open_streams() -> None:
    """Standard streams that are there, and print everything.

    One that was closed (`rostopic list >&-`, a Windows program without a console) would be None; an output that
    cannot encode what a robot says (a pipe in Windows' code page) gets it as escapes.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115 it stays for the process
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if type(stream) is io.TextIOWrapper and stream.isatty():
            # What a robot says is shown on a terminal, and never obeyed by it.
            setattr(sys, name, SafeTerminal.around(stream))


def warn(what: str, name: str = "") -> None:
    """One line on stderr, after all that was printed before; that ``name`` is not legal stands there, too."""
    from minirospy.introspect.graph import why_illegal

    why = why_illegal(name) if name else ""
    sys.stdout.flush()
    print(escaped(f"WARNING: {what}{why and f'; {why}'}", "\n"), file=sys.stderr)


def warn_unpublished(graph: Graph, topic: str) -> None:
    """What a command that waits for the messages of a topic says, where it does not know it; then the nearest names."""
    warn(f"topic [{topic}] does not appear to be published yet", topic)
    hint_near(topic, graph.state().publishers)


def hint_near(name: str, known: Iterable[str]) -> None:
    """A line on stderr, below the warning that ``name`` is waited for: the nearest names, where one is near."""
    near = did_you_mean(name, (each for each in known if each != name))
    if near:
        print(escaped(near.removeprefix("; ")), file=sys.stderr)


@contextlib.contextmanager
def tool_node(tool: str, arguments: Arguments | None = None, *, ros_time: bool = False) -> Iterator[ToolNode]:
    """The node of a command that listens or publishes; it leaves the graph also where `kill` ends the command.

    ``arguments``: what a launch file gives it as a node: `__name:=`, `__ns:=`, `__master:=`.
    """
    import signal

    from minirospy.environment import Environment
    from minirospy.introspect.streams import ToolNode

    special = arguments.special if arguments else {}
    environment = Environment.read(
        master_uri=special.get("__master", ""),
        host=special.get("__hostname") or special.get("__ip", ""),
        namespace=special.get("__ns", ""),
    )
    # As by Ctrl-C.
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with ToolNode(environment, tool, name=special.get("__name", ""), ros_time=ros_time) as node:
            if node.simulated:
                warn("may be using simulated time")
            yield node
    finally:
        signal.signal(signal.SIGTERM, before)


def complain(name: str, error: Exception, status: int = 1) -> int:
    """One line on stderr, after all that was printed before; ``status`` comes back."""
    _flush()
    print(escaped(f"{name}: ERROR: {error}", "\n"), file=sys.stderr)
    return status


def _flush() -> None:
    """Print what waits; where that cannot be, it is dropped, also from the interpreter's own flush at its end."""
    try:
        sys.stdout.flush()
    except OSError:
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
