"""A ProcessMonitor with processes of the program's own class."""

from __future__ import annotations

import roslaunch
import roslaunch.pmon

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
