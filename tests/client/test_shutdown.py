"""The rules of a shutdown, with a manual clock, and the time between a signal and the main thread's reaction."""

from __future__ import annotations

import functools
import gc
import logging
import math
import signal
import socket
import sys
import threading
from collections.abc import Iterator
from types import FrameType
from typing import cast

import pytest

from minirospy.base.signal_dispatch import is_dispatching_signal
from minirospy.client import signals
from minirospy.client.lifecycle import Lifecycle, ROSInterruptException
from minirospy.client.shutdown import Action, Awareness, Phase, ShutdownMachine
from minirospy.client.signals import SignalWatchdog
from tests.client.nudge import nudge


@pytest.fixture
def machine() -> ShutdownMachine:
    return ShutdownMachine()


def timeline(machine: ShutdownMachine, start: float, end: float) -> list[tuple[float, Action]]:
    """Return the actions at ten ticks per second from ``start`` to ``end``, each with its time."""
    times = [round(tenth / 10, 1) for tenth in range(round(start * 10), round(end * 10) + 1)]
    return [(now, action) for now in times for action in machine.tick(now)]


def test_nothing_happens_without_a_signal(machine: ShutdownMachine) -> None:
    for phase in Phase:
        machine.phase = phase
        assert timeline(machine, 0.0, 100.0) == []


def test_a_main_thread_that_goes_on_is_interrupted_once_and_reported(machine: ShutdownMachine) -> None:
    assert machine.signal(10.0) == []
    machine.phase = Phase.HOOKS
    assert timeline(machine, 10.0, 10.2) == []
    machine.phase = Phase.LEFT
    assert timeline(machine, 10.3, 100.0) == [(10.8, Action.INTERRUPT), (12.0, Action.REPORT)]


def test_hooks_run_in_another_thread_during_c_code(machine: ShutdownMachine) -> None:
    machine.signal(0.0)
    assert timeline(machine, 0.0, 0.9) == [(0.5, Action.RUN_HOOKS)]
    machine.phase = Phase.HOOKS
    # However long hooks take, the main thread is not interrupted before is_shutdown() is true.
    assert timeline(machine, 1.0, 9.9) == [(2.0, Action.REPORT)]
    machine.phase = Phase.DOWN
    assert timeline(machine, 10.0, 20.0) == [(10.5, Action.INTERRUPT)]


def test_interrupt_waits_while_the_main_thread_unregisters(
    machine: ShutdownMachine,
) -> None:
    machine.runs_in_main = True
    machine.signal(0.0)
    machine.phase = Phase.LEAVING
    assert timeline(machine, 0.0, 4.9) == [(2.0, Action.REPORT)]
    machine.phase = Phase.LEFT
    assert timeline(machine, 5.0, 10.0) == [(5.5, Action.INTERRUPT)]


def test_a_second_signal_ends_the_wait_for_the_master_alone(machine: ShutdownMachine) -> None:
    machine.runs_in_main = True
    machine.signal(0.0)
    machine.phase = Phase.LEAVING
    assert machine.signal(1.0) == [Action.STOP_LEAVING]
    machine.phase = Phase.LEFT
    # A main thread that continues is interrupted, as it is after a single signal.
    assert timeline(machine, 1.0, 1.9) == [(1.5, Action.INTERRUPT)]
    assert machine.signal(3.0) == [Action.EXIT]


def test_second_signal_interrupts_a_main_thread_that_ignores_shutdown(
    machine: ShutdownMachine,
) -> None:
    machine.signal(0.0)
    machine.phase = Phase.LEAVING
    assert machine.signal(0.1) == [Action.STOP_LEAVING, Action.KEYBOARD_INTERRUPT]
    assert timeline(machine, 0.2, 10.0) == [(2.0, Action.REPORT)]


@pytest.mark.parametrize("awareness", [*list(Awareness)[1:], None])
def test_a_main_thread_that_ends_by_itself_is_not_interrupted(
    machine: ShutdownMachine, awareness: Awareness | None
) -> None:
    machine.main_has_ended = awareness is None
    machine.main.awareness = awareness or Awareness.NONE
    machine.signal(0.0)
    machine.phase = Phase.LEFT
    assert timeline(machine, 0.0, 10.0) == [(2.0, Action.REPORT)]


def test_a_main_thread_that_is_notified_in_time_is_not_interrupted(machine: ShutdownMachine) -> None:
    machine.signal(0.0)
    machine.phase = Phase.LEFT
    assert timeline(machine, 0.0, 0.4) == []
    machine.main.awareness = Awareness.NOTIFIED
    assert timeline(machine, 0.5, 1.9) == []


