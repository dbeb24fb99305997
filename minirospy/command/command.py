"""The common part of all commands: parsing arguments, running as a node, errors and exit statuses.

A command is a typed function that raises; `main(argv)` passes it to :func:`run`, which converts exceptions to one line on
stderr and an exit status:

====== =====================================================================
status when
====== =====================================================================
0      success; a stream, a wait or a prompt ended by Ctrl-C or a closed pipe
1      failure: no master, an unknown name, a peer that fails
2      usage error: unknown option, missing argument
130    unfinished work interrupted by Ctrl-C: INTERRUPTED
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
"""The exit status that shells use for a program terminated by SIGINT. Being nonzero, it stops `catkin_make && roslaunch ...`."""


class RosText(NamedTuple):
    """ROS's message for an error, and its exit status.

    ``text`` may contain ``{name}`` and ``{uri}``, which are replaced by the error's name and URI.
    """

    text: str
    status: int = 1


class WordedError(MinirospyError):
    """An error for which ROS's message depends on the command. ``ros`` is ROS's message; it is printed first."""

    def __init__(self, error: Exception, ros: RosText) -> None:
        super().__init__(str(error))
        self.ros = ros


Wording = Mapping[str, RosText]
"""ROS's messages, keyed by the kind of a NotFoundError, ``no answer from`` + the kind of a NodeUnreachableError, or
``master``.
"""

NO_MASTER = RosText(f"ERROR: {MasterUnreachableError.ros_text}")


def ros_words(error: Exception, wording: Wording) -> RosText:
    """Return ROS's message for an error; its text is empty if ROS has none."""
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
"""Commands that may need ROS 2's packages. "minirospy" is included because `minirospy ros2-bridge` runs in its process."""


def run(
    name: str,
    body: Callable[[], int | None],
    interrupted: int = 0,
    wording: Wording = MappingProxyType({}),
    *,
    heeds_interrupts: bool = True,
) -> int:
    """Run ``body`` and return the exit status; after Ctrl-C, return the status ``interrupted``.

    An expected error is printed as ``name: ERROR: text`` on stderr, after ROS's message for it. ``heeds_interrupts``:
    exit on SIGINT even if the signal was ignored at the start, unless ``interrupted`` is nonzero.
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
        # Succeed if the program that reads stdout, such as `| head`, has exited.
        _flush()
        return 0
    except OSError as error:
        # The cause may be a full disk or missing permissions, so print the file's name and the system's message.
        why = error.strerror or str(error)
        return complain(name, MinirospyError(f"{error.filename}: {why}" if error.filename else why))
    except KeyboardInterrupt:
        return interrupted


def _offer_overlay() -> None:
    """Make rospy importable in this process and its children even if no `.pth` file is read, as after `pip install --target`.

    The folder is appended to the path, as the `.pth` file would do.
    """
    overlay = os.path.join(_PACKAGE, "overlay")
    if overlay in sys.path:
        return
    sys.path.append(overlay)
    path = [os.environ.get("PYTHONPATH"), os.path.dirname(_PACKAGE), overlay]
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, path))


def _heed_break() -> None:
    """On Windows, treat Ctrl-Break like Ctrl-C: launchers send it, and by default it ends a process without cleanup."""
    import signal
    import threading

    from minirospy.base.signal_dispatch import interrupt_signals

    if threading.current_thread() is threading.main_thread():
        for number in interrupt_signals()[1:]:
            if signal.getsignal(number) == signal.SIG_DFL:
                signal.signal(number, signal.default_int_handler)


def _heed_interrupts() -> None:
    """Exit on SIGINT even if a script started the command with `&`, which makes the shell ignore the signal for it.

    ROS's commands exit in this case too, because they are nodes and install their own handlers. Build commands do not
    call this function; they keep the shell's setting.
    """
    import signal
    import threading

    if (
        threading.current_thread() is threading.main_thread()
        and signal.getsignal(signal.SIGINT) == signal.SIG_IGN
    ):
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _open_streams() -> None:
    """Open missing standard streams, and make all of them able to print any string.

    A closed stream (`rostopic list >&-`, a Windows program without a console) would be None. Characters that an output
    cannot encode (a pipe with a Windows code page) are printed as escapes.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115 it stays for the process
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if type(stream) is io.TextIOWrapper and stream.isatty():
            # Do not let the terminal execute control sequences in strings from robots.
            setattr(sys, name, SafeTerminal.around(stream))


