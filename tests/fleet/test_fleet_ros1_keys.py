"""The keys of zenoh-bridge-ros1 and its beacons, without a network and with a clock that the test controls."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from unittest.mock import AsyncMock, Mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.errors import BridgeError
from minirospy.fleet import ros1_keys, ros1_side
from minirospy.fleet.keys import UNKNOWN_MD5, TopicToken
from minirospy.fleet.report import Answer, lines
from minirospy.fleet.ros1_keys import (
    LOST_SECONDS,
    PERIOD,
    Beacons,
    Resource,
    Sightings,
    beacon_key,
    beacon_pattern,
    data_key,
    parse_beacon,
    parse_namespace,
    shared_topics,
)
from minirospy.fleet.ros1_side import Ros1Side
from minirospy.fleet.rules import GatewayRules
from tests.fleet.test_fleet_hostile import CLAIM

MD5 = "992ce8a1687cec8c8bd883ec73ca41d1"
OTHER = "f" * 32
# hex("std_msgs/String"), written out as the bridge itself sends it.
HEX = "7374645f6d7367732f537472696e67"
CHAT = Resource("pub", "/arm/chat", "std_msgs/String", MD5)


def token(
    name: str = "/chat", *, is_published: bool = False, is_subscribed: bool = False, md5sum: str = MD5
) -> TopicToken:
    return TopicToken("-", "-", name, "std_msgs/String", md5sum, is_published, is_subscribed)


def test_keys_are_those_of_the_bridge() -> None:
    assert data_key("std_msgs/String", MD5, "/arm/chat", "*") == f"{HEX}/{MD5}/*/arm/chat"
    assert beacon_key(CHAT, "*") == f"ros1_discovery_info/*/pub/{HEX}/{MD5}/*/arm/chat"
    assert beacon_key(CHAT, "robot1") == f"ros1_discovery_info/*/pub/{HEX}/{MD5}/robot1/arm/chat"
    assert beacon_pattern("robot1") == "ros1_discovery_info/*/*/*/*/robot1/*/**"


@pytest.mark.parametrize("kind", ["pub", "sub", "srv"])
@pytest.mark.parametrize("namespace", ["*", "robot1"])
def test_beacons_come_back(kind: str, namespace: str) -> None:
    resource = CHAT._replace(kind=kind)
    assert parse_beacon(beacon_key(resource, namespace)) == resource


def test_beacons_that_name_no_type_are_not_faults() -> None:
    assert parse_beacon("ros1_discovery_info/*/sub/2a/*/*/chat") is None
    assert parse_beacon(beacon_key(CHAT._replace(kind="cl"), "*")) is None


@pytest.mark.parametrize(
    ("key", "reason"),
    [
        (f"ros1_discovery_info/*/pub/{HEX}/{MD5}/chat", "seven parts"),
        (f"other/*/pub/{HEX}/{MD5}/*/chat", "seven parts"),
        (f"ros1_discovery_info/*/node/{HEX}/{MD5}/*/chat", "not one of pub, sub, srv, cl"),
        (f"ros1_discovery_info/*/pub/{HEX}a/{MD5}/*/chat", "hexadecimal"),
        (f"ros1_discovery_info/*/pub/{HEX.upper()}/{MD5}/*/chat", "hexadecimal"),
        (f"ros1_discovery_info/*/pub/xyz/{MD5}/*/chat", "hexadecimal"),
        (f"ros1_discovery_info/*/pub/{b'std_msgs'.hex()}/{MD5}/*/chat", "name of a type"),
        (f"ros1_discovery_info/*/pub/{b'../../etc/passwd'.hex()}/{MD5}/*/chat", "name of a type"),
        (f"ros1_discovery_info/*/pub/ff{HEX}/{MD5}/*/chat", "name of a type"),
        (f"ros1_discovery_info/*/pub/{HEX}/{MD5[1:]}/*/chat", "md5sum"),
        (f"ros1_discovery_info/*/pub/{HEX}/*/*/chat", "md5sum"),
        (f"ros1_discovery_info/*/pub/{HEX}/{MD5}/*/ch at", "topic or service"),
        (f"ros1_discovery_info/*/pub/{HEX}/{MD5}/*/chat\n/x", "topic or service"),
        (f"ros1_discovery_info/*/pub/{HEX}/{MD5}/*/**", "topic or service"),
        (f"ros1_discovery_info/*/pub/{HEX}/{MD5}/*/chat/", "topic or service"),
        (f"ros1_discovery_info/*/pub/{HEX}/{MD5}/*/{'a/' * 140}b", "topic or service"),
        (f"ros1_discovery_info/*/pub/{HEX}/{MD5}/*/{'a/' * 5000}b", "characters"),
    ],
)
def test_beacons_of_another_form_are_refused_with_the_reason(key: str, reason: str) -> None:
    with pytest.raises(BridgeError, match=reason):
        parse_beacon(key)


@given(st.text(max_size=200) | st.lists(st.text(max_size=20), max_size=9).map("/".join))
def test_any_beacon_is_parsed_or_refused(key: str) -> None:
    for text in (key, f"ros1_discovery_info/*/pub/{HEX}/{MD5}/*/{key}", f"ros1_discovery_info/*/{key}"):
        try:
            found = parse_beacon(text)
        except BridgeError:
            continue
        assert found is None or found.name.startswith("/")


@pytest.mark.parametrize("text", ["", "a/b", "**", "a*", "a b", "$x", "#", "?", "x" * 65, "ä"])
def test_namespaces_are_one_chunk_of_a_key(text: str) -> None:
    assert (parse_namespace("*"), parse_namespace("robot-1.x_y")) == ("*", "robot-1.x_y")
    with pytest.raises(BridgeError, match="not a namespace"):
        parse_namespace(text)


# --- beacons and their loss


def test_a_resource_is_lost_after_its_last_beacon() -> None:
    seen = Sightings()
    assert seen.received(CHAT, 100.0)
    assert not seen.received(CHAT, 101.0)
    assert not seen.forget_lost(101.0 + LOST_SECONDS)
    assert list(seen) == [CHAT]
    assert seen.forget_lost(101.1 + LOST_SECONDS)
    assert list(seen) == []
    assert seen.received(CHAT, 200.0)


def test_resources_are_kept_after_the_process_did_not_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """Zenoh's thread delivers the beacons from that time only after the loop has continued."""
    clock = Mock()
    clock.monotonic.return_value = 0.0
    monkeypatch.setattr(ros1_side, "time", clock)
    side = Ros1Side(*(Mock() for _ in range(6)), GatewayRules(), "*", set, Mock())  # type: ignore[arg-type]
    monkeypatch.setattr(side, "_adjust", AsyncMock())
    side._sightings.received(CHAT, 0.0)

    def beat(times: Iterable[float]) -> list[Resource]:
        """Simulate beats at these times; return the resources that are known afterwards."""
        left = [*times]

        async def sleep(_: float) -> None:
            if not left:
                raise EOFError
            clock.monotonic.return_value = left.pop(0)

        monkeypatch.setattr(ros1_side, "asyncio", Mock(sleep=sleep))
        with pytest.raises(EOFError):
            asyncio.run(side._beat())
        return list(side._sightings)

    assert beat([0.2, 100.0]) == [CHAT]
    # The beacons no longer arrive.
    assert beat([100.0 + 0.2 * number for number in range(30)]) == []


