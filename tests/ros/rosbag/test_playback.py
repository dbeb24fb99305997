"""The effect of requests in each phase of a playback: only the state machine, without a clock, files or threads."""

from __future__ import annotations

import pytest

from minirospy.ros.rosbag.recording.playback import Phase, Playback
from minirospy.ros.rosbag.recording.schedule import PlayOptions, State

SECOND = 10**9
START, END = 1000 * SECOND, 1010 * SECOND
"""Bag times of the first and last message. Wall time starts at 0."""
LEAD = SECOND // 500


def made(phase: Phase, options: PlayOptions | None = None) -> Playback:
    """Return a controlled playback in a phase, at wall time 0."""
    playback = Playback(options or PlayOptions())
    playback.set_span(START, END)
    if phase is not Phase.OPENING:
        playback.accept_control(0)
    if phase in (Phase.PLAYING, Phase.AT_END):
        playback.start(0)
    if phase is Phase.AT_END:
        playback.offer(END, "/t", 0)
        assert playback.poll(10 * SECOND) is None
        playback.reach_end()
    assert playback.phase is phase
    return playback


@pytest.mark.parametrize("is_controlled", [False, True])
@pytest.mark.parametrize("paused", [False, True])
def test_pause_requested_before_the_start_counts(paused: bool, is_controlled: bool) -> None:
    """The service is offered before the clock starts."""
    playback = Playback(PlayOptions(paused=paused))
    playback.set_span(START, END)
    if is_controlled:
        playback.accept_control(0)
    assert not playback.set_paused(paused, 0)
    assert playback.set_paused(not paused, 0)
    assert not playback.set_paused(not paused, 0)
    assert playback.state(0).is_paused is not paused
    playback.start(0)
    assert playback.phase is Phase.PLAYING
    assert playback.state(0).is_paused is not paused


def test_nothing_but_a_pause_has_an_effect_while_bags_are_opened() -> None:
    playback = made(Phase.OPENING)
    playback.control(0, rate=2.0, seek=END, is_paused=True, is_looping=True, has_clock=True)
    playback.step(3)
    playback.press(" ", 0)
    playback.control_rate(START)
    assert playback.state(0) == (START, 1.0, False, False)
    assert playback.seek_to is None
    assert playback.options == PlayOptions()


def test_first_message_is_due_after_the_lead_of_the_threads() -> None:
    playback = Playback(PlayOptions())
    playback.set_span(START, END)
    playback.start(0)
    playback.offer(START, "/t", 0)
    assert playback.poll(0) == LEAD
    assert playback.is_fresh
    assert playback.poll(LEAD) is None
    assert not playback.is_fresh


def test_clock_stands_until_the_start() -> None:
    playback = made(Phase.READY)
    assert playback.state(5 * SECOND) == (START, 1.0, False, False)
    playback.start(5 * SECOND)
    playback.offer(END, "/t", 5 * SECOND)
    assert playback.state(6 * SECOND).time == START + SECOND


@pytest.mark.parametrize("phase", [Phase.READY, Phase.PLAYING, Phase.AT_END])
@pytest.mark.parametrize(("time", "taken"), [(0, START), (START + SECOND, START + SECOND), (2 * END, END)])
def test_seek_is_within_the_bag_and_shown_at_once(phase: Phase, time: int, taken: int) -> None:
    playback = made(phase)
    playback.control(0, seek=time)
    assert playback.state(0).time == taken
    assert playback.is_fresh
    assert playback.phase is (Phase.READY if phase is Phase.READY else Phase.PLAYING)
    assert playback.seek_to == taken
    assert playback.take_seek() == taken
    assert playback.seek_to is None
    assert playback.take_seek() is None


def test_steps_requested_during_a_seek_are_kept() -> None:
    playback = made(Phase.PLAYING, PlayOptions(paused=True))
    playback.control(0, seek=END - SECOND)
    assert playback.take_seek() == END - SECOND
    playback.step(1)
    playback.arrive(END - SECOND, SECOND)
    playback.offer(END, "/t", SECOND)
    assert playback.poll(SECOND) is None
    playback.offer(END, "/t", SECOND)
    assert playback.poll(SECOND) is not None


def test_later_seek_outlasts_the_arrival_of_an_earlier_one() -> None:
    playback = made(Phase.PLAYING)
    playback.control(0, seek=END)
    assert playback.take_seek() == END
    playback.control(0, seek=START + SECOND)
    playback.arrive(END, 0)
    assert playback.state(0).time == START + SECOND
    assert playback.take_seek() == START + SECOND


def test_end_is_not_reached_with_a_seek_requested() -> None:
    playback = made(Phase.PLAYING)
    playback.control(0, seek=START)
    playback.reach_end()
    assert playback.phase is Phase.PLAYING
    assert not playback.stays_at_end


def test_resuming_at_the_end_returns_to_the_first_message() -> None:
    playback = made(Phase.AT_END)
    assert playback.state(0).is_at_end
    assert playback.stays_at_end
    playback.control(0, is_paused=True)
    assert playback.stays_at_end
    playback.control(0, is_paused=False)
    assert not playback.stays_at_end
    assert not playback.state(0).is_at_end
    assert playback.take_seek() == START


def test_seek_at_the_end_goes_where_it_is_told_while_resuming() -> None:
    playback = made(Phase.AT_END)
    playback.control(0, is_paused=False, seek=START + SECOND)
    assert playback.take_seek() == START + SECOND


def test_looping_and_the_shutdown_end_the_wait_at_the_end() -> None:
    looping, ended = made(Phase.AT_END), made(Phase.AT_END)
    looping.control(0, is_looping=True)
    ended.end()
    for playback in looping, ended:
        assert not playback.stays_at_end
        playback.leave_end()
        assert playback.phase is Phase.PLAYING


@pytest.mark.parametrize(("keeps", "rate"), [(True, 4.0), (False, 1.0)])
def test_restart_keeps_the_rate_of_a_schedule_that_clients_control(keeps: bool, rate: float) -> None:
    playback = made(Phase.PLAYING)
    playback.control(0, rate=4.0)
    playback.restart(SECOND, keeps_schedule=keeps)
    assert playback.state(SECOND) == (START, rate, False, False)


def test_keys() -> None:
    playback = made(Phase.PLAYING, PlayOptions(pause_topics=frozenset({"/t"})))
    playback.press(" ", 0)
    assert playback.status(0).state is State.PAUSED
    playback.press("s", 0)
    playback.offer(START, "/a", 0)
    assert playback.poll(0) is None
    playback.press(" ", 0)
    playback.press("t", 0)
    playback.offer(START, "/t", 0)
    assert playback.status(0).state is State.RUNNING


def test_clock_is_published_once_it_is_requested() -> None:
    playback = made(Phase.PLAYING)
    assert playback.tick(0) is None
    playback.control(0, has_clock=True)
    assert playback.options.clock
    assert playback.tick(0) == START
    playback.control(0, has_clock=False)
    assert playback.tick(SECOND) is None
