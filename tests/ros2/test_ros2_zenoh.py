"""The bridge over Zenoh, with a session that writes rmw_zenoh's keys literally, through a router on this machine."""

from __future__ import annotations

import importlib.metadata
import json
import queue
import threading
from collections.abc import Iterator
from concurrent.futures import Future
from types import SimpleNamespace
from typing import Any

import pytest

from minirospy.base.errors import BridgeError
from minirospy.base.installation import install_command
from minirospy.cli.ros2_bridge import main
from minirospy.ros2.definitions import Definitions
from minirospy.ros2.layouts import TypesDiffer
from minirospy.ros2.links import Ros2End
from minirospy.ros2.rules import BUILT_IN
from minirospy.ros2.zenoh_calls import MAX_UNDER_WAY, ZenohClient, ZenohServer
from minirospy.ros2.zenoh_keys import Entity, Kind, attachment, gid_of, parse_token
from minirospy.ros2.zenoh_node import ZenohNode
from minirospy.ros2.zenoh_side import ZenohSide
from minirospy.zenoh.library import NetworkOptions
from tests.conftest import free_port
from tests.ros2.ros2_definitions import catalogue
from tests.ros2.test_ros2_zenoh_keys import SERVICE_HASHES, STRING_HASH
from tests.waiting import wait_until

zenoh: Any = pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")

LIMIT = 60.0  # seconds to wait for a state before failing; much longer than a busy machine takes
CHATTER = f"0/chatter/std_msgs::msg::dds_::String_/{STRING_HASH}"
SWITCH = f"0/switch/std_srvs::srv::dds_::SetBool_/{SERVICE_HASHES['std_srvs/SetBool']}"
HELLO = bytes.fromhex("00010000 06000000 68656c6c6f00")
GID = bytes(range(16))


