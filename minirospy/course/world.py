"""The surroundings of a check: a new master on a free port, a new virtual board, and the programs.

A live check watches the student's own master and board instead, and starts nothing.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import TracebackType
from typing import TYPE_CHECKING

from minirospy.base.child_lifetime import guard_children
from minirospy.base.clock import SignalSafeEvent
from minirospy.base.environment import LOOPBACK, Environment
from minirospy.board.board import Board
from minirospy.course.programs import Program, find_command
from minirospy.introspect.fields import field_value, parse_path
from minirospy.introspect.graph import Graph
from minirospy.introspect.messages import Received
from minirospy.introspect.streams import ToolNode, TopicPublisher
from minirospy.ros.roslaunch.launcher import guardian
from minirospy.ros.rosout.node import RosoutNode
from minirospy.ros.rostest.runner.runner import master_of_tests
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.runtime.transport.loop import LoopThread
from minirospy.workspace.packages import Packages

if TYPE_CHECKING:
    from minirospy.core.idl.protocols import Message

__all__ = ["Arrival", "World"]

_POLL_SECONDS = 0.02
LAST_EFFECT_SECONDS = 1.0  # seconds after a program's exit in which its last actions can still take effect
_KEPT_MESSAGES = 5000  # messages kept per topic: one minute at 80 Hz
_STOP_SECONDS = 10.0  # timeout in seconds for a program to exit after Ctrl-C
_LAUNCH_STOP_SECONDS = 25.0  # timeout in seconds for roslaunch, which gives a node up to 15 s after Ctrl-C
# ROS variables that the tested programs inherit. Others are removed, because they describe the student's master and network.
_PASSED_ON = ("ROS_PACKAGE_PATH", "ROS_HOME")
_GUARDIAN_SECONDS = (
    "2",
    "1",
)  # the guardian's timeouts after SIGINT and SIGTERM if the check itself is killed

_numbers = itertools.count(1)


class Arrival:
    """A message and its time of arrival, in seconds of the monotonic clock."""

    __slots__ = ("received", "time")

    def __init__(self, received: Received) -> None:
        self.received = received
        self.time = time.monotonic()


def _keep(kept: deque[Arrival], received: Received) -> None:
    kept.append(Arrival(received))


class _Repeat:
    """A thread that publishes a message repeatedly."""

    def __init__(self, publisher: TopicPublisher, message: Message, rate: float) -> None:
        self._ended = SignalSafeEvent()

        def repeat() -> None:
            while not self._ended.wait(1 / rate):
                publisher.publish(message)

        self._thread = threading.Thread(target=repeat, name="check-publisher", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop publishing. Idempotent."""
        self._ended.set()
        self._thread.join()


