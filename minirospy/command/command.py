"""The common part of all commands: reading arguments, being a node of the graph, errors and exit statuses.

A command is a typed function that raises; `main(argv)` hands it to :func:`run`, which turns what was
raised into one line on stderr and an exit status:

====== =====================================================================
status when
====== =====================================================================
0      done; a stream, a wait or a question ended by Ctrl-C or a closed pipe
1      it could not be done: no master, an unknown name, a peer that fails
2      usage error: unknown option, missing argument
130    work that Ctrl-C ended half done: INTERRUPTED
====== =====================================================================
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from minirospy.base.errors import (
    MasterUnreachableError,
    MessageException,
    MinirospyError,
    NodeUnreachableError,
    NotFoundError,
    ROSException,
    ServiceException,
    UsageError,
)
from minirospy.base.escape import SafeTerminal, escaped
from minirospy.base.ros1_imports import prefer_ros1
from minirospy.base.suggestions import did_you_mean
from minirospy.command.parser import CommandLineError

if TYPE_CHECKING:
    from minirospy.base.names import Arguments
    from minirospy.introspect.graph import Graph
    from minirospy.introspect.streams import ToolNode

__all__ = [
    "INTERRUPTED",
    "NO_MASTER",
    "RosText",
    "WordedError",
    "Wording",
    "complain",
    "hint_near",
    "ros_words",
    "run",
    "tool_node",
    "warn",
    "warn_no_subscribers",
    "warn_unpublished",
]


_PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))

_IN_ARCHIVE = (
    "minirospy cannot run from the archive {}: its programs, launch files and messages are files; "
    "install it into a venv, or by pipx"
)

INTERRUPTED = 130
"""As a shell has it of a program that SIGINT ended: `catkin_make && roslaunch ...` goes no further."""


class RosText(NamedTuple):
    """The text that ROS prints about an error, and its exit status.

    ``text`` may name ``{name}`` and ``{uri}`` of the error.
    """

    text: str
    status: int = 1


class WordedError(MinirospyError):
    """An error for which ROS has words that depend on more than the error: ``ros`` are printed first."""

    def __init__(self, error: Exception, ros: RosText) -> None:
        super().__init__(str(error))
        self.ros = ros


Wording = Mapping[str, RosText]
"""Kind of a NotFoundError, ``no answer from`` + kind of a NodeUnreachableError, or ``master`` -> ROS's words."""

NO_MASTER = RosText("ERROR: Unable to communicate with master!")


def ros_words(error: Exception, wording: Wording) -> RosText:
    """Return what ROS prints about an error; an empty text where it has none."""
    if isinstance(error, CommandLineError):
        return RosText(error.ros_text, 2)
    if isinstance(error, WordedError):
        return error.ros

    key, fields = "", {"name": "", "uri": ""}
    if isinstance(error, MasterUnreachableError):
        key = "master"
    elif isinstance(error, NotFoundError):
        key, fields = error.kind, {"name": error.name, "uri": ""}
    elif isinstance(error, NodeUnreachableError):
        key, fields = f"no answer from {error.kind}", {"name": error.name, "uri": error.uri}
    text, status = wording.get(key, RosText("", 2 if isinstance(error, UsageError) else 1))
    return RosText(text.format(**fields), status)


_WITH_ROS2 = ("minirospy", "minirospy ros2-bridge")
"""Commands whose process may need ROS 2's packages; `minirospy VERB` runs the verb's own command."""


def run(
    name: str,
    body: Callable[[], int | None],
    interrupted: int = 0,
    wording: Wording = MappingProxyType({}),
    *,
    heeds_interrupts: bool = True,
) -> int:
    """Run ``body`` and return the exit status, at Ctrl-C ``interrupted``.

    A named error becomes ``name: ERROR: text`` on stderr, after ROS's words for it. ``heeds_interrupts``: whether
    SIGINT ends a command that has it ignored, unless its ``interrupted`` is a fault.
    """
    _open_streams()
    if not os.path.isdir(_PACKAGE):
        return complain(name, UsageError(_IN_ARCHIVE.format(os.path.dirname(_PACKAGE))), 2)
    _offer_overlay()
    if name not in _WITH_ROS2:
        prefer_ros1()
    _heed_break()
    if heeds_interrupts and not interrupted:
        _heed_interrupts()

    try:
        status = body() or 0
        sys.stdout.flush()
        return status
    except (MinirospyError, ROSException, ServiceException, MessageException) as error:
        text, status = ros_words(error, wording)
        return complain(name, error, status, text)
    except UnicodeEncodeError as error:
        wrong = error.object[error.start : error.end]
        return complain(name, UsageError(f"the argument {wrong!r} is not UTF-8 text"), 2)
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