@pytest.fixture(autouse=True)
def domain(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("ROS_DOMAIN_ID", "ZENOH_SESSION_CONFIG_URI"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def endpoint() -> Iterator[str]:
    """Yield the endpoint of a router."""
    where = f"tcp/127.0.0.1:{free_port()}"
    session = opened("router", listen=where)
    yield where
    session.close()


@pytest.fixture
def node(endpoint: str) -> Iterator[RmwNode]:
    """Yield a ROS 2 node."""
    found = RmwNode(endpoint)
    yield found
    found.session.close()


@pytest.fixture
def side(endpoint: str) -> Iterator[ZenohSide]:
    """Yield the bridge's ROS 2 side."""
    found = ZenohSide(
        "minirospy_ros2_bridge", NetworkOptions((endpoint,)), Definitions(BUILT_IN, catalogue())
    )
    yield found
    found.close()


def opened(mode: str, *, listen: str = "", connect: str = "") -> Any:
    config = zenoh.Config()
    for key, value in (
        ("mode", mode),
        ("listen/endpoints", [listen] if listen else []),
        ("connect/endpoints", [connect] if connect else []),
        ("scouting/multicast/enabled", False),
        ("timestamping/enabled", True),
    ):
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


class RmwNode:
    """The Zenoh declarations of rmw_zenoh for a node called peer."""

    def __init__(self, endpoint: str) -> None:
        self.session = opened("client", connect=endpoint)
        self.kept: list[Any] = [self.token("0/0/NN/%/%/peer")]

    def token(self, rest: str) -> Any:
        token = self.session.liveliness().declare_token(f"@ros2_lv/0/{self.session.info.zid()}/{rest}")
        self.kept = [*getattr(self, "kept", []), token]
        return token

    def end(self, id: int, kind: str, key: str, qos: str = "::,10:,:,:,,") -> Any:
        _, *name, type_, hash_ = key.split("/")
        return self.token(f"0/{id}/{kind}/%/%/peer/%{'%'.join(name)}/{type_}/{hash_}/{qos}")

    def tokens(self) -> set[str]:
        """Return the keys of all tokens of other sessions."""
        found = [str(each.ok.key_expr) for each in self.session.liveliness().get("@ros2_lv/**")]
        return {each for each in found if str(self.session.info.zid()) not in each}

    def subscribe(self, key: str) -> queue.Queue[Any]:
        came: queue.Queue[Any] = queue.Queue()
        self.kept.append(self.session.declare_subscriber(key, came.put))
        return came


def numbered(sample: Any) -> tuple[int, bytes]:
    """Return the sequence number and the id in an attachment."""
    data = sample.attachment.to_bytes()
    assert (len(data), data[16]) == (33, 16)
    return int.from_bytes(data[:8], "little"), data[17:]


# --- topics


def test_the_graph_is_that_of_the_tokens(node: RmwNode, side: ZenohSide) -> None:
    node.end(1, "MP", CHATTER, "2:1:,1:,:,:,,")
    leaving = node.end(2, "MS", CHATTER)
    node.end(3, "SS", SWITCH)
    wait_until(
        lambda: (
            side.nodes()
            and side.services()
            and side.ends("/chatter").subscribers
            and side.ends("/chatter").publishers
        )
    )
    assert side.nodes() == [("peer", "/")]
    assert side.topics() == {"/chatter": ("std_msgs/String",)}
    assert side.services() == {"/switch": "std_srvs/SetBool"}
    assert side.ends("/chatter").publishers == (Ros2End("peer", "std_msgs/String", False, True),)
    assert side.ends("/chatter").subscribers == (Ros2End("peer", "std_msgs/String"),)
    leaving.undeclare()
    wait_until(lambda: not side.ends("/chatter").subscribers)
    node.session.close()
    wait_until(lambda: not side.nodes() and not side.topics())


def test_messages_for_ros2_have_the_key_and_attachment_of_rmw_zenoh(node: RmwNode, side: ZenohSide) -> None:
    came = node.subscribe(CHATTER)
    node.end(1, "MS", CHATTER)
    wait_until(lambda: side.ends("/chatter").subscribers)
    publisher = side.publisher("/chatter", "std_msgs/String", depth=7, is_latched=False)
    wait_until(lambda: publisher.subscribers == 1)
    publisher.publish(HELLO)
    publisher.publish(HELLO)

    wait_until(lambda: any("/MP/" in each for each in node.tokens()))
    (token,) = [each for each in node.tokens() if "/MP/" in each]
    entity = parse_token(token)
    assert entity
    assert (entity.node, entity.key, entity.qos.depth) == ("minirospy_ros2_bridge", CHATTER, 7)
    for number in (1, 2):
        sample = came.get(timeout=LIMIT)
        assert sample.payload.to_bytes() == HELLO
        assert numbered(sample) == (number, gid_of(token))
    publisher.close()
    wait_until(lambda: not any("/MP/" in each for each in node.tokens()))


def test_messages_of_ros2_come_but_not_those_of_the_bridge(node: RmwNode, side: ZenohSide) -> None:
    came: queue.Queue[bytes] = queue.Queue()
    node.end(1, "MP", CHATTER)
    wait_until(lambda: side.ends("/chatter").publishers)
    subscription = side.subscribe(
        "/chatter", "std_msgs/String", came.put, depth=7, is_reliable=False, is_latched=False
    )
    wait_until(lambda: any("/MS/" in each and "/2::,7:" in each for each in node.tokens()))
    own = side.publisher("/chatter", "std_msgs/String", depth=7, is_latched=False)
    own.publish(b"own")
    publisher = node.session.declare_publisher(CHATTER)
    wait_until(lambda: publisher.matching_status.matching)
    publisher.put(HELLO)
    assert came.get(timeout=LIMIT) == HELLO
    subscription.close()
    subscription.close()
    wait_until(lambda: not publisher.matching_status.matching)


def test_own_subscription_is_not_the_subscriber_that_is_waited_for(node: RmwNode, side: ZenohSide) -> None:
    side.subscribe("/chatter", "std_msgs/String", bytes, depth=7, is_reliable=True, is_latched=False)
    publisher = side.publisher("/chatter", "std_msgs/String", depth=7, is_latched=False)
    # Its token is declared before messages can reach it.
    node.end(1, "MS", CHATTER)
    wait_until(lambda: side.ends("/chatter").subscribers)
    assert publisher.subscribers == 0
    node.subscribe(CHATTER)
    wait_until(lambda: publisher.subscribers == 1)


def test_late_ros2_subscriber_receives_latched_messages(node: RmwNode, side: ZenohSide) -> None:
    there = node.subscribe(CHATTER)
    publisher = side.publisher("/chatter", "std_msgs/String", depth=1, is_latched=True)
    publisher.publish(b"old")

    def has_passed() -> bool:
        publisher.publish(HELLO)
        return any(each.payload.to_bytes() == HELLO for each in there.queue)

    # A subscriber that joins while the first message is in transit also receives that one.
    wait_until(has_passed)
    came: queue.Queue[Any] = queue.Queue()
    # rmw_zenoh declares a transient local subscriber in this way.
    subscriber = zenoh.ext.declare_advanced_subscriber(
        node.session,
        CHATTER,
        came.put,
        history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=10),
        recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
        subscriber_detection=True,
    )
    assert came.get(timeout=LIMIT).payload.to_bytes() == HELLO
    subscriber.undeclare()


def test_kept_ros2_messages_reach_a_latched_subscription(node: RmwNode, side: ZenohSide) -> None:
    def latched(text: bytes) -> Any:
        # rmw_zenoh declares a transient local publisher in this way.
        made = zenoh.ext.declare_advanced_publisher(
            node.session,
            CHATTER,
            cache=zenoh.ext.CacheConfig(max_samples=1),
            sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=0.5),
            publisher_detection=True,
        )
        made.put(text)
        return made

    kept = [latched(b"one")]
    came: queue.Queue[bytes] = queue.Queue()
    side.subscribe("/chatter", "std_msgs/String", came.put, depth=10, is_reliable=True, is_latched=True)
    assert came.get(timeout=LIMIT) == b"one"
    kept.append(latched(b"two"))
    assert came.get(timeout=LIMIT) == b"two"


