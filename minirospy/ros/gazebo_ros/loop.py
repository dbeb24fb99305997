"""The thread that owns the simulation. It steps in real time or faster, and runs jobs of other threads between steps."""

from __future__ import annotations

import threading
import time as wall
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import TYPE_CHECKING, TypeVar

from minirospy.base.clock import SignalSafeEvent, wait_for_event
from minirospy.base.errors import MinirospyError

if TYPE_CHECKING:
    from minirospy.ros.gazebo_ros.physics import LostModel, Simulation

__all__ = ["LoopClosed", "SimulationLoop"]

_T = TypeVar("_T")

DEFAULT_TICK_HZ = 250.0  # rate of /clock and the models' states; a 1000 Hz clock keeps every Python node busy
MAX_LAG_SECONDS = 0.1  # if the simulation lags by more than this, it does not catch up
MAX_STEPPING_SECONDS = 0.1  # maximum wall time per tick, so that jobs can run; a step may be as short as 1 ns

MAX_WAIT_SECONDS = 60.0  # maximum wait for the next steps; longer waits may overflow


class LoopClosed(MinirospyError):
    """Raised for a job if the simulation has already ended."""


class SimulationLoop:
    """Runs a simulation in a thread, in step with wall time.

    simulation: used only by this loop's thread; other threads use :meth:`call`. before_step: called before each step. on_tick:
    called at the tick rate of simulated time, and after each reset. on_lost: called for each model that the simulation has
    removed. on_failure: called if an error ends the thread; the error is then in ``failure``.
    """

    def __init__(self, simulation: Simulation, *, paused: bool = False, tick_rate: float = 0.0) -> None:
        self.simulation = simulation
        self.before_step: Callable[[], None] = lambda: None
        self.on_tick: Callable[[], None] = lambda: None
        self.on_lost: Callable[[LostModel], None] = lambda lost: None
        self.on_failure: Callable[[Exception], object] = lambda error: None
        self.failure: Exception | None = None
        self.real_time_factor = 0.0  # simulated seconds per wall second, over the last wall second
        self._paused = paused
        self._rate = simulation.physics.update_rate
        self._tick_rate = tick_rate or DEFAULT_TICK_HZ
        self._jobs: deque[tuple[Callable[[], object], Future[object]]] = deque()
        self._lock = threading.RLock()
        self._wake = threading.Condition(self._lock)
        self._is_closed = False
        self._deadline = wall.monotonic()
        self._measured = (wall.monotonic(), 0)
        self._end: tuple[int, Callable[[], object]] | None = None
        self._steps = 0
        self._thread = threading.Thread(target=self._run, name="simulation", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def close(self) -> None:
        """Stop the thread and wait for it. Pending jobs raise LoopClosed."""
        with self._lock:
            self._is_closed = True
            self._wake.notify_all()
        if threading.current_thread() is not self._thread and self._thread.is_alive():
            self._thread.join()

    def call(self, function: Callable[[], _T]) -> _T:
        """Run a function in the loop's thread between two steps; return its result. Raise LoopClosed if the loop has ended."""
        if threading.current_thread() is self._thread:
            return function()
        future: Future[_T] = Future()
        has_ended = SignalSafeEvent()
        future.add_done_callback(lambda _: has_ended.set())
        self._submit(function, future)
        # Do not wait in result(): a signal handler that interrupts it may hold the future's lock, which the loop needs.
        wait_for_event(has_ended, None)
        return future.result()

    def _submit(self, function: Callable[[], _T], future: Future[_T]) -> None:
        with self._lock:
            if self._is_closed:
                raise LoopClosed("the simulation has ended")
            self._jobs.append((function, future))  # type: ignore[arg-type]
            self._wake.notify_all()

    @property
    def is_paused(self) -> bool:
        """Return whether the simulation is paused."""
        return self._paused

    def set_paused(self, paused: bool) -> None:
        """Pause or continue; return when the current steps are done."""
        self.call(lambda: setattr(self, "_paused", paused))

    @property
    def update_rate(self) -> float:
        """Return the number of steps per second of wall time; 0 means as many as possible."""
        return self._rate

    def set_update_rate(self, rate: float) -> None:
        """Set the number of steps per second of wall time. Call this in the loop's thread."""
        self._rate = max(rate, 0.0)
        self._deadline = wall.monotonic()

    def end_after(self, steps: int, function: Callable[[], object]) -> None:
        """Pause the simulation and call ``function`` once the total number of steps has reached ``steps``."""
        self.call(lambda: setattr(self, "_end", (steps, function)))

    def step(self, count: int) -> None:
        """Advance by a number of steps, even while paused. Call this in the loop's thread."""
        for _ in range(count):
            self._step_once()
        self.on_tick()

    def reset(self, *, with_time: bool) -> None:
        """Reset the models and, if ``with_time``, the time. Call this in the loop's thread."""
        if with_time:
            self.simulation.reset()
        else:
            self.simulation.reset_models()
        self.on_tick()

    def _run(self) -> None:
        try:
            self._run_until_closed()
        except Exception as error:  # noqa: BLE001 - the services would wait for this thread for ever
            self.failure = error
            self.on_failure(error)
        with self._lock:
            self._is_closed = True
            while self._jobs:
                self._jobs.popleft()[1].set_exception(LoopClosed("the simulation has ended"))

    def _run_until_closed(self) -> None:
        self.on_tick()
        while not self._is_closed:
            self._run_jobs()
            if self._must_wait():
                continue
            period = self.simulation.physics.step
            count = self._advance(max(1, round(1 / (self._tick_rate * period))))
            self._deadline += count / self._rate if self._rate else 0.0
            self._measure()
            if self._end is not None and self._steps >= self._end[0]:
                self._paused = True
                self._end[1]()
                self._end = None

    def _advance(self, count: int) -> int:
        """Advance by at most ``count`` steps, by fewer if they take too long. Return the number of steps done."""
        end = wall.monotonic() + MAX_STEPPING_SECONDS
        done = 0
        while done < count and not self._is_closed:
            self._step_once()
            done += 1
            if wall.monotonic() > end:
                break
        self.on_tick()
        return done

    def _step_once(self) -> None:
        self._steps += 1
        self.before_step()
        for lost in self.simulation.step():
            self.on_lost(lost)

    def _run_jobs(self) -> None:
        while self._jobs:
            function, future = self._jobs.popleft()
            try:
                future.set_result(function())
            except BaseException as error:  # noqa: BLE001 - the caller gets it
                future.set_exception(error)

    def _must_wait(self) -> bool:
        """Wait while paused, or until the next steps are due. Return False if they are due, True if jobs may have arrived."""
        with self._lock:
            if self._jobs or self._is_closed:
                return True
            now = wall.monotonic()
            if self._paused:
                self._wake.wait()
                self._deadline = wall.monotonic()
                self._measured = (self._deadline, self.simulation.time_ns)
                return True
            if not self._rate or now - self._deadline > MAX_LAG_SECONDS:
                self._deadline = now
            if now < self._deadline:
                self._wake.wait(min(self._deadline - now, MAX_WAIT_SECONDS))
                return True
        return False

    def _measure(self) -> None:
        now, time_ns = wall.monotonic(), self.simulation.time_ns
        since, start_ns = self._measured
        if now - since >= 1:
            self.real_time_factor = max(0.0, (time_ns - start_ns) / 1e9 / (now - since))
            self._measured = (now, time_ns)
