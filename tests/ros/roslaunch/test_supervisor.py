"""ros/roslaunch/launcher/supervisor: respawning of nodes and the end of a run, with a clock that the test controls."""

from __future__ import annotations

import queue
import signal
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import pytest

from minirospy.ros.roslaunch.launcher.output import Output
from minirospy.ros.roslaunch.launcher.process import Process, Timeouts
from minirospy.ros.roslaunch.launcher.spec import NodeSpec
from minirospy.ros.roslaunch.launcher.supervisor import Supervisor


class FakePopen:
    """A process that exits when the test requests it."""

    def __init__(self, pid: int) -> None:
        self.pid = pid
        self.returncode: int | None = None
        self._exited: queue.SimpleQueue[int] = queue.SimpleQueue()

    def exit(self, code: int) -> None:
        self.returncode = code
        self._exited.put(code)

    def poll(self) -> int | None:
        return self.returncode

    def wait(self) -> int:
        return self._exited.get()


class Clock:
    """A clock that advances only while the supervisor waits for an event."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


class Events(queue.SimpleQueue):  # type: ignore[type-arg]
    """A queue whose timeouts expire immediately on the test's clock. It blocks while no node is to be respawned."""

    def __init__(self, clock: Clock, supervisor: Supervisor) -> None:
        self.clock = clock
        self.supervisor = supervisor
        self.before_wait: Callable[[], object] = lambda: None

    def get(self, block: bool = True, timeout: float | None = None) -> Any:
        if not self.supervisor._restarts:
            return super().get(timeout=30)
        assert timeout is not None
        self.before_wait()
        try:
            return super().get(block=False)
        except queue.Empty:
            self.clock.now += timeout
            raise


class Scene:
    """A supervisor of nodes that a test starts and stops."""

    def __init__(self) -> None:
        self.clock = Clock()
        self.started: list[tuple[float, str]] = []
        self.popens: list[FakePopen] = []
        self.on_start: list[Any] = []
        self.supervisor = Supervisor(
            self.start, lambda _: None, Output(title=False), Timeouts(), clock=self.clock
        )
        self.events = Events(self.clock, self.supervisor)
        self.supervisor._events = self.events

    def start(self, node: NodeSpec, name: str) -> Process:
        popen = FakePopen(len(self.popens) + 1)
        self.popens.append(popen)
        self.started.append((self.clock.now, name))
        if self.on_start:
            self.on_start.pop(0)()
        return Process(name, ["program"], popen, node)  # type: ignore[arg-type]

    def add(self, **options: Any) -> FakePopen:
        self.supervisor.add(self.start(NodeSpec("/a", "pkg", "a.py", **options), "a-1"))
        return self.popens[-1]


@pytest.mark.parametrize(
    ("delay", "waited"),
    [
        pytest.param(0.0, 0.1, id="not-at-once"),
        pytest.param(0.05, 0.1, id="not-sooner"),
        pytest.param(12.5, 12.5, id="as-long-as-it-says"),
    ],
)
def test_a_node_respawns_after_its_delay(delay: float, waited: float) -> None:
    scene = Scene()
    scene.add(respawn=True, respawn_delay=delay).exit(1)
    scene.on_start.append(lambda: scene.supervisor.stop("test"))
    assert scene.supervisor.watch() == 0
    assert scene.started == [(100.0, "a-1"), (100.0 + waited, "a-1")]
    assert scene.supervisor.processes[0].starts == 2
    scene.popens[-1].exit(0)


def test_a_node_without_respawn_is_not_started_again() -> None:
    scene = Scene()
    scene.add().exit(1)
    assert scene.supervisor.watch() is None
    assert len(scene.started) == 1


@pytest.mark.parametrize(("code", "status"), [(0, 0), (1, 1), (-11, 1)])
def test_the_end_of_a_required_node_ends_the_run(code: int, status: int) -> None:
    scene = Scene()
    scene.add(required=True).exit(code)
    other = scene.add()
    assert scene.supervisor.watch() == status
    other.exit(0)


def test_a_node_that_was_ended_does_not_respawn() -> None:
    scene = Scene()
    popen = scene.add(respawn=True)
    scene.supervisor.processes[0].is_ending = True
    popen.exit(0)
    assert scene.supervisor.watch() is None
    assert len(scene.started) == 1


def test_a_stop_ends_a_run_that_waits_to_respawn() -> None:
    scene = Scene()
    scene.add(respawn=True, respawn_delay=1000.0).exit(1)
    scene.events.before_wait = lambda: scene.supervisor.stop("SIGINT")
    assert scene.supervisor.watch() == 0
    assert scene.supervisor.stopped_by == "SIGINT"
    assert len(scene.started) == 1


@pytest.mark.skipif(sys.platform == "win32", reason="sends a Unix signal to a thread")
def test_a_signal_that_interrupts_no_wait_is_noticed() -> None:
    """A signal just before the wait starts, or in another thread, does not interrupt the wait."""
    supervisor = Scene().supervisor
    supervisor._events = queue.SimpleQueue()
    before = signal.signal(signal.SIGUSR1, lambda *_: supervisor.stop("SIGUSR1"))
    too_late = threading.Timer(20.0, supervisor.stop, ("timeout",))

    def send() -> None:
        # Wait until the main thread blocks.
        time.sleep(0.1)
        signal.pthread_kill(threading.get_ident(), signal.SIGUSR1)

    try:
        too_late.start()
        threading.Thread(target=send).start()
        assert supervisor.watch(forever=True) == 0
    finally:
        too_late.cancel()
        signal.signal(signal.SIGUSR1, before)
    assert supervisor.stopped_by == "SIGUSR1"
