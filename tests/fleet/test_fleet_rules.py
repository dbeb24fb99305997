"""The pure parts of a fleet: keys, rules, payloads, queues, frames, clocks and the report."""

from __future__ import annotations

import json
from io import BytesIO

import pytest
from geometry_msgs.msg import TransformStamped
from hypothesis import given
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Image
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from minirospy.base.errors import BridgeError, DefinitionError, DeserializationError
from minirospy.base.name_filter import NameFilter
from minirospy.fleet import keys
from minirospy.fleet.clocks import ClockOffset, Delay, Ping, offset_of
from minirospy.fleet.contents import MAX_NAMES, FleetContents
from minirospy.fleet.definitions import checked_specs
from minirospy.fleet.flows import Flow, FlowQueue
from minirospy.fleet.frames import FrameRewriter, prefixed, stripped
from minirospy.fleet.holders import HOLD_SECONDS
from minirospy.fleet.keys import ROOT, Claim, Offer, ServiceToken, Stamp, TopicToken, Want
from minirospy.fleet.network import EndpointError, is_loopback_endpoint, to_endpoint
from minirospy.fleet.report import Answer, as_json, lines, parse_answer
from minirospy.fleet.rules import (
    GatewayRules,
    Priority,
    Throttle,
    exported_services,
    exported_topics,
    parse_priorities,
    parse_rates,
    priority_of_type,
)
from minirospy.introspect.snapshot import Snapshot

MD5 = "992ce8a1687cec8c8bd883ec73ca41d1"
GATEWAY, OTHER, HOST, ELSEWHERE = "0123456789abcdef", "f" * 16, "a" * 16, "b" * 16
SCAN = TopicToken("robot1", GATEWAY, "/arm/scan", "std_msgs/String", MD5, True, False)


# --- keys


@pytest.mark.parametrize(
    "token",
    [
        SCAN,
        SCAN._replace(is_subscribed=True, is_latched=True, has_frames=True),
        SCAN._replace(is_published=False, is_subscribed=True, md5sum=keys.UNKNOWN_MD5),
    ],
)
def test_topic_tokens_come_back(token: TopicToken) -> None:
    key = keys.topic_key(token)
    assert key.startswith(f"{ROOT}/topic/robot1/{GATEWAY}/%arm%scan/std_msgs%String/")
    assert keys.parse_topic(key) == token
    assert keys.parse_service(key) is None


def test_other_keys_come_back() -> None:
    claim = Claim("robot1", GATEWAY, 1_700_000_000_000_000_000, HOST)
    service = ServiceToken("robot1", GATEWAY, "/lamp", "std_srvs/SetBool", MD5)
    want, offer = Want("/scan", OTHER), Offer("/cmd_vel", OTHER, "geometry_msgs/Twist", MD5, True)
    assert keys.parse_claim(keys.claim_key(claim)) == claim
    assert keys.parse_claim(keys.claim_key(claim._replace(name="-"))) is None
    nameless = claim._replace(name="-")
    assert keys.parse_claim(keys.claim_key(nameless, "control"), "control") == nameless
    assert keys.parse_service(keys.service_key(service)) == service
    assert keys.parse_want(keys.want_key("robot1", GATEWAY, want)) == want
    assert keys.parse_offer(keys.offer_key("robot1", GATEWAY, offer)) == offer
    assert keys.parse_in(keys.in_key("robot1", GATEWAY, MD5, "/cmd_vel", OTHER)) == ("/cmd_vel", MD5, OTHER)
    assert keys.parse_call(keys.call_key("robot1", GATEWAY, "/lamp", MD5)) == ("/lamp", MD5)
    assert keys.parse_stamp(keys.serialize_stamp(Stamp(7, -5))) == Stamp(7, -5)
    assert keys.parse_stamp(b"short") is None