def warn(what: str, name: str = "") -> None:
    """Print one line on stderr after flushing stdout. If ``name`` is not a legal name, add the reason."""
    from minirospy.introspect.graph import why_illegal

    why = why_illegal(name) if name else ""
    sys.stdout.flush()
    # Use a single write, because other threads may be printing.
    print(escaped(f"WARNING: {what}{why and f'; {why}'}\n", "\n"), end="", file=sys.stderr)


def warn_unpublished(graph: Graph, topic: str) -> None:
    """Warn that the master does not know a topic, and print similar topic names."""
    warn(f"topic [{topic}] does not appear to be published yet", topic)
    hint_near(topic, graph.state().publishers)


def warn_no_subscribers(topic: str, subscribed: Iterable[str]) -> None:
    """Warn that ``topic`` has no subscribers if ``subscribed`` contains a nearly identical name.

    A publisher may start before its subscribers, so only a likely typo is reported. If /robot1/scan has subscribers,
    /robot2/scan is not a typo.
    """
    others = [each for each in subscribed if _without_digits(each) != _without_digits(topic)]
    if near := did_you_mean(topic, others, only_slips=True):
        warn(f"topic [{topic}] has no subscribers yet{near}")


def _without_digits(name: str) -> str:
    return name.translate(dict.fromkeys(map(ord, "0123456789")))


def hint_near(name: str, known: Iterable[str]) -> None:
    """Print names similar to ``name`` on stderr, after the warning that the command is waiting for ``name``."""
    near = did_you_mean(name, (each for each in known if each != name))
    if near:
        print(escaped(f"{near.removeprefix('; ')}\n", "\n"), end="", file=sys.stderr)


@contextlib.contextmanager
def tool_node(tool: str, arguments: Arguments | None = None, *, ros_time: bool = False) -> Iterator[ToolNode]:
    """Yield the node for a command that listens or publishes. Unregister it even if `kill` ends the command.

    ``arguments``: the arguments that a launch file passes to nodes, such as `__name:=`, `__ns:=`, `__master:=`.
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
    # Raise KeyboardInterrupt on SIGTERM, too, as for Ctrl-C.
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with ToolNode(environment, tool, name=special.get("__name", ""), ros_time=ros_time) as node:
            if node.simulated:
                warn("may be using simulated time")
            yield node
    finally:
        signal.signal(signal.SIGTERM, before)


def complain(name: str, error: Exception, status: int = 1, ros_text: str = "") -> int:
    """Print an error on stderr after flushing stdout: first ROS's message, then minirospy's. Return ``status``.

    If there is no master, minirospy's message is printed only on a terminal, because scripts compare the last line with ROS's.
    """
    _flush()
    if ros_text:
        print(escaped(ros_text, "\n\t"), file=sys.stderr)
        if _is_without_master(error) and not _has_terminal():
            return status
    print(escaped(f"{name}: ERROR: {error}", "\n"), file=sys.stderr)
    return status


def _is_without_master(error: BaseException | None) -> bool:
    while isinstance(error, WordedError):
        error = error.__cause__
    return isinstance(error, MasterUnreachableError)


def _has_terminal() -> bool:
    return sys.stderr.isatty()


def _flush() -> None:
    """Flush stdout. If that fails, discard the output, so that the interpreter's own flush at exit does not fail, too."""
    try:
        sys.stdout.flush()
    except OSError:
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