def test_another_definition_is_refused_with_both_hashes(node: RmwNode, side: ZenohSide) -> None:
    other = "RIHS01_" + "0" * 64
    node.end(1, "MS", CHATTER.replace(STRING_HASH, other))
    wait_until(lambda: side.ends("/chatter").subscribers)
    for refused in (
        lambda: side.fields("std_msgs/String"),
        lambda: side.publisher("/chatter", "std_msgs/String", depth=1, is_latched=False),
    ):
        with pytest.raises(
            TypesDiffer, match=f"another definition in ROS 2: its hash there is {other}, here {STRING_HASH}"
        ):
            refused()
    node.end(2, "MP", CHATTER)
    wait_until(lambda: side.ends("/chatter").publishers)
    assert side.fields("std_msgs/String") == {"data": "string"}


def test_keys_of_humble_have_no_hash(node: RmwNode, side: ZenohSide) -> None:
    key = "0/echo/sensor_msgs::msg::dds_::Range_/TypeHashNotSupported"
    came = node.subscribe(key)
    node.end(1, "MS", key)
    wait_until(lambda: side.ends("/echo").subscribers)
    assert "variance" not in side.fields("sensor_msgs/Range")
    publisher = side.publisher("/echo", "sensor_msgs/Range", depth=1, is_latched=False)
    wait_until(lambda: publisher.subscribers)
    publisher.publish(HELLO)
    assert str(came.get(timeout=LIMIT).key_expr) == key
    # Use a type that no endpoint has yet.
    side.serve("/switch", "std_srvs/SetBool", lambda _: Future())
    wait_until(lambda: any("dds_::SetBool_/TypeHashNotSupported" in each for each in node.tokens()))


# --- services


def test_calls_reach_a_server_of_ros2(node: RmwNode, side: ZenohSide) -> None:
    asked: list[tuple[int, bytes]] = []

    def answer(query: Any) -> None:
        asked.append(numbered(query))
        if query.payload.to_bytes() == b"fail":
            query.reply_err(b"no\nway")
        elif query.payload.to_bytes() != b"drop":
            query.reply(SWITCH, b"answer " + query.payload.to_bytes(), attachment=query.attachment)
        query.drop()

    client = side.client("/switch", "std_srvs/SetBool")
    assert not client.is_ready
    node.kept.append(node.session.declare_queryable(SWITCH, answer, complete=True))
    node.end(1, "SS", SWITCH)
    wait_until(lambda: client.is_ready)
    assert client.call(b"one").result(LIMIT) == b"answer one"
    assert client.call(b"two").result(LIMIT) == b"answer two"
    (token,) = [each for each in node.tokens() if "/SC/" in each]
    assert asked == [(1, gid_of(token)), (2, gid_of(token))]
    with pytest.raises(BridgeError, match=r"^service \[/switch\] of ROS 2: no.*way$"):
        client.call(b"fail").result(LIMIT)
    with pytest.raises(BridgeError, match="has ended without a response"):
        client.call(b"drop").result(LIMIT)
    client.close()
    wait_until(lambda: not any("/SC/" in each for each in node.tokens()))


def called(node: RmwNode, key: str, request: bytes, attachment: bytes | None) -> Any:
    """Call a service as rmw_zenoh does; return the reply."""
    replies = node.session.get(
        key,
        target=zenoh.QueryTarget.ALL_COMPLETE,
        consolidation=zenoh.ConsolidationMode.NONE,
        payload=request,
        attachment=attachment,
        timeout=LIMIT,
    )
    return next(iter(replies))