def test_a_signal_after_another_shutdown_interrupts_half_a_second_later(machine: ShutdownMachine) -> None:
    machine.phase = Phase.LEFT
    assert timeline(machine, 0.0, 49.9) == []
    machine.signal(50.0)
    assert timeline(machine, 50.0, 60.0) == [(50.5, Action.INTERRUPT), (52.0, Action.REPORT)]


def test_the_second_signal_interrupts_and_the_third_ends(machine: ShutdownMachine) -> None:
    actions = [machine.signal(now) for now in (0.0, 0.1, 0.2, 0.3)]
    assert actions == [[], [Action.KEYBOARD_INTERRUPT], [Action.EXIT], [Action.EXIT]]


def test_a_second_signal_takes_the_place_of_the_interrupt(machine: ShutdownMachine) -> None:
    machine.signal(0.0)
    machine.phase = Phase.LEFT
    machine.tick(0.0)
    machine.signal(0.4)
    assert timeline(machine, 0.5, 10.0) == [(2.0, Action.REPORT)]


@pytest.mark.parametrize(
    ("awareness", "interrupted_at"),
    [
        (Awareness.NONE, 12.0),
        (Awareness.POLLS, 15.0),
        (Awareness.CUT_SHORT, 15.0),
        (Awareness.NOTIFIED, None),
    ],
)
def test_request_interrupts_a_main_thread_that_goes_on(
    machine: ShutdownMachine, awareness: Awareness, interrupted_at: float | None
) -> None:
    machine.main.awareness = awareness
    machine.phase = Phase.HOOKS
    machine.is_requested = True
    # However long the hooks take, the main thread is not interrupted while they run.
    assert timeline(machine, 0.0, 9.9) == []
    machine.phase = Phase.LEAVING
    expected = [] if interrupted_at is None else [(interrupted_at, Action.INTERRUPT)]
    assert timeline(machine, 10.0, 100.0) == expected


def test_request_does_not_interrupt_a_main_thread_that_sees_it_in_time(machine: ShutdownMachine) -> None:
    machine.main.awareness = Awareness.POLLS
    machine.is_requested = True
    machine.phase = Phase.LEFT
    assert timeline(machine, 0.0, 4.9) == []
    machine.main.awareness = Awareness.NOTIFIED
    assert timeline(machine, 5.0, 100.0) == []


def test_a_signal_after_a_request_shortens_the_wait(machine: ShutdownMachine) -> None:
    machine.is_requested = True
    machine.phase = Phase.LEFT
    assert timeline(machine, 0.0, 0.9) == []
    machine.signal(1.0)
    assert timeline(machine, 1.0, 10.0) == [(1.0, Action.INTERRUPT), (3.0, Action.REPORT)]


def test_a_signal_after_a_request_leaves_a_loop_that_polls_its_time(machine: ShutdownMachine) -> None:
    machine.main.awareness = Awareness.POLLS
    machine.is_requested = True
    machine.phase = Phase.LEFT
    machine.tick(0.0)
    machine.signal(1.0)
    assert timeline(machine, 1.0, 10.0) == [(3.0, Action.REPORT), (5.0, Action.INTERRUPT)]


def test_ctrl_c_interrupts_a_session_that_a_request_must_not_interrupt(machine: ShutdownMachine) -> None:
    machine.is_requested = True
    machine.phase = Phase.LEFT
    assert timeline(machine, 0.0, 3.0) == [(2.0, Action.INTERRUPT)]
    machine.drop_request()
    assert timeline(machine, 3.0, 100.0) == []
    machine.signal(100.0)
    assert timeline(machine, 100.0, 101.0) == [(100.0, Action.INTERRUPT)]


@pytest.fixture
def lifecycle() -> Lifecycle:
    return Lifecycle(lambda: None)


@pytest.fixture
def watchdog(lifecycle: Lifecycle) -> SignalWatchdog:
    """Return a watchdog that is not installed: tests call the handler as the system would."""
    return SignalWatchdog(lifecycle, lambda: None, lambda: False)


@pytest.mark.parametrize("was_notified", [False, True])
def test_a_thread_that_was_notified_meanwhile_is_not_interrupted(
    lifecycle: Lifecycle, watchdog: SignalWatchdog, *, was_notified: bool
) -> None:
    lifecycle.signal_shutdown("test")
    # The watchdog sends the interrupt. Before it arrives, the program polls is_shutdown() and starts to clean up.
    if was_notified:
        assert lifecycle.poll_shutdown()
        nudge(watchdog, Action.INTERRUPT)
    else:
        with pytest.raises(ROSInterruptException):
            nudge(watchdog, Action.INTERRUPT)
    assert lifecycle.is_notified