@pytest.mark.parametrize(
    "key",
    [
        "",
        "topic/robot1",
        f"{ROOT}/topic/robot1/{GATEWAY}/%a/std_msgs%String/{MD5}",
        f"{ROOT}/topic/1robot/{GATEWAY}/%a/std_msgs%String/{MD5}/p",
        f"{ROOT}/topic/robot1/nonsense/%a/std_msgs%String/{MD5}/p",
        f"{ROOT}/topic/robot1/{GATEWAY}/a/std_msgs%String/{MD5}/p",
        f"{ROOT}/topic/robot1/{GATEWAY}/%a%%b/std_msgs%String/{MD5}/p",
        f"{ROOT}/topic/robot1/{GATEWAY}/%a%/std_msgs%String/{MD5}/p",
        f"{ROOT}/topic/robot1/{GATEWAY}/%a\x1b/std_msgs%String/{MD5}/p",
        f"{ROOT}/topic/robot1/{GATEWAY}/%{'a' * 300}/std_msgs%String/{MD5}/p",
        f"{ROOT}/topic/robot1/{GATEWAY}/%a/os.system/{MD5}/p",
        f"{ROOT}/topic/robot1/{GATEWAY}/%a/std_msgs%String%x/{MD5}/p",
        f"{ROOT}/topic/robot1/{GATEWAY}/%a/std_msgs%String/-/p",
        f"{ROOT}/topic/robot1/{GATEWAY}/%a/std_msgs%String/{MD5}/l",
        f"{ROOT}/topic/robot1/{GATEWAY}/%a/std_msgs%String/{MD5}/q",
    ],
)
def test_other_forms_of_topics_are_ignored(key: str) -> None:
    assert keys.parse_topic(key) is None


@given(st.text(max_size=80))
def test_no_key_raises(text: str) -> None:
    for key in (
        text,
        f"{ROOT}/{text}",
        *(f"{ROOT}/{kind}/{text}" for kind in ("topic", "robot", "in", "call")),
    ):
        for parse in (
            keys.parse_topic,
            keys.parse_claim,
            keys.parse_service,
            keys.parse_want,
            keys.parse_offer,
            keys.parse_in,
            keys.parse_call,
        ):
            parse(key)


def test_flags_that_do_not_change_messages_keep_a_link() -> None:
    assert SCAN.has_same_messages(SCAN._replace(is_subscribed=True, is_latched=True))
    assert not SCAN.has_same_messages(SCAN._replace(md5sum="0" * 32))
    assert not SCAN.has_same_messages(SCAN._replace(has_frames=True))
    assert not SCAN._replace(is_published=False).has_same_messages(SCAN)


# --- rules


def test_exports_are_topics_of_other_nodes() -> None:
    snapshot = Snapshot(
        {"/scan": ("/laser",), "/own": ("/gw",), "/robot2/scan": ("/gw", "/x"), "/a b": ("/x",)},
        {"/cmd_vel": ("/base", "/gw"), "/untyped": ("/x",), "/scan": ("/gw",)},
        {"/lamp": ("/x",), "/gw/reset": ("/gw",), "/x/get_loggers": ("/x",), "/robot2/lamp": ("/gw",)},
        {
            "/scan": "a/B",
            "/own": "a/B",
            "/robot2/scan": "a/B",
            "/cmd_vel": "a/C",
            "/a b": "a/B",
        },
    )
    found = exported_topics(snapshot, {"/gw"}, lambda _: True, ["robot2"])
    assert {name: (each.publishers, each.subscribers) for name, each in found.items()} == {
        "/scan": (("/laser",), ()),
        "/cmd_vel": ((), ("/base",)),
    }
    assert exported_topics(snapshot, {"/gw"}, lambda name: name == "/scan").keys() == {"/scan"}
    every = NameFilter()
    assert exported_services(snapshot, {"/gw"}, every, ["robot2"]) == {"/lamp": ("/x",)}
    assert exported_services(snapshot, {"/gw"}, NameFilter.of(["/x/*"])).keys() == {"/x/get_loggers"}