def test_resources_of_others_are_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ros1_keys, "MAX_RESOURCES", 2)
    seen = Sightings()
    for number in range(2):
        assert seen.received(CHAT._replace(name=f"/t{number}"), 0.0)
    with pytest.raises(BridgeError, match="more than 2"):
        seen.received(CHAT, 0.0)
    assert not seen.received(CHAT._replace(name="/t0"), 3.0)
    assert seen.forget_lost(1.0 + LOST_SECONDS)
    assert seen.received(CHAT, 6.0)


def test_beacons_are_due_each_period() -> None:
    beacons = Beacons(lambda: 0.0)
    beacons.update(["a", "b"], 10.0)
    assert beacons.due(10.0) == ["a", "b"]
    assert beacons.due(10.5) == []
    beacons.update(["b", "c"], 10.6)
    assert beacons.due(10.6) == ["c"]
    assert beacons.due(10.0 + PERIOD) == ["b"]


def test_a_beacon_that_another_puts_is_silent_until_that_one_ends() -> None:
    chances = iter([0.9, 0.1, 0.25])
    beacons = Beacons(lambda: next(chances))
    beacons.update(["a"], 0.0)
    assert beacons.due(0.0) == ["a"]
    beacons.received("a")
    beacons.received("not ours")
    assert beacons.due(1.0) == ["a"]
    beacons.received("a")
    assert beacons.due(2.0) == []
    beacons.received("a")
    assert beacons.due(3.0) == []
    # The other bridge has stopped, so a beacon is due after a random part of a period.
    assert beacons.due(4.0) == []
    assert beacons.due(4.2) == []
    assert beacons.due(4.25) == ["a"]
    assert beacons.due(5.25) == ["a"]


