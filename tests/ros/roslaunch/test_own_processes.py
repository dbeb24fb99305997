"""A ProcessMonitor with processes of the program's own class."""

from __future__ import annotations

import threading
from typing import Any

import pytest
import roslaunch
import roslaunch.pmon

from minirospy.base.environment import Environment
from minirospy.ros.roslaunch.launcher.spec import LaunchSpec
from minirospy.ros.roslaunch.roslaunch.pmon import ApiLauncher
from tests.waiting import wait_until


class Own(roslaunch.pmon.Process):  # type: ignore[misc,unused-ignore]
    """A process that is only an object."""

    def __init__(
        self, name: str, *, alive: bool = True, respawn: bool = False, required: bool = False
    ) -> None:
        super().__init__("pkg", name, [], {}, respawn, 0.0, required)
        self.alive = alive

    def is_alive(self) -> bool:
        return self.alive

    def start(self) -> bool:
        self.spawn_count += 1
        self.alive = True
        return True

    def stop(self, errors: list[str] | None = None) -> None:
        self.alive = False


class Faulty(roslaunch.pmon.ProcessListener):  # type: ignore[misc,unused-ignore]
    """A listener that fails."""

    def process_died(self, process_name: str, exit_code: int) -> None:
        raise RuntimeError("a fault")


class Noting(roslaunch.pmon.ProcessListener):  # type: ignore[misc,unused-ignore]
    """A listener that stores the names of the exited processes."""

    def __init__(self) -> None:
        self.died: list[str] = []

    def process_died(self, process_name: str, exit_code: int) -> None:
        self.died.append(process_name)


def watch(*processes: Own, listeners: tuple[object, ...] = ()) -> roslaunch.pmon.ProcessMonitor:
    """Return a monitor that watches the processes."""
    monitor = roslaunch.pmon.ProcessMonitor()
    for listener in listeners:
        monitor.add_process_listener(listener)
    for process in processes:
        monitor.register(process)
    monitor.start()
    return monitor


def test_a_listener_that_fails_does_not_keep_a_required_process_from_ending_the_launch() -> None:
    noting = Noting()
    monitor = watch(Own("a", alive=False, required=True), listeners=(Faulty(), noting))
    try:
        wait_until(lambda: monitor.done)
        assert noting.died == ["a"]
    finally:
        monitor.shutdown()
        monitor.join(30)


def test_a_listener_that_fails_does_not_keep_a_process_from_being_restarted() -> None:
    process, noting = Own("a", alive=False, respawn=True), Noting()
    monitor = watch(process, listeners=(Faulty(), noting))
    try:
        wait_until(lambda: process.spawn_count == 1)
        assert (noting.died, monitor.get_active_names()) == (["a"], ["a"])
    finally:
        monitor.shutdown()
        monitor.join(30)


def test_no_process_is_registered_once_a_shutdown_was_requested() -> None:
    monitor = roslaunch.pmon.ProcessMonitor()
    monitor.shutdown()
    assert monitor.is_shutdown
    with pytest.raises(roslaunch.RLException, match=r"cannot add process \[a\] after"):
        monitor.register(Own("a"))
    monitor.close()


def test_no_process_is_registered_while_the_others_are_terminated() -> None:
    """The monitor ends by itself here, without a shutdown()."""
    refused: list[bool] = []

    class Registering(Own):
        def stop(self, errors: list[str] | None = None) -> None:
            super().stop(errors)
            with pytest.raises(roslaunch.RLException):
                monitor.register(Own("late"))
            refused.append(True)

    monitor = roslaunch.pmon.ProcessMonitor()
    monitor.register(Registering("a"))
    monitor.close()
    assert (refused, monitor.get_active_names()) == ([True], [])


def test_no_process_is_restarted_once_a_shutdown_was_requested() -> None:
    class Stopping(Own):
        def stop(self, errors: list[str] | None = None) -> None:
            super().stop(errors)
            monitor.shutdown()

    process = Stopping("a", alive=False, respawn=True)
    monitor = watch(process)
    monitor.join(30)
    assert (monitor.done, process.spawn_count, process.alive) == (True, 0, False)


def test_a_process_that_is_being_restarted_does_not_outlive_the_shutdown() -> None:
    stopped = threading.Event()

    class Starting(Own):
        def start(self) -> bool:
            stopped.clear()
            monitor.shutdown()
            # The process must not be terminated before it has started. If it is, this wait ends early.
            stopped.wait(0.3)
            return super().start()

        def stop(self, errors: list[str] | None = None) -> None:
            super().stop(errors)
            stopped.set()

    process = Starting("a", alive=False, respawn=True)
    monitor = watch(process)
    monitor.join(30)
    assert (monitor.done, process.spawn_count, process.alive) == (True, 1, False)


def test_a_listener_may_wait_for_the_shutdown() -> None:
    """The wait returns immediately, because the shutdown waits for the listener."""

    class Ending(roslaunch.pmon.ProcessListener):  # type: ignore[misc,unused-ignore]
        def process_died(self, process_name: str, exit_code: int) -> None:
            roslaunch.pmon.shutdown_process_monitor(monitor)

    other = Own("b")
    monitor = roslaunch.pmon.ProcessMonitor()
    monitor.add_process_listener(Ending())
    monitor.register(Own("a", alive=False))
    monitor.register(other)
    monitor.start()
    monitor.join(30)
    assert (monitor.done, other.alive) == (True, False)


class NodeLauncher(ApiLauncher):
    """A launcher without nodes; ``fault`` is raised by close()."""

    def __init__(self, fault: Exception | None = None) -> None:
        super().__init__(LaunchSpec(), Environment.read())
        self.fault = fault
        self.is_closed = False

    def close(self) -> None:
        super().close()
        self.is_closed = True
        if self.fault:
            raise self.fault


def test_the_shutdown_ends_although_terminating_the_nodes_fails() -> None:
    monitor = roslaunch.pmon.ProcessMonitor(launcher=NodeLauncher(OSError("a fault")))
    with pytest.raises(OSError, match="a fault"):
        monitor.close()
    assert monitor.done


def test_the_nodes_are_terminated_although_terminating_an_own_process_fails() -> None:
    class Exiting(Own):
        def stop(self, errors: list[str] | None = None) -> None:
            raise SystemExit(3)

    launcher = NodeLauncher()
    monitor = roslaunch.pmon.ProcessMonitor(launcher=launcher)
    monitor.register(Exiting("a"))
    with pytest.raises(SystemExit):
        monitor.close()
    assert (launcher.is_closed, monitor.done) == (True, True)


def test_the_exited_processes_can_be_listed_while_another_node_is_started() -> None:
    class Launched:
        """An exited process; while it is examined, another process is stored."""

        name = "a"

        @property
        def started(self) -> bool:
            known["b"] = Launched()
            return True

    launcher = NodeLauncher()
    known: dict[str, Any] = launcher.known  # type: ignore[assignment]
    known["a"] = Launched()
    monitor = roslaunch.pmon.ProcessMonitor(launcher=launcher)
    assert [each.name for each in monitor.dead_list] == ["a"]
    monitor.close()