@pytest.mark.parametrize("call", ["poll_shutdown", "deferral"])
def test_a_signal_waits_for_the_next_call_of_rospy(
    lifecycle: Lifecycle, watchdog: SignalWatchdog, call: str
) -> None:
    """Until then the program may be about to use an object that a hook would release."""
    watchdog.on_signal(signal.SIGINT, None)
    assert not lifecycle.is_shutdown_requested
    if call == "poll_shutdown":
        assert lifecycle.poll_shutdown()
    else:
        with lifecycle.deferral:
            assert not lifecycle.is_shutdown_requested
    assert lifecycle.is_shutdown()


def test_a_nudge_in_a_critical_section_waits_for_its_end(
    lifecycle: Lifecycle, watchdog: SignalWatchdog
) -> None:
    with lifecycle.deferral:
        for _ in range(2):
            nudge(watchdog)
        assert not lifecycle.is_shutdown_requested
    assert lifecycle.is_shutdown()


@pytest.mark.parametrize("is_nudge", [True, False])
def test_hooks_can_see_that_a_signal_has_interrupted_a_call(
    lifecycle: Lifecycle, watchdog: SignalWatchdog, *, is_nudge: bool
) -> None:
    seen: list[bool] = []
    lifecycle.add_hook(lambda: seen.append(is_dispatching_signal()))
    if is_nudge:
        nudge(watchdog)
    else:
        watchdog.on_signal(signal.SIGINT, None)
    # The next call of rospy is not interrupted again.
    lifecycle.deferral.poll()
    assert seen == [is_nudge]
    assert not is_dispatching_signal()


def test_a_nudge_while_a_link_is_sending_waits(lifecycle: Lifecycle) -> None:
    sending = [True]
    watchdog = SignalWatchdog(lifecycle, lambda: None, lambda: sending[0])
    nudge(watchdog)
    assert not lifecycle.is_shutdown_requested
    sending[0] = False
    nudge(watchdog)
    assert lifecycle.is_shutdown()


