"""Two machines with the same name. The control room shows the one that it saw first, regardless of clocks and tokens."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from std_msgs.msg import String

from minirospy.base.errors import BridgeError
from minirospy.fleet.contents import FleetContents
from minirospy.fleet.holders import HOLD_SECONDS, MAX_HOLDS, Holders, parse_machines
from minirospy.fleet.importer import MACHINES, Importer
from minirospy.fleet.inquiry import robot_parameter
from minirospy.fleet.keys import Claim, TopicToken, claim_key, topic_key
from minirospy.fleet.network import FleetNetwork, NetworkOptions
from tests.fleet.fleet import Fleet, Place
from tests.fleet.test_fleet_gateways import collect, fleet, publisher

__all__ = ["fleet"]

FIRST = Claim("robot1", "1" * 16, 1_000, "a" * 16)
LIAR = Claim("robot1", "2" * 16, 1, "b" * 16)
AGAIN = FIRST._replace(gateway="3" * 16)


class Clock:
    """A clock that the test sets."""

    now = 100.0

    def __call__(self) -> float:
        return self.now


# --- who holds a name


def test_the_first_seen_holds_a_name_whatever_the_clocks_say() -> None:
    holders = Holders(Clock())
    assert holders.choose("robot1", [FIRST]) == FIRST
    assert holders.choose("robot1", [FIRST, LIAR]) == FIRST
    assert holders.choose("robot1", [LIAR, FIRST]) == FIRST


def test_another_machine_follows_when_the_first_has_been_gone_for_the_lease() -> None:
    clock = Clock()
    holders = Holders(clock)
    holders.choose("robot1", [FIRST, LIAR])
    assert holders.choose("robot1", [LIAR]) is None
    assert holders.pause(["robot1"]) == HOLD_SECONDS
    clock.now += HOLD_SECONDS - 0.1
    assert holders.choose("robot1", [LIAR, FIRST]) == FIRST, "it is back in time"
    assert holders.pause(["robot1"]) is None

    assert holders.choose("robot1", [LIAR]) is None
    clock.now += HOLD_SECONDS
    assert holders.choose("robot1", [LIAR]) == LIAR
    assert holders.choose("robot1", [LIAR, FIRST]) == LIAR


def test_a_gateway_that_was_started_again_follows_immediately() -> None:
    holders = Holders(Clock())
    holders.choose("robot1", [FIRST, LIAR])
    assert holders.choose("robot1", [LIAR, AGAIN]) == AGAIN


def test_a_gateway_of_the_same_machine_waits_while_the_first_answers() -> None:
    holders = Holders(Clock())
    assert holders.choose("robot1", [FIRST, AGAIN]) == FIRST
    holders.give_up(FIRST)
    assert holders.choose("robot1", [FIRST, AGAIN]) == AGAIN
    holders.give_up(AGAIN)
    assert holders.choose("robot1", [AGAIN]) == AGAIN, "there is no other"


def test_the_operator_chooses_a_machine() -> None:
    clock = Clock()
    holders = Holders(clock)
    holders.choose("robot1", [FIRST, LIAR])
    holders.machines = {"robot1": LIAR.host}
    assert holders.choose("robot1", [FIRST, LIAR]) == LIAR
    assert holders.choose("robot1", [FIRST]) is None
    clock.now += 2 * HOLD_SECONDS
    assert holders.choose("robot1", [FIRST]) is None
    holders.machines = {}
    assert holders.choose("robot1", [FIRST]) == FIRST


def test_names_that_are_gone_are_forgotten() -> None:
    clock = Clock()
    holders = Holders(clock)
    for number in range(MAX_HOLDS + 100):
        holders.choose(f"robot{number}", [FIRST._replace(name=f"robot{number}")])
    holders.forget(["robot7"])
    assert len(holders._holds) <= MAX_HOLDS
    clock.now += HOLD_SECONDS
    holders.forget(["robot7"])
    assert list(holders._holds) == ["robot7"]


@pytest.mark.parametrize(
    "value", [None, [], "x", {"robot1": 5}, {"robot1": "b" * 15}, {"robot1": {"x": "b" * 16}}]
)
def test_a_parameter_that_is_no_choice_is_ignored(value: object) -> None:
    assert parse_machines(value) == {}


def test_a_second_claim_under_the_key_of_a_gateway_is_refused() -> None:
    contents = FleetContents(lambda _: True)
    contents.add(claim_key(FIRST))
    forged = FIRST._replace(start=1, host=LIAR.host)
    assert not contents.add(claim_key(forged))
    assert "two tokens claim to be its gateway" in contents.refusal
    assert not contents.remove(claim_key(forged))
    assert contents.robots()["robot1"].claim == FIRST


def test_a_topic_that_came_before_its_claim_does_not_count_as_first() -> None:
    contents = FleetContents(lambda _: True)
    contents.add(
        topic_key(TopicToken("robot1", LIAR.gateway, "/scan", "std_msgs/String", "0" * 32, True, False))
    )
    contents.add(claim_key(FIRST))
    contents.add(claim_key(LIAR))
    assert contents.robots()["robot1"].claim == FIRST


# --- a control room with real sessions of Zenoh


pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")


@contextmanager
def stranger(fleet: Fleet) -> Iterator[FleetNetwork]:
    """Return a session that may declare anything."""
    session = fleet.run(FleetNetwork.open(NetworkOptions(connect=(fleet.endpoint,))))
    try:
        yield session
    finally:
        fleet.run(session.close())


def control_room(fleet: Fleet, place: Place) -> Importer:
    importer = place.gateway(listens=True).importer
    assert importer is not None
    return importer


def shown(importer: Importer) -> Claim | None:
    """Return the claim of robot1 that is shown, or None if there is none, as during a takeover."""
    robot = importer.robots.get("robot1")
    return robot.robot.claim if robot else None


def lines(caplog: pytest.LogCaptureFixture, text: str) -> list[str]:
    return [record.getMessage() for record in caplog.records if text in record.getMessage()]


def test_a_name_belongs_to_the_machine_that_came_first(
    fleet: Fleet, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("minirospy.fleet.holders.HOLD_SECONDS", 0.2)
    first, second, control = fleet.place(), fleet.place(), fleet.place()
    publisher(fleet, first, "/first", String)
    publisher(fleet, second, "/second", String)
    importer = control_room(fleet, control)
    one = first.gateway("robot1", host="a" * 16)
    fleet.until_shown(control, "/robot1/first")
    other = second.gateway("robot1", host="b" * 16)
    fleet.until(lambda: importer.robots["robot1"].robot.duplicates == (other.claim,))
    assert other.exporter is not None
    fleet.until(lambda: other.exporter.duplicates == (one.claim,))
    assert "/robot1/second" not in control.names()

    fleet.stop(one)
    fleet.until_shown(control, "/robot1/second")
    fleet.until_gone(control, "/robot1/first")
    assert len(lines(caplog, "robot [robot1] is another machine now")) == 1


def test_a_machine_whose_clock_is_behind_takes_no_name(
    fleet: Fleet, caplog: pytest.LogCaptureFixture
) -> None:
    robot, late, control = fleet.place(), fleet.place(), fleet.place()
    importer = control_room(fleet, control)
    gateway = robot.gateway("robot1", host="a" * 16)
    heard = collect(fleet, robot, "/cmd_vel", String)
    fleet.until_shown(control, "/robot1/cmd_vel")
    # Its clock is a year slow. An earlier version let it take over the name and the commands within 0.1 s.
    other = late.gateway("robot1", host="b" * 16, clock=lambda: 1)
    stolen = collect(fleet, late, "/cmd_vel", String)
    fleet.until(lambda: importer.contents.waiting)
    assert importer.robots["robot1"].robot.claim == gateway.claim
    commands = publisher(fleet, control, "/robot1/cmd_vel", String)
    fleet.run(commands.wait_for_subscribers(1, 60.0))
    fleet.run(commands.publish("stop"))
    fleet.until(lambda: heard)
    assert stolen == []

    fleet.until(lambda: lines(caplog, "two machines call themselves [robot1]"))
    (line,) = lines(caplog, "two machines call themselves [robot1]")
    assert f"{'a' * 16} (gateway {gateway.id}) came first and is shown" in line
    assert f"{'b' * 16} (gateway {other.id}) is refused" in line
    assert f"minirospy fleet takeover robot1 {'b' * 16}" in line

    # The operator selects the other machine, and then reverts the choice.
    operator = control.node("operator")
    fleet.run(operator.set_param(f"{MACHINES}/robot1", "b" * 16))
    fleet.until(lambda: shown(importer) == other.claim)
    fleet.run(operator.set_param(f"{MACHINES}/robot1", "a" * 16))
    fleet.until(lambda: shown(importer) == gateway.claim)


def test_a_copied_token_takes_no_name(fleet: Fleet, caplog: pytest.LogCaptureFixture) -> None:
    robot, control = fleet.place(), fleet.place()
    publisher(fleet, robot, "/chat", String)
    importer = control_room(fleet, control)
    claim = robot.gateway("robot1").claim
    fleet.until_shown(control, "/robot1/chat")
    with stranger(fleet) as session:
        copies = [
            claim,  # a replayed claim
            claim._replace(start=1, host="0" * 16),  # another machine behind the same gateway
            claim._replace(gateway="0" * 16, start=2**63),  # the same machine, apparently restarted
        ]
        tokens = [fleet.call(lambda copy=copy: session.declare_token(claim_key(copy))) for copy in copies]
        fleet.until(lambda: importer.contents.waiting)
        fleet.until(lambda: lines(caplog, "two gateways of machine"))
        assert importer.robots["robot1"].robot.claim == claim
        for token in tokens:
            fleet.call(token.undeclare)
        fleet.until(lambda: not importer.contents.waiting)
    assert importer.robots["robot1"].robot.claim == claim
    assert "/robot1/chat" in control.names()
    assert len(lines(caplog, "call themselves")) == 1


def test_a_gateway_that_does_not_answer_gives_way_to_its_own_machine(
    fleet: Fleet, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("minirospy.fleet.importer.CHALLENGE_SECONDS", 0.2)
    robot, control = fleet.place(), fleet.place()
    importer = control_room(fleet, control)
    with stranger(fleet) as session:
        old = Claim("robot1", "0" * 16, 2**63, "a" * 16)
        token = fleet.call(lambda: session.declare_token(claim_key(old)))
        fleet.until(lambda: "robot1" in importer.robots)
        gateway = robot.gateway("robot1", host="a" * 16)
        fleet.until(lambda: shown(importer) == gateway.claim)
        fleet.call(token.undeclare)


def test_a_parameter_of_several_machines_is_that_of_the_robot_that_is_shown(fleet: Fleet) -> None:
    robot, late, control = fleet.place(), fleet.place(), fleet.place()
    for place, speed in ((robot, 1.5), (late, 9.0)):
        fleet.run(place.node("setter").set_param("/speed", speed))
    router = fleet.run(FleetNetwork.open(NetworkOptions(listen=(fleet.endpoint,))))
    try:
        exporter = robot.gateway("robot1", host="a" * 16).exporter
        assert exporter is not None
        late.gateway("robot1", host="b" * 16, clock=lambda: 1)
        fleet.until(lambda: exporter.duplicates)
        with pytest.raises(
            BridgeError, match=f"several machines call themselves .robot1. .{'a' * 16}, {'b' * 16}"
        ):
            fleet.run(robot_parameter(router, "robot1", "/speed", 5.0))
        importer = control.gateway().importer
        assert importer is not None
        fleet.until(lambda: "robot1" in importer.robots)
        fleet.run(control.node("operator").set_param(f"{MACHINES}/robot1", "b" * 16))
        fleet.until(lambda: "b" * 16 in (shown(importer) or ()))
        assert fleet.run(robot_parameter(router, "robot1", "/speed", 5.0)) == 9.0
    finally:
        fleet.run(router.close())
