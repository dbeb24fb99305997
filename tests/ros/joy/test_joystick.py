"""joystick, twist_joy: the messages equal those of the real nodes (drive.txt); other rules."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from minirospy.ros.joy.devices import state_events
from minirospy.ros.joy.joystick import EVENT_AXIS, EVENT_BUTTON, EVENT_INIT, Event, Joystick, JoystickOptions
from minirospy.ros.teleop_twist_joy.twist_joy import JoyTeleop, read_options
from tests.ros.joy.cases import OPTIONS, STATES, STEPS, TELEOPS

RECORDED: dict[str, list[str]] = {}
for line in (Path(__file__).parent / "drive.txt").read_text(encoding="utf-8").splitlines():
    if line.startswith(" "):
        RECORDED[[*RECORDED][-1]].append(line.strip())
    else:
        RECORDED[line] = []


def numbers(values: object) -> str:
    return "[" + ", ".join(f"{value:.5g}" for value in values) + "]"  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", OPTIONS)
def test_states_of_a_joystick_are_those_of_the_real_node(name: str) -> None:
    options, _ = JoystickOptions(coalesce_interval=0.4, **OPTIONS[name]).checked()  # type: ignore[arg-type]
    joystick, now = Joystick(options, 0.0), 10.0
    lines: list[str] = []

    def show() -> None:
        lines.append(f"{numbers(joystick.axes)} {joystick.buttons} True")

    for events, _ in STEPS:
        for kind, number, value in events:
            now += 0.001
            if joystick.handle(Event(kind, number, value), now):
                show()
        now += 0.5
        if joystick.is_due(now):
            show()
    assert lines == RECORDED[f"joy_node {name}"]


@pytest.mark.parametrize("name", TELEOPS)
def test_velocities_are_those_of_the_real_node(name: str) -> None:
    teleop = JoyTeleop(read_options(TELEOPS[name]))
    lines = []
    for axes, buttons in STATES:
        found = teleop.velocity(axes, buttons)
        if found is None:
            lines.append("nothing")
        else:
            lines.append(f"{numbers(found[:3])} {numbers(found[3:])}")
    assert lines == RECORDED[f"teleop_node {name}"]


def test_axes_wait_for_each_other_and_buttons_do_not() -> None:
    joystick = Joystick(JoystickOptions(coalesce_interval=0.1), 0.0)
    assert not joystick.handle(Event(EVENT_AXIS, 0, 32767), 5.0)
    assert not joystick.handle(Event(EVENT_AXIS, 1, 32767), 5.05)
    assert joystick.deadline == pytest.approx(5.1)
    assert not joystick.is_due(5.09)
    assert joystick.is_due(5.1)
    assert not joystick.is_due(99.0)
    assert not joystick.handle(Event(EVENT_AXIS, 1, 0), 100.0)
    assert joystick.handle(Event(EVENT_BUTTON, 0, 1), 100.01)
    assert joystick.deadline is None


def test_state_is_repeated_while_idle() -> None:
    joystick = Joystick(JoystickOptions(autorepeat_rate=10), 0.0)
    # The first events are due after a second, then the rate's period applies.
    assert joystick.deadline == pytest.approx(1.1)
    assert joystick.is_due(1.1)
    assert joystick.deadline == pytest.approx(1.2)
    assert not joystick.handle(Event(EVENT_AXIS, 0, 32767), 1.15)
    assert joystick.deadline == pytest.approx(1.151)
    assert joystick.handle(Event(EVENT_BUTTON, 0, 1), 1.1505)
    assert joystick.deadline == pytest.approx(1.2505)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (JoystickOptions(deadzone=0.95), "deadzone (0.950000) greater than 0.9, setting it to 0.9"),
        (JoystickOptions(deadzone=-0.5), "deadzone_ (-0.500000) less than 0, setting to 0."),
        (JoystickOptions(deadzone=3276), "For now I am dividing your deadzone by 32767"),
        (JoystickOptions(autorepeat_rate=-1), "autorepeat_rate (-1.000000) less than 0, setting to 0."),
        (JoystickOptions(coalesce_interval=-1), "coalesce_interval (-1.000000) less than 0, setting to 0."),
        (JoystickOptions(autorepeat_rate=20, coalesce_interval=0.1), "Timing behavior is not well defined."),
    ],
)
def test_options_out_of_range_are_limited_with_a_warning(options: JoystickOptions, words: str) -> None:
    limited, warnings = options.checked()
    assert words in warnings[-1]
    assert 0 <= limited.deadzone <= 0.9
    assert limited.autorepeat_rate >= 0
    assert limited.coalesce_interval >= 0


def test_options_without_limits_to_reach_have_no_warning() -> None:
    options = JoystickOptions(0.0, 50, 0.0)
    assert options.checked() == (options, [])


def test_unknown_events_are_refused() -> None:
    with pytest.raises(ValueError, match=re.escape("unknown type 7h of an event: number 1, value 2")):
        Joystick(JoystickOptions(), 0.0).handle(Event(7, 1, 2), 0.0)


def test_states_of_other_systems_become_events() -> None:
    first = [(EVENT_BUTTON, 0, 0), (EVENT_AXIS, 0, 5)]
    assert state_events([], first) == [(EVENT_BUTTON | EVENT_INIT, 0, 0), (EVENT_AXIS | EVENT_INIT, 0, 5)]
    assert state_events(first, first) == []
    assert state_events(first, [(EVENT_BUTTON, 0, 1), (EVENT_AXIS, 0, 5)]) == [Event(EVENT_BUTTON, 0, 1)]