def _offer_overlay() -> None:
    """Let this process and those that it starts import rospy also if no `.pth` file is read: `pip install --target`.

    At the end of the path, where the `.pth` file adds it, too.
    """
    overlay = os.path.join(_PACKAGE, "overlay")
    if overlay in sys.path:
        return
    sys.path.append(overlay)
    path = [os.environ.get("PYTHONPATH"), os.path.dirname(_PACKAGE), overlay]
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, path))


def _heed_break() -> None:
    """On Windows, end at Ctrl-Break as at Ctrl-C: it is what a launcher sends, and else ends a process without its clean-up."""
    import signal
    import threading

    from minirospy.base.signal_dispatch import interrupt_signals

    if threading.current_thread() is threading.main_thread():
        for number in interrupt_signals()[1:]:
            if signal.getsignal(number) == signal.SIG_DFL:
                signal.signal(number, signal.default_int_handler)


def _heed_interrupts() -> None:
    """End at SIGINT also if a script has started the command with `&`: the shell has it ignored there.

    As in ROS, whose commands are nodes and install their own handlers. A build keeps what its shell says.
    """
    import signal
    import threading

    if (
        threading.current_thread() is threading.main_thread()
        and signal.getsignal(signal.SIGINT) == signal.SIG_IGN
    ):
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _open_streams() -> None:
    """Open the standard streams that are missing, and let all of them print everything.

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
    """Print one line on stderr, after all that was printed before; it also says where ``name`` is not legal."""
    from minirospy.introspect.graph import why_illegal

    why = why_illegal(name) if name else ""
    sys.stdout.flush()
    # One write: a thread may warn while others print.
    print(escaped(f"WARNING: {what}{why and f'; {why}'}\n", "\n"), end="", file=sys.stderr)


def warn_unpublished(graph: Graph, topic: str) -> None:
    """Warn that a topic is not known to the master, and name similar ones."""
    warn(f"topic [{topic}] does not appear to be published yet", topic)
    hint_near(topic, graph.state().publishers)


def warn_no_subscribers(topic: str, subscribed: Iterable[str]) -> None:
    """Warn that nobody subscribes to ``topic`` where one that is nearly the same is in ``subscribed``.

    A publisher may come first, so only what looks like a slip of the keyboard is reported: /robot2/scan is not one
    where /robot1/scan has subscribers.
    """
    others = [each for each in subscribed if _without_digits(each) != _without_digits(topic)]
    if near := did_you_mean(topic, others, only_slips=True):
        warn(f"topic [{topic}] has no subscribers yet{near}")


def _without_digits(name: str) -> str:
    return name.translate(dict.fromkeys(map(ord, "0123456789")))


def hint_near(name: str, known: Iterable[str]) -> None:
    """Print the names similar to ``name`` on stderr, below the warning that it is awaited."""
    near = did_you_mean(name, (each for each in known if each != name))
    if near:
        print(escaped(f"{near.removeprefix('; ')}\n", "\n"), end="", file=sys.stderr)


@contextlib.contextmanager
def tool_node(tool: str, arguments: Arguments | None = None, *, ros_time: bool = False) -> Iterator[ToolNode]:
    """Yield the node of a command that listens or publishes; it leaves the graph also where `kill` ends the command.

    ``arguments``: what a launch file gives it as a node: `__name:=`, `__ns:=`, `__master:=`.
    """
    import signal

    from minirospy.base.environment import Environment
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


def complain(name: str, error: Exception, status: int = 1, ros_text: str = "") -> int:
    """Print an error on stderr, after all that was printed before: ROS's text, then ours. Return ``status``."""
    _flush()
    if ros_text:
        print(escaped(ros_text, "\n\t"), file=sys.stderr)
    print(escaped(f"{name}: ERROR: {error}", "\n"), file=sys.stderr)
    return status


def _flush() -> None:
    """Print what waits; where that cannot be, it is dropped, also from the interpreter's own flush at its end."""
    try:
        sys.stdout.flush()
    except OSError:
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