def test_hooks_run_once_though_signals_come_while_they_run(
    lifecycle: Lifecycle, watchdog: SignalWatchdog
) -> None:
    runs: list[bool] = []

    class Interrupted(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            nudge(watchdog, frame=sys._getframe())

    record = logging.LogRecord("test", logging.INFO, "", 1, "a line", None, None)

    def hook() -> None:
        runs.append(lifecycle.deferral.is_active)
        with lifecycle.deferral:
            Interrupted().handle(record)

    lifecycle.add_hook(hook)
    watchdog.on_signal(signal.SIGINT, None)
    lifecycle.deferral.poll()
    assert runs == [False]
    assert lifecycle.is_shutdown()


@pytest.fixture
def no_collection() -> Iterator[None]:
    """Disable garbage collection: Python ignores exceptions in the callback of a weak reference."""
    gc.disable()
    yield
    gc.enable()


@pytest.mark.usefixtures("no_collection")
def test_a_second_signal_at_any_step_of_a_shutdown_lets_it_finish(
    lifecycle: Lifecycle, watchdog: SignalWatchdog
) -> None:
    """The second signal may interrupt a hook, but must not leave a shutdown that is claimed but not carried out."""
    steps, at = 0, 1

    def count(frame: FrameType, event: str, argument: object) -> None:
        nonlocal steps
        steps += 1
        if steps == at:
            nudge(watchdog, Action.KEYBOARD_INTERRUPT)

    profile = sys.getprofile()
    while True:
        lifecycle.add_hook(int)
        try:
            sys.setprofile(count)
            lifecycle.signal_shutdown("test")
            sys.setprofile(profile)
        except KeyboardInterrupt:
            # Python removes a profile function that raises.
            sys.setprofile(profile)
        if steps < at:
            break
        # If the shutdown is interrupted before it starts, the program's exit starts it.
        assert lifecycle.left.is_set() or lifecycle.signal_shutdown("atexit")
        assert not lifecycle.deferral.is_active

        steps, at = 0, at + 1
        lifecycle = Lifecycle(lambda: None)
        watchdog = SignalWatchdog(lifecycle, lambda: None, lambda: False)
    assert at > 30


def test_an_interrupt_of_init_node_is_expected_while_hooks_run(lifecycle: Lifecycle) -> None:
    """The wait for the master ends at the shutdown request, because hooks may run in another thread."""
    expected: list[bool] = []
    lifecycle.add_hook(lambda: expected.append(lifecycle.is_interrupt(lifecycle.interrupted("text"))))
    assert not lifecycle.is_interrupt(ROSInterruptException())
    lifecycle.signal_shutdown("test")
    assert expected == [True]


def test_a_second_signal_ends_a_hook_and_the_others_run(
    lifecycle: Lifecycle, watchdog: SignalWatchdog
) -> None:
    ran: list[str] = []

    def hook() -> None:
        nudge(watchdog, Action.KEYBOARD_INTERRUPT)
        ran.append("never")

    lifecycle.add_hook(hook)
    lifecycle.add_hook(lambda: ran.append("other"))
    watchdog.on_signal(signal.SIGINT, None)
    lifecycle.deferral.poll()
    assert ran == ["other"]
    assert lifecycle.left.is_set()


def test_hook_that_another_thread_adds_while_the_last_hooks_run_is_called(lifecycle: Lifecycle) -> None:
    ran: list[str] = []

    def late() -> None:
        ran.append("late")
        for name, hooks in (("client", lifecycle.hooks), ("later", lifecycle.late_hooks)):
            thread = threading.Thread(
                target=lifecycle.add_hook, args=(functools.partial(ran.append, name), hooks), daemon=True
            )
            thread.start()
            thread.join(30)

    lifecycle.add_hook(late, lifecycle.late_hooks)
    lifecycle.add_hook(lambda: ran.append("first"))
    lifecycle.signal_shutdown("test")
    assert sorted(ran[2:]) == ["client", "later"]
    assert ran[:2] == ["first", "late"]
    lifecycle.add_hook(lambda: ran.append("after"))
    assert ran[4:] == ["after"]


def test_a_signal_at_any_step_of_adding_a_hook_runs_that_hook(
    lifecycle: Lifecycle, watchdog: SignalWatchdog
) -> None:
    steps, at = 0, 1
    ran: list[int] = []

    def count(frame: FrameType, event: str, argument: object) -> None:
        nonlocal steps
        steps += 1
        if steps == at:
            nudge(watchdog)

    profile = sys.getprofile()
    while True:
        sys.setprofile(count)
        try:
            lifecycle.add_hook(functools.partial(ran.append, at))
        finally:
            sys.setprofile(profile)
        if steps < at:
            break
        assert lifecycle.is_shutdown()
        assert ran == list(range(1, at + 1))

        steps, at = 0, at + 1
        lifecycle = Lifecycle(lambda: None)
        watchdog = SignalWatchdog(lifecycle, lambda: None, lambda: False)
    assert at > 5


def test_a_critical_section_of_another_thread_defers_nothing(lifecycle: Lifecycle) -> None:
    active: list[bool] = []

    def work() -> None:
        with lifecycle.deferral:
            active.append(lifecycle.deferral.is_active)

    worker = threading.Thread(target=work)
    worker.start()
    worker.join()
    assert active == [False]


def test_a_nudge_is_no_signal_of_the_users(lifecycle: Lifecycle) -> None:
    watchdog = SignalWatchdog(lifecycle, lambda: None, lambda: False)
    watchdog._arrived, watchdog._handled, watchdog._nudges = 5, 3, 4
    assert watchdog._new_signals() == 1
    lifecycle.machine.signal(0.0)
    assert watchdog._new_signals() == 0


class System:
    """The clock and the signal socket of a watchdog that runs in the test's own thread."""

    def __init__(
        self, watchdog: SignalWatchdog, signalled: float, turn: float, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Create the system.

        ``signalled``: the time of the signal. ``turn``: the duration of the watchdog's undisturbed wait.
        """
        self.now = 0.0
        self.nudged: list[float] = []
        self._watchdog = watchdog
        self._signalled, self._turn = signalled, turn
        self._timeout: float | None = None
        monkeypatch.setattr(signals, "time", self)
        monkeypatch.setattr(watchdog, "_nudge", lambda: self.nudged.append(self.now))

    def watch(self) -> None:
        self._watchdog._watch(cast("socket.socket", self))

    def monotonic(self) -> float:
        return self.now

    def settimeout(self, timeout: float | None) -> None:
        self._timeout = timeout

    def recv(self, _: int) -> bytes:
        if self.nudged:
            return b""

        is_signalled = self.now < self._signalled
        self.now = self._signalled if self._timeout is None else self.now + self._turn
        if not is_signalled:
            raise TimeoutError
        self._watchdog.on_signal(signal.SIGINT, None)
        return bytes([signal.SIGINT])

    def __enter__(self) -> System:
        return self

    def __exit__(self, *_: object) -> None:
        pass


@pytest.mark.parametrize("turn", [1 / 128, 1 / 32])
def test_fifty_milliseconds_for_the_next_call_of_rospy_start_at_the_signal(
    watchdog: SignalWatchdog, monkeypatch: pytest.MonkeyPatch, turn: float
) -> None:
    """Any idle time before the signal is not counted."""
    system = System(watchdog, 1000.0, turn, monkeypatch)
    system.watch()
    assert system.nudged == [1000.0 + turn * math.ceil(0.05 / turn)]