def test_calls_of_ros2_are_answered_with_their_attachment(node: RmwNode, side: ZenohSide) -> None:
    def answer(request: bytes) -> Future[bytes]:
        answered: Future[bytes] = Future()
        if request == b"fail":
            answered.set_exception(BridgeError("the motor\nis hot"))
        else:
            answered.set_result(b"answer " + request)
        return answered

    server = side.serve("/switch", "std_srvs/SetBool", answer)
    wait_until(lambda: any("/SS/" in each for each in node.tokens()))
    sent = attachment(5, 77, GID)
    sample = called(node, SWITCH, b"one", sent).ok
    assert sample.payload.to_bytes() == b"answer one"
    assert numbered(sample) == (5, GID)
    assert sample.attachment.to_bytes() != sent

    # If the response has a string field, it contains the reason.
    failed = called(node, SWITCH, b"fail", sent).ok.payload.to_bytes()
    assert failed == bytes.fromhex("00010000 00 000000 11000000") + b"the motor is hot\0"
    refused = called(node, SWITCH, b"one", None).err.payload.to_bytes()
    assert refused == b"this is not a request of rmw_zenoh, or too large"
    server.close()
    wait_until(lambda: not any("/SS/" in each for each in node.tokens()))


def test_a_call_that_fails_without_place_for_the_reason_is_an_error(node: RmwNode, side: ZenohSide) -> None:
    key = f"0/clear/std_srvs::srv::dds_::Empty_/{SERVICE_HASHES['std_srvs/Empty']}"
    failed: Future[bytes] = Future()
    failed.set_exception(BridgeError("it has ended"))
    side.serve("/clear", "std_srvs/Empty", lambda _: failed)
    wait_until(lambda: any("/SS/" in each for each in node.tokens()))
    assert called(node, key, b"", attachment(1, 1, GID)).err.payload.to_bytes() == b"it has ended"


# --- a network that is slow: here a session whose methods wait


class SlowNode:
    """A node whose session sends nothing before ``released`` is set; ``threads`` are the blocked ones."""

    def __init__(self) -> None:
        self.released = threading.Event()
        self.threads: queue.Queue[threading.Thread] = queue.Queue()
        self.deliver: Any = None
        self.zenoh = zenoh
        token = SimpleNamespace(undeclare=lambda: None)
        self.session = SimpleNamespace(
            liveliness=lambda: SimpleNamespace(declare_token=lambda _: token),
            declare_queryable=self.declare_queryable,
            get=self.wait,
        )

    def declare_queryable(self, _: str, handler: Any, **__: object) -> Any:
        self.deliver = handler
        return SimpleNamespace(undeclare=lambda: None)

    def handler(self, function: Any, _: object = None) -> Any:
        return function

    def wait(self, *_: object, **__: object) -> None:
        self.threads.put(threading.current_thread())
        assert self.released.wait(LIMIT)


def end_of(kind: Kind) -> Entity:
    return Entity("0", "f00", 1, kind, "bridge", "/", "/clear", "std_srvs/srv/Empty", "RIHS01_00")


def test_the_caller_does_not_wait_for_a_slow_network() -> None:
    node: Any = SlowNode()
    node.released.set()
    client = ZenohClient(node, end_of(Kind.CLIENT))
    client.call(b"one")
    assert node.threads.get(timeout=LIMIT) is not threading.current_thread()
    client.close()
    with pytest.raises(BridgeError, match=r"no longer calls service \[/clear\]"):
        client.call(b"two").result(LIMIT)


def test_responses_that_wait_for_a_slow_network_count_as_under_way() -> None:
    node: Any = SlowNode()
    refused: queue.Queue[bytes] = queue.Queue()
    answered: Future[bytes] = Future()
    answered.set_result(b"")

    def query() -> Any:
        sent = SimpleNamespace(to_bytes=lambda: attachment(1, 1, GID))
        return SimpleNamespace(payload=Payload(), attachment=sent, reply=node.wait, reply_err=refused.put,
                               drop=lambda: None)  # fmt: skip

    server = ZenohServer(node, end_of(Kind.SERVICE), {}, lambda _: answered)
    for _ in range(MAX_UNDER_WAY):
        node.deliver(query())
    assert refused.empty()
    node.deliver(query())
    assert refused.get(timeout=LIMIT) == b"the bridge is answering 200 other requests"

    node.released.set()
    for _ in range(MAX_UNDER_WAY):
        node.threads.get(timeout=LIMIT)
    server.close()