def test_rates_and_priorities_go_by_the_first_pattern() -> None:
    rates, priorities = parse_rates(["/camera/*=5", "*=100"]), parse_priorities(["/camera/cmd=teleop"])
    rules = GatewayRules(rates=rates, priorities=priorities)
    assert (rules.rate("/camera/image"), rules.rate("/scan")) == (5.0, 100.0)
    assert GatewayRules().rate("/scan") == 0
    assert rules.priority("/camera/cmd", "sensor_msgs/Image") is Priority.TELEOP
    assert rules.priority("/camera/image", "sensor_msgs/Image") is Priority.BULK
    assert (priority_of_type("geometry_msgs/Twist"), priority_of_type("std_msgs/String")) == (
        Priority.TELEOP,
        Priority.DATA,
    )


@pytest.mark.parametrize(
    "word", ["5", "=5", "scan=5", "/scan=", "/scan=0", "/scan=-1", "/scan=fast", "/scan=nan"]
)
def test_bad_rates_are_refused(word: str) -> None:
    with pytest.raises(BridgeError, match="--rate"):
        parse_rates([word])
    with pytest.raises(BridgeError, match="--priority"):
        parse_priorities([word])


def test_a_throttle_keeps_the_mean_rate() -> None:
    throttle = Throttle(10.0)
    passed = [number for number in range(300) if throttle.allows(100 + number / 30)]
    assert 99 <= len(passed) <= 101
    assert sum(throttle.allows(1000.0) for _ in range(50)) == 1
    assert all(Throttle(0.0).allows(1.0) for _ in range(10))


# --- contents


def test_contents_follow_tokens_in_any_order() -> None:
    now = 0.0
    fleet = FleetContents(lambda name: name != "secret", lambda: now)
    claim = Claim("robot1", GATEWAY, 10, HOST)
    assert fleet.add(keys.topic_key(SCAN))
    assert fleet.robots() == {}
    assert fleet.add(keys.claim_key(claim))
    assert list(fleet.robots()["robot1"].topics) == ["/arm/scan"]
    both = SCAN._replace(is_subscribed=True)
    assert fleet.add(keys.topic_key(both))
    assert not fleet.remove(keys.topic_key(SCAN))
    assert fleet.robots()["robot1"].topics["/arm/scan"] == both
    second = Claim("robot1", OTHER, 20, ELSEWHERE)
    assert fleet.add(keys.claim_key(second))
    assert fleet.robots()["robot1"].duplicates == (second,)
    assert fleet.remove(keys.claim_key(claim))
    assert fleet.robots() == {}, "the first machine may be back in a moment"
    now += HOLD_SECONDS
    assert fleet.robots()["robot1"].claim == second
    assert not fleet.add(keys.claim_key(claim._replace(name="secret")))
    assert fleet.refused == 0
    assert not fleet.add("nonsense")
    assert not fleet.remove("nonsense")
    assert fleet.refused == 1


def test_a_gateway_has_a_limit_of_names() -> None:
    fleet = FleetContents(lambda _: True)
    for number in range(MAX_NAMES + 10):
        fleet.add(keys.topic_key(SCAN._replace(topic=f"/t{number}")))
    fleet.add(keys.claim_key(Claim("robot1", GATEWAY, 10, HOST)))
    assert len(fleet.robots()["robot1"].topics) == MAX_NAMES
    assert fleet.refused == 10