def test_of_many_that_put_a_beacon_some_goes_on() -> None:
    """Twenty gateways in lockstep for a minute: no gap is long enough for peers to consider the resource lost."""
    import random

    chance = random.Random(1).random
    all_ = [Beacons(chance) for _ in range(20)]
    for each in all_:
        each.update(["a"], 0.0)
    put, last, gap = 0, 0.0, 0.0
    for step in range(300):
        now = step * 0.2
        for each in all_:
            if each.due(now):
                put += 1
                gap, last = max(gap, now - last), now
                for other in all_:
                    if other is not each:
                        other.received("a")
    assert gap < LOST_SECONDS
    assert put < 60 * 20 / 4


# --- topics of here and elsewhere


def test_topics_of_here_and_elsewhere_are_joined() -> None:
    found, conflicts = shared_topics(
        {"/chat": token(is_published=True), "/scan": token("/scan", is_subscribed=True, md5sum=UNKNOWN_MD5)},
        [
            Resource("sub", "/chat", "std_msgs/String", MD5),
            Resource("pub", "/scan", "std_msgs/String", OTHER),
            Resource("pub", "/there", "std_msgs/String", MD5),
            Resource("srv", "/lamp", "std_srvs/SetBool", MD5),
        ],
    )
    assert conflicts == {}
    assert {name: (each.is_offered, each.is_wanted) for name, each in found.items()} == {
        "/chat": (False, True),
        "/scan": (True, False),
        "/there": (True, False),
    }
    assert found["/scan"].token == token("/scan", is_subscribed=True, md5sum=OTHER)


def test_a_topic_of_another_type_elsewhere_is_left_out() -> None:
    found, conflicts = shared_topics(
        {"/chat": token(is_published=True), "/scan": token("/scan", is_subscribed=True, md5sum=UNKNOWN_MD5)},
        [
            Resource("pub", "/chat", "std_msgs/String", OTHER),
            Resource("pub", "/scan", "a/B", MD5),
            Resource("pub", "/there", "a/B", MD5),
            Resource("sub", "/there", "a/C", OTHER),
        ],
    )
    assert conflicts.keys() == {"/chat", "/scan", "/there"}
    assert conflicts["/chat"] == f"std_msgs/String [{OTHER}], not std_msgs/String [{MD5}]"
    assert [(name, each.is_offered, each.is_wanted) for name, each in found.items()] == [
        ("/chat", False, False),
        ("/there", True, False),
    ]


def test_an_error_in_place_of_a_response_is_found() -> None:
    set_bool = Resource("srv", "/lamp", "std_srvs/SetBool", "09fb03525b03e7ea1fd3992bafd87e16")
    assert ros1_side._error_in(set_bool, b"\1\2\0\0\0on") == ""
    assert ros1_side._error_in(set_bool, b"the lamp is stuck") == "the lamp is stuck"
    assert ros1_side._error_in(set_bool, b"no") == "no"
    assert ros1_side._error_in(set_bool._replace(type="no_such_msgs/Type"), b"the lamp is stuck") == ""
    assert ros1_side._error_in(set_bool._replace(md5sum=OTHER), b"the lamp is stuck") == ""


@pytest.mark.parametrize(
    "keys", [{"namespace": "\x1b[31m", "announced": "x", "sent": [{}], "passed_in": 5}, 7]
)
def test_a_status_with_these_keys_is_printed(keys: object) -> None:
    found = "\n".join(lines([Answer(CLAIM, {"ros1_keys": keys})], []))
    assert "\x1b" not in found
    assert ("zenoh-bridge-ros1" in found) == (keys != 7)
