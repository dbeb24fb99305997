"""The schedule of `rosbag play`, with a wall clock that the test controls."""

from __future__ import annotations

from typing import NamedTuple

from minirospy.ros.rosbag.recording.schedule import PlayOptions, Schedule, State

SECOND = 10**9
TICK = SECOND // 10
START = 1000 * SECOND  # bag time of the first message; wall time starts at 0


class Published(NamedTuple):
    """A message and the time when it was published, both in seconds since the start."""

    stored: float
    at: float


class Wall:
    """Plays messages (seconds, topic) by a schedule; ``on`` contains the events by wall time."""

    def __init__(self, options: PlayOptions, *, last: float = 10.0) -> None:
        self.now = 0
        self.schedule = Schedule(options, START, START + int(last * SECOND), 0)
        self.published: list[Published] = []
        self.ticks: list[tuple[float, float]] = []
        self.events: list[tuple[float, str]] = []

    def play(self, *messages: tuple[float, str] | float, until: float = 100.0) -> list[Published]:
        for each in messages:
            seconds, topic = each if isinstance(each, tuple) else (each, "/a")
            self.schedule.offer(START + round(seconds * SECOND), topic, self.now)
            while (wait := self._poll()) is not None:
                assert wait > self.now
                if self.events and self.events[0][0] * SECOND <= wait:
                    at, name = self.events.pop(0)
                    self.now = max(self.now, round(at * SECOND))
                    self._happen(name)
                else:
                    self.now = wait
                if self.now > until * SECOND:
                    return self.published
            self.published.append(Published(seconds, self.now / SECOND))
        return self.published

    def _poll(self) -> int | None:
        self._tick()
        wait = self.schedule.poll(self.now)
        if wait is None:
            self._tick()
        return wait

    def _tick(self) -> None:
        shown = self.schedule.tick(self.now)
        if shown is not None:
            self.ticks.append((self.now / SECOND, (shown - START) / SECOND))

    def _happen(self, name: str) -> None:
        if name == "space":
            self.schedule.set_paused(not self.schedule.is_paused, self.now)
        elif name == "s":
            self.schedule.step()
        elif name == "t":
            self.schedule.toggle_pause_topics()
        else:
            self.schedule.control_rate(START + round(float(name) * SECOND))


def test_messages_keep_their_distance() -> None:
    assert Wall(PlayOptions()).play(0, 0.5, 0.5, 2) == [(0, 0), (0.5, 0.5), (0.5, 0.5), (2, 2)]


def test_rate_scales_the_distance() -> None:
    assert Wall(PlayOptions(rate=2.0)).play(0, 1, 3) == [(0, 0), (1, 0.5), (3, 1.5)]
    assert Wall(PlayOptions(rate=0.5)).play(0, 1) == [(0, 0), (1, 2)]


def test_a_late_message_does_not_delay_the_next() -> None:
    wall = Wall(PlayOptions())
    wall.play(0)
    wall.now = 2 * SECOND

    assert wall.play(1, 3)[1:] == [(1, 2), (3, 3)]


def test_immediate_waits_for_nothing() -> None:
    assert Wall(PlayOptions(immediate=True)).play(0, 5, 9) == [(0, 0), (5, 0), (9, 0)]


def test_a_pause_shifts_what_follows() -> None:
    wall = Wall(PlayOptions())
    wall.events = [(1.5, "space"), (4.5, "space")]

    assert wall.play(0, 1, 2, 3) == [(0, 0), (1, 1), (2, 5), (3, 6)]


def test_it_starts_paused() -> None:
    wall = Wall(PlayOptions(paused=True))
    wall.events = [(2.0, "space")]

    assert wall.play(0, 1) == [(0, 2), (1, 3)]


def test_a_step_publishes_one_message() -> None:
    wall = Wall(PlayOptions(paused=True))
    wall.events = [(1.0, "s"), (2.0, "s"), (5.0, "space")]

    # After the steps, the third message follows the second at the same distance as in the bag.
    assert wall.play(0, 10, 11) == [(0, 1), (10, 2), (11, 6)]


def test_a_step_before_the_message_is_offered_counts() -> None:
    wall = Wall(PlayOptions(paused=True))
    wall.schedule.step()

    assert wall.play(0, 1, until=5) == [(0, 0)]


def test_a_step_has_no_effect_while_running() -> None:
    wall = Wall(PlayOptions())
    wall.events = [(0.5, "s")]

    assert wall.play(0, 1) == [(0, 0), (1, 1)]


def test_setting_the_pause_twice_changes_nothing() -> None:
    schedule = Schedule(PlayOptions(), START, START, 0)

    assert [schedule.set_paused(state, 0) for state in (False, True, True, False)] == [
        False,
        True,
        False,
        True,
    ]


def test_pause_topics_pause_before_the_message() -> None:
    wall = Wall(PlayOptions(pause_topics=frozenset({"/stop"})))
    wall.events = [(3.0, "space")]

    # It has been pending since 1.0, when it became the next message; 0.5 s of its delay remain.
    assert wall.play(0, 1, (1.5, "/stop"), 2) == [(0, 0), (1, 1), (1.5, 3.5), (2, 4)]