def test_all_gateways_together_have_a_limit_of_names(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.fleet.contents.MAX_TOKENS", 10)
    fleet = FleetContents(lambda _: True)
    tokens = [SCAN._replace(robot=f"robot{number}") for number in range(13)]
    for token in tokens:
        fleet.add(keys.topic_key(token))
    fleet.add(keys.service_key(ServiceToken("robot1", GATEWAY, "/add", SCAN.type, SCAN.md5sum)))
    assert fleet.refused == 4
    assert "more than 10 topics and services" in fleet.refusal
    assert len(fleet._gateways) == 10

    # Removing a topic makes room for another, and a changed flag needs no room.
    assert fleet.add(keys.topic_key(tokens[0]._replace(is_subscribed=True)))
    assert fleet.remove(keys.topic_key(tokens[1]))
    assert fleet.add(keys.topic_key(tokens[12]))
    assert not fleet.add(keys.topic_key(tokens[11]))
    assert not fleet.remove(keys.topic_key(tokens[11]))
    for token in tokens[2:]:
        fleet.remove(keys.topic_key(token))
    assert fleet._count == 1


# --- queues


def test_a_flow_that_floods_loses_its_own_messages() -> None:
    queue: FlowQueue[int] = FlowQueue()
    flood, quiet = Flow[int](10, 10_000), Flow[int](10, 10_000)
    for number in range(1000):
        queue.add(flood, number, 1)
    queue.add(quiet, -1, 1)
    assert flood.dropped == 990
    taken = [queue.pop() for _ in range(11)]
    assert [each[1] for each in taken if each][:2] == [990, -1]
    assert (flood.passed, quiet.passed, quiet.dropped) == (10, 1, 0)
    assert queue.pop() is None


def test_large_messages_are_limited_by_their_bytes() -> None:
    queue: FlowQueue[str] = FlowQueue()
    flow = Flow[str](100, 1000)
    assert queue.add(flow, "huge", 5000) == 0
    assert queue.add(flow, "large", 900) == 1
    assert queue.add(flow, "small", 50) == 0
    assert [queue.pop(), queue.pop()] == [(flow, "large"), (flow, "small")]
    assert flow.waiting_bytes == 0
    queue.add(flow, "left", 10)
    queue.forget(flow)
    assert queue.pop() is None
    assert len(queue) == 0


# --- frames


def serialized(message: object) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)  # type: ignore[attr-defined]
    return buffer.getvalue()


def rewriter(cls: type) -> FrameRewriter:
    specs = checked_specs(cls._type, cls._full_text, cls._md5sum)  # type: ignore[attr-defined]
    return FrameRewriter(specs[cls._type], specs.__getitem__)  # type: ignore[attr-defined]


def test_frames_of_transforms_get_the_prefix_and_lose_it() -> None:
    message = TFMessage(
        [TransformStamped(child_frame_id="/laser"), TransformStamped(child_frame_id="robot1/x")]
    )
    message.transforms[0].header.frame_id = "base_link"
    made = rewriter(TFMessage)
    data = made.rewritten(serialized(message), prefixed("robot1"))
    after = TFMessage().deserialize(data)
    assert [(each.header.frame_id, each.child_frame_id) for each in after.transforms] == [
        ("robot1/base_link", "robot1/laser"),
        ("", "robot1/x"),
    ]
    back = TFMessage().deserialize(made.rewritten(data, stripped("robot1")))
    assert [each.child_frame_id for each in back.transforms] == ["laser", "x"]


def test_the_rest_of_a_message_stays() -> None:
    image = Image(height=2, width=3, encoding="rgb8", data=bytes(18))
    image.header.frame_id = "camera"
    image.header.seq = 7
    after = Image().deserialize(rewriter(Image).rewritten(serialized(image), prefixed("r")))
    assert (after.header.frame_id, after.header.seq, bytes(after.data)) == ("r/camera", 7, bytes(18))
    odometry = Odometry(child_frame_id="base_link")
    odometry.pose.covariance = [float(number) for number in range(36)]
    odometry.twist.covariance = [1.0] * 36
    after = Odometry().deserialize(rewriter(Odometry).rewritten(serialized(odometry), prefixed("r")))
    assert after.child_frame_id == "r/base_link"
    assert after.pose == odometry.pose
    assert after.twist == odometry.twist
    assert not rewriter(String).has_frames


@given(st.binary(max_size=200))
def test_bytes_that_are_no_message_are_refused(data: bytes) -> None:
    for cls in (TFMessage, Odometry):
        try:
            rewriter(cls).rewritten(data, prefixed("r"))
        except DeserializationError:
            pass


def test_a_definition_of_a_peer_is_checked() -> None:
    assert checked_specs("std_msgs/String", String._full_text, String._md5sum)
    for name, text in (
        ("std_msgs/String", "string other\n"),
        ("std_msgs/String", "no definition"),
        ("a/B", "a/B[] x\n"),
        ("a/B", "c/D x\n"),
        ("a/B", "int8 x\n" * 100_000),
    ):
        with pytest.raises(DefinitionError):
            checked_specs(name, text, String._md5sum)


# --- clocks, report, endpoints