class World:
    """The environment of one check, as a context manager. All time limits are multiplied by ``patience``.

    With ``work_ends``, the student's programs are expected to exit by themselves.
    ``board`` is the virtual board, ``environment`` the programs' environment, ``programs`` all started programs, in order.
    """

    def __init__(
        self,
        *,
        live: bool = False,
        patience: float = 1.0,
        listens: Sequence[str] = (),
        needs_graph: bool = True,
        work_ends: bool = False,
    ) -> None:
        self.live = live
        self.patience = patience
        self.programs: list[Program] = []
        self._listens = tuple(listens)
        self._needs_graph = needs_graph
        self._work_ends = work_ends
        self._arrivals: dict[str, deque[Arrival]] = {}
        self._repeats: dict[str, _Repeat] = {}
        self._publishers: dict[str, TopicPublisher] = {}
        self._stack = contextlib.ExitStack()
        self._packages = Packages()
        self._guardian: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> World:
        try:
            self._open()
        except BaseException:
            self._stack.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Stop the programs, newest first, then everything else. Idempotent."""
        for repeat in self._repeats.values():
            repeat.close()
        self.stop_programs()
        self._stack.close()

    def start(self, word: str, *, is_work: bool) -> Program:
        """Start a program. Raise NotFoundError if the file does not exist, UsageError if it is not a program."""
        command = find_command(word, self._packages)
        program = Program(command, self.environ, is_work=is_work)
        self.programs.append(program)
        self._tell_guardian(f"+{program.process.pid}")
        return program

    def stop_programs(self, *, only_work: bool = False) -> None:
        """Stop the programs with Ctrl-C, newest first."""
        for program in reversed(self.programs):
            if program.is_work or not only_work:
                was_running = program.status is None
                program.stop((_LAUNCH_STOP_SECONDS if program.is_launch else _STOP_SECONDS) * self.patience)
                if was_running:
                    self._tell_guardian(f"-{program.process.pid}")

    def wait_until(self, holds: Callable[[], bool], seconds: float, *, needs_work: bool = True) -> bool:
        """Poll ``holds()`` until it is true, or ``seconds`` multiplied by the patience have passed. Return the last result.

        Stop earlier if all of the student's programs have exited, unless they are expected to, or the condition does not need
        them (``needs_work``).
        """
        end = time.monotonic() + seconds * self.patience
        while not holds():
            if needs_work and self._work_has_ended():
                end = min(end, time.monotonic() + LAST_EFFECT_SECONDS * self.patience)
            if time.monotonic() >= end:
                # Call ``holds`` once more, because the last poll may be long ago on a busy machine.
                return holds()
            time.sleep(_POLL_SECONDS)
        return True

    def _work_has_ended(self) -> bool:
        """Return whether all student programs have exited, although the trial expects them to keep running."""
        work = [program for program in self.programs if program.is_work]
        return bool(work) and not self._work_ends and all(each.status is not None for each in work)

    def nodes(self) -> set[str]:
        """Return the names of the registered nodes, except the check's own."""
        state = self.graph.state()
        found = {node for table in state for nodes in table.values() for node in nodes}
        return found - {self.node.name, "/rosout"}

    def arrivals(self, topic: str) -> list[Arrival]:
        """Return the messages received on one of the topics that the check subscribes to."""
        return list(self._arrivals.get(topic, ()))

    def value(self, arrival: Arrival, path: str) -> object:
        """Return the value of a field in a received message.

        Raise NotFoundError if there is no such field, IndexError if an array is too short.
        """
        return field_value(
            self.node.classes.read(arrival.received), parse_path(path.strip("/").replace(".", "/"))
        )

    def publish(self, topic: str, type_: str, values: object, rate: float) -> None:
        """Publish a message at ``rate`` Hz until the next call for this topic. If the rate is 0, publish it once and latched.

        Raise NotFoundError if the type does not exist, MessageException if the values do not match it.
        """
        from minirospy.core.idl.load import message_class
        from minirospy.introspect.messages import check, fill, words_of

        message = fill(
            message_class(type_)(), [values] if values is not None else [], words_of(time.time_ns())
        )
        check(message)
        if topic in self._repeats:
            self._repeats.pop(topic).close()
        if topic not in self._publishers:
            self._publishers[topic] = self.node.publisher(topic, type(message), latch=True)
        publisher = self._publishers[topic]
        publisher.publish(message)
        if rate:
            self._repeats[topic] = _Repeat(publisher, message, rate)

    def _open(self) -> None:
        if self.live:
            self.environ: Mapping[str, str] = dict(os.environ)
            self.environment = Environment.read()
            self.board = self._stack.enter_context(Board())
        else:
            self._open_own()
        if not self._needs_graph:
            return
        self.node = self._stack.enter_context(ToolNode(self.environment, "check"))
        master = MasterProxy(self.environment.master_uri, self.node.name)
        self._stack.callback(master.close)
        self.graph = Graph(master, self.node.name)
        for topic in self._listens:
            kept = self._arrivals[topic] = deque(maxlen=_KEPT_MESSAGES)
            self.node.measure(topic, partial(_keep, kept))

    def _open_own(self) -> None:
        self._stack.enter_context(guard_children())
        folder = self._stack.enter_context(
            tempfile.TemporaryDirectory(prefix="minirospy-check-", ignore_cleanup_errors=True)
        )
        name = f"check-{os.getpid()}-{next(_numbers)}"
        # This variable, which the programs inherit, makes the board's server exit with its last client.
        os.environ["MINIROSPY_BOARD_TEMPORARY"] = "1"
        self._stack.callback(os.environ.pop, "MINIROSPY_BOARD_TEMPORARY", None)
        environ = {
            key: value
            for key, value in os.environ.items()
            if not key.startswith(("ROS_", "ROSCONSOLE_", "MINIROSPY_")) or key in _PASSED_ON
        }
        if "MINIROSPY_RUNTIME_DIR" in os.environ:
            environ["MINIROSPY_RUNTIME_DIR"] = os.environ["MINIROSPY_RUNTIME_DIR"]
        environ |= {
            "ROS_LOG_DIR": folder,
            "MINIROSPY_BOARD": name,
            "MINIROSPY_BOARD_TEMPORARY": "1",
            "MINIROSPY_LOCAL": "1",
            "PYTHONUNBUFFERED": "1",
        }
        private = Environment.read({**environ, "ROS_MASTER_URI": "http://localhost:11311"})
        self.environment = self._stack.enter_context(
            master_of_tests(private._replace(allow=LOOPBACK), f"check-{os.getpid()}")
        )
        self._open_rosout()
        environ["ROS_MASTER_URI"] = self.environment.master_uri
        self.environ = environ
        self._open_guardian()
        self.board = self._stack.enter_context(Board(name))
        self.board.reset()

    def _open_rosout(self) -> None:
        loop = LoopThread("check-rosout")
        self._stack.callback(loop.close)
        rosout = RosoutNode(self.environment, None, lambda: True)
        loop.run(rosout.start())
        self._stack.callback(lambda: loop.run(rosout.close(), 5.0))

    def _open_guardian(self) -> None:
        """Start the guardian script, which stops the programs if this process is killed."""
        if sys.platform == "win32":
            return  # guard_children() stops the programs on Windows
        words = [
            sys.executable,
            "-IS",
            str(guardian.__file__),
            *_GUARDIAN_SECONDS,
            self.environment.master_uri,
        ]
        self._guardian = subprocess.Popen(words, stdin=subprocess.PIPE, start_new_session=True)
        self._stack.callback(self._close_guardian)

    def _close_guardian(self) -> None:
        if self._guardian is None:
            return
        with contextlib.suppress(OSError):
            self._guardian.communicate(timeout=10)
        self._guardian = None

    def _tell_guardian(self, line: str) -> None:
        if self._guardian is not None and self._guardian.stdin is not None:
            with contextlib.suppress(OSError, ValueError):
                self._guardian.stdin.write(f"{line}\n".encode())
                self._guardian.stdin.flush()