def test_t_ignores_the_pause_topics() -> None:
    wall = Wall(PlayOptions(pause_topics=frozenset({"/stop"})))
    wall.events = [(0.5, "t")]

    assert wall.play(0, 1, (1.5, "/stop"), 2) == [(0, 0), (1, 1), (1.5, 1.5), (2, 2)]


def test_skip_empty_jumps_over_gaps() -> None:
    wall = Wall(PlayOptions(skip_empty=2 * SECOND))

    assert wall.play(0, 1, 9, 10) == [(0, 0), (1, 1), (9, 1), (10, 2)]


def test_a_topic_controls_the_rate() -> None:
    options = PlayOptions(rate_control_topic="/done", rate_control_max_delay=SECOND)
    wall = Wall(options)
    wall.events = [(5.0, "2.5")]

    # At 1.5 the clock is more than a second ahead of the start, and waits for the topic.
    assert wall.play(0, 1, 1.5, 2) == [(0, 0), (1, 1), (1.5, 1.5), (2, 5.5)]


def test_the_clock_runs_between_messages() -> None:
    wall = Wall(PlayOptions(clock=True, clock_hz=2.0))
    wall.play(0, 2)

    assert wall.ticks == [(0, 0), (0.5, 0.5), (1, 1), (1.5, 1.5), (2, 2)]


def test_the_clock_follows_the_rate() -> None:
    wall = Wall(PlayOptions(clock=True, clock_hz=1.0, rate=3.0))
    wall.play(0, 6)

    assert wall.ticks == [(0, 0), (1, 3), (2, 6)]


def test_the_clock_stops_in_a_pause_and_goes_on() -> None:
    wall = Wall(PlayOptions(clock=True, clock_hz=1.0))
    wall.events = [(1.5, "space"), (3.5, "space")]
    wall.play(0, 3)

    assert wall.ticks == [(0, 0), (1, 1), (2, 1.5), (3, 1.5), (4, 2), (5, 3)]


def test_a_step_ticks() -> None:
    wall = Wall(PlayOptions(clock=True, clock_hz=0.01, paused=True))
    wall.events = [(1.0, "s")]
    wall.play(0)

    assert wall.ticks[-1] == (1, 0)


def test_the_clock_never_runs_ahead_of_the_next_message() -> None:
    wall = Wall(PlayOptions(clock=True, clock_hz=10.0))
    wall.play(0, 1)
    wall.now = 50 * SECOND

    assert wall.schedule.status(wall.now).time == START + SECOND


def test_status() -> None:
    wall = Wall(PlayOptions(rate_control_topic="/done", rate_control_max_delay=0), last=8)
    wall.play(0)
    running = wall.schedule.status(wall.now)
    wall.schedule.offer(START + SECOND, "/a", SECOND)
    wall.schedule.poll(SECOND)
    wall.schedule.offer(START + 2 * SECOND, "/a", SECOND)
    delayed = wall.schedule.status(SECOND)
    wall.schedule.set_paused(True, SECOND)

    assert running == (State.RUNNING, START, 0, 8 * SECOND, 0)
    assert delayed == (State.DELAYED, START + SECOND, SECOND, 8 * SECOND, SECOND)
    assert wall.schedule.status(SECOND).state is State.PAUSED


def test_the_clock_runs_on_when_it_is_kept_alive() -> None:
    wall = Wall(PlayOptions(clock=True, clock_hz=1.0), last=0)
    wall.play(0)
    wall.schedule.run_on(3 * SECOND)

    assert wall.schedule.tick(3 * SECOND) == START + 3 * SECOND


def test_rate_changes_from_where_the_clock_is() -> None:
    wall = Wall(PlayOptions())
    wall.play(0.0, 1.0)
    wall.schedule.set_rate(2.0, wall.now)
    assert wall.schedule.rate == 2.0
    assert wall.play(3.0)[-1] == Published(3.0, 2.0)
    wall.schedule.set_rate(0.5, wall.now)
    assert wall.play(4.0)[-1] == Published(4.0, 4.0)


def test_seek_goes_on_at_another_time() -> None:
    wall = Wall(PlayOptions())
    wall.play(0.0, 1.0)
    wall.schedule.seek(START + 8 * SECOND, wall.now)
    assert wall.schedule.status(wall.now).played == 8 * SECOND
    assert wall.play(8.5)[-1] == Published(8.5, 1.5)
    wall.schedule.seek(START + 2 * SECOND, wall.now)
    assert wall.play(3.0)[-1] == Published(3.0, 2.5)


def test_seek_while_paused_waits_there() -> None:
    wall = Wall(PlayOptions())
    wall.play(0.0)
    wall.schedule.set_paused(True, wall.now)
    wall.schedule.seek(START + 5 * SECOND, wall.now)
    wall.events = []
    wall.now = 3 * SECOND
    assert wall.schedule.status(wall.now).played == 5 * SECOND
    wall.schedule.set_paused(False, wall.now)
    assert wall.play(5.5)[-1] == Published(5.5, 3.5)