def test_the_fastest_answer_gives_the_offset() -> None:
    slow, fast = Ping(0, 5_000, 9_000), Ping(100, 1_160, 120)
    assert offset_of([slow, fast]) == ClockOffset(1_050, 20)
    assert offset_of([]) is None
    delay = Delay()
    for each in (-5, 10, 30):
        delay.add(each)
    assert (delay.count, delay.longest) == (3, 30)


def test_the_report_survives_any_answer() -> None:
    claim = Claim("robot1", GATEWAY, 10, HOST)
    hostile = json.dumps(
        {"topics": "many", "sent": [1, {"topic": "\x1b[2J"}], "machine": ["x"], "robots": [{}]}
    )
    answers = [
        Answer(claim, parse_answer(hostile.encode()), ClockOffset(3_600_000_000_000, 1_000_000)),
        Answer(claim._replace(gateway=OTHER, start=20, host=ELSEWHERE), {"master": False, "topics": 1}),
        Answer(claim._replace(name="robot2"), parse_answer(b"[" * 100_000)),
    ]
    room = {"robots": [{"name": "robot1", "gateway": GATEWAY}]}
    rooms = [Answer(claim._replace(name="-"), parse_answer(hostile.encode())), Answer(claim, room)]
    found = lines(answers, rooms)
    assert found[0] == "2 robots, 2 control rooms"
    assert "clock +3600.000 s, round trip 1.0 ms" in found[1]
    assert "\x1b" not in "".join(found)
    assert found[3] == (
        f"robot1 (?, machine {ELSEWHERE}, gateway {OTHER}), 1 topic, 0 services, its clock does not answer, "
        "NOT SHOWN: another gateway has this name, "
        "ITS MASTER DOES NOT ANSWER"
    )
    assert found[4] == "robot2: is there, but does not answer"
    assert json.loads(as_json(answers, rooms))["robots"][1]["shown"] is False
    assert json.loads(as_json(answers, []))["robots"][1]["shown"] is True


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("host:99999", "has the port 99999"),
        ("host:" + "9" * 5000, "has the port 99999999999999999999: ports are"),
        ("tcp/host:0", "has the port 0"),
        ("http://host", "is not an endpoint"),
        ("http://host:7447", "is not an endpoint"),
        ("tcp://host:7447", "is not an endpoint"),
        ("/dev/ttyUSB0", "is not an endpoint"),
        ("tcp/host", "has no port"),
        ("tcp/host:7447x", "has no port"),
        ("tcp/:7447", "no name and no address"),
        ("tcp/ho$t:7447", "no name and no address"),
        ("::1", "an IPv6 address is in brackets"),
    ],
)
def test_endpoints_that_can_never_work_are_refused(text: str, reason: str) -> None:
    with pytest.raises(EndpointError, match=reason):
        to_endpoint(text)


@pytest.mark.parametrize(
    "text",
    [
        "tcp/[fe80::1%eth0]:7447#iface=eth0",
        "quic/host:7447?rel=1",
        "unixsock-stream//tmp/x",
        "serial//dev/ttyUSB0#baudrate=9600",
        "tcp/host-1.local:1,host-2.local:2",
    ],
)
def test_endpoints_of_zenoh_pass_as_they_are(text: str) -> None:
    assert to_endpoint(text) == text
    assert to_endpoint("tcp/0.0.0.0:0", listens=True) == "tcp/0.0.0.0:0"


def test_endpoints_may_be_hosts() -> None:
    assert to_endpoint("robot.local") == "tcp/robot.local:7447"
    assert to_endpoint("10.0.0.1:7000") == "tcp/10.0.0.1:7000"
    assert to_endpoint("[::1]") == "tcp/[::1]:7447"
    assert to_endpoint("tls/host:7447") == "tls/host:7447"
    with pytest.raises(BridgeError):
        to_endpoint("")
    assert is_loopback_endpoint("tcp/127.0.0.1:7447")
    assert is_loopback_endpoint("tls/localhost:7447")
    assert is_loopback_endpoint("tcp/[::1]:7447")
    assert not is_loopback_endpoint("tcp/0.0.0.0:7447")
    assert not is_loopback_endpoint("tcp/robot.local:7447")