def test_a_request_is_refused_once_the_loop_has_ended() -> None:
    node: Any = SlowNode()
    refused: queue.Queue[bytes] = queue.Queue()

    def answer(_: bytes) -> Future[bytes]:
        raise RuntimeError("Event loop is closed")

    server = ZenohServer(node, end_of(Kind.SERVICE), {}, answer)
    sent = SimpleNamespace(to_bytes=lambda: attachment(1, 1, GID))
    for _ in range(MAX_UNDER_WAY + 1):
        node.deliver(
            SimpleNamespace(payload=Payload(), attachment=sent, reply_err=refused.put, drop=lambda: None)
        )
        assert refused.get(timeout=LIMIT) == b"the bridge has ended"
    server.close()


class Payload:
    def __len__(self) -> int:
        return 0

    def to_bytes(self) -> bytes:
        return b""


# --- what goes wrong


@pytest.mark.parametrize("domain_id", ["*", "1/2", "one", "-1", "1" * 10])
def test_a_domain_that_is_not_a_number_is_refused(domain_id: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", domain_id)
    with pytest.raises(BridgeError) as caught:
        ZenohNode("bridge", NetworkOptions((f"tcp/127.0.0.1:{free_port()}",)))
    assert str(caught.value) == f"ROS_DOMAIN_ID is [{domain_id}]: it must be a number, such as 0"


@pytest.mark.timeout(LIMIT)
def test_a_domain_that_is_not_a_number_is_refused_without_a_master(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{free_port()}")
    monkeypatch.setenv("ROS_DOMAIN_ID", "one")
    assert main(["--zenoh"]) == 1
    text = capsys.readouterr().err
    assert text.endswith("ROS_DOMAIN_ID is [one]: it must be a number, such as 0\n")
    assert text.count("\n") == 1


def test_a_domain_has_no_zeros_in_front(endpoint: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "007")
    node = ZenohNode("bridge", NetworkOptions((endpoint,)))
    node.close()
    assert node.domain == "7"


def test_without_a_router_one_line_says_what_to_start(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.zenoh.library.CONNECT_MS", 50)
    where = f"tcp/127.0.0.1:{free_port()}"
    with pytest.raises(BridgeError) as caught:
        ZenohNode("bridge", NetworkOptions((where,)))
    text = str(caught.value)
    assert text.startswith(f"no router of Zenoh answers at {where} (")
    assert text.endswith("`zenohd` or `minirospy fleet router` there, or give --connect")
    assert "\n" not in text


def test_without_the_library_one_line_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "zenoh.ext", None)
    assert main(["--zenoh"]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert install_command("minirospy[fleet]", upgrade=True) in error


def test_missing_hash_library_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "xxhash", None)
    assert main(["--zenoh"]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "needs the library xxhash: " in error
    assert install_command("minirospy[fleet]", upgrade=True) in error


@pytest.mark.parametrize("version", ["0.11.0", "1.3.9", "2.0.0"])
def test_a_library_of_another_protocol_is_refused(
    version: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(importlib.metadata, "version", lambda _: version)
    assert main(["--zenoh"]) == 1
    command = install_command("minirospy[fleet]", upgrade=True)
    assert (
        f"eclipse-zenoh of version 1.5 or newer below 2, not {version}: {command}" in capsys.readouterr().err
    )


def test_a_configuration_that_is_missing_is_named_with_its_variable(tmp_path: Any) -> None:
    options = NetworkOptions(config=str(tmp_path / "none"), source="ZENOH_SESSION_CONFIG_URI")
    with pytest.raises(BridgeError, match=r"^ZENOH_SESSION_CONFIG_URI .*none: there is no such file"):
        ZenohNode("bridge", options)


def test_the_configuration_of_rmw_zenoh_is_used(endpoint: str, tmp_path: Any) -> None:
    file = tmp_path / "session.json5"
    file.write_text(json.dumps({"mode": "client", "connect": {"endpoints": [endpoint]}}))
    node = ZenohNode("bridge", NetworkOptions(config=str(file)))
    node.close()


@pytest.mark.parametrize(
    "words", [["--connect", "robot"], ["--connect", "127.0.0.1", "--connect", "tcp/1.2.3.4:7447"]]
)
def test_nothing_leaves_a_machine_that_is_kept_local(
    words: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("MINIROSPY_LOCAL", "1")
    assert main(["--zenoh", *words]) == 2
    assert "MINIROSPY_LOCAL=1 keeps all on this machine" in capsys.readouterr().err


def test_connect_without_zenoh_is_a_usage_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--connect", "robot"]) == 2
    assert "--connect is for --zenoh" in capsys.readouterr().err
