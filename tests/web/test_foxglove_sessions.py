"""Clients of the Foxglove protocol with a bridge, with real sockets and nodes."""

from __future__ import annotations

import asyncio
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Bool, String
from std_srvs.srv import SetBool, SetBoolResponse

from minirospy import Node
from minirospy.aio.raw import raw_class
from minirospy.base.errors import BridgeError
from minirospy.base.name_filter import NameFilter
from minirospy.base.times import Time
from minirospy.core.idl.load import class_from_text, classes_from_text
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.introspect.type_texts import type_of_text
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.web.access import Access
from minirospy.web.foxglove.assets import Assets
from minirospy.web.graph import Filters
from minirospy.workspace.packages import Packages
from tests.conftest import write_files
from tests.waiting import until

if TYPE_CHECKING:
    from tests.web.conftest import Running


def text_of(frame: bytes) -> tuple[int, str]:
    """Return the subscription and the string in a message that contains a std_msgs/String."""
    opcode, subscription, _ = struct.unpack_from("<BIQ", frame)
    assert opcode == 1
    (length,) = struct.unpack_from("<I", frame, 13)
    return subscription, frame[17 : 17 + length].decode()


def test_client_is_offered_channels_and_gets_bytes_of_ros(bridge: Running) -> None:
    talker = bridge.node("talker")
    publisher = bridge.publisher(talker, "/chatter", String, latch=True)
    bridge.run(publisher.publish("hello"))
    client = bridge.client()

    info = client.next("serverInfo")
    assert info["supportedEncodings"] == ["ros1"]
    assert info["metadata"] == {"ROS_DISTRO": "noetic", "node": "/bridge"}
    client.subscribe("/chatter", 7)
    assert client.channels["/chatter"] == {
        "id": client.channel("/chatter"),
        "topic": "/chatter",
        "encoding": "ros1",
        "schemaName": "std_msgs/String",
        "schema": String._full_text,
        "schemaEncoding": "ros1msg",
    }
    assert text_of(client.next_binary(1)) == (7, "hello")


def test_late_subscription_gets_every_latched_publishers_message(bridge: Running) -> None:
    for number in range(3):
        publisher = bridge.publisher(bridge.node(f"n{number}"), "/tf_static", String, latch=True)
        bridge.run(publisher.publish(f"frame {number}"))
    for subscription in (1, 2):
        client = bridge.client()
        client.subscribe("/tf_static", subscription)
        texts = {text_of(client.next_binary(1))[1] for _ in range(3)}
        assert texts == {"frame 0", "frame 1", "frame 2"}
    assert len(bridge.bridge.graph.topics) == 1


def test_topics_come_and_go(bridge: Running) -> None:
    client = bridge.client()
    client.next("advertise")
    talker = bridge.node("talker")
    publisher = bridge.publisher(talker, "/chatter", String)
    channel = client.channel("/chatter")
    client.subscribe("/chatter")
    bridge.run(publisher.close())
    assert channel in client.next("unadvertise")["channelIds"]
    bridge.publisher(talker, "/chatter", String)
    assert client.channel("/chatter") != channel


def test_client_publishes_to_ros(bridge: Running) -> None:
    listener = bridge.node("listener")

    async def subscribe() -> object:
        return await listener.subscribe("/from_client", String)

    messages = bridge.run(subscribe())
    client = bridge.client()
    channel = {"id": 5, "topic": "/from_client", "encoding": "ros1", "schemaName": "std_msgs/String"}
    client.send(op="advertise", channels=[channel])
    bridge.run(messages.wait_for_publishers())  # type: ignore[attr-defined]
    client.send_binary(struct.pack("<BII", 1, 5, 2) + b"hi")
    assert bridge.run(messages.next()).data == "hi"  # type: ignore[attr-defined]


def test_first_message_of_a_client_reaches_those_that_subscribe_already(bridge: Running) -> None:
    listener = bridge.node("listener")

    async def subscribe() -> object:
        return await listener.subscribe("/from_client", String)

    messages = bridge.run(subscribe())
    client = bridge.client()
    channel = {"id": 5, "topic": "/from_client", "encoding": "ros1", "schemaName": "std_msgs/String"}
    client.send(op="advertise", channels=[channel])
    for number in range(3):
        client.send_binary(struct.pack("<BII", 1, 5, 1) + b"%d" % number)
    assert [bridge.run(messages.next()).data for _ in range(3)] == ["0", "1", "2"]  # type: ignore[attr-defined]


def test_client_calls_a_service(bridge: Running) -> None:
    server = bridge.node("server")

    async def serve() -> None:
        await server.serve("/set", SetBool, lambda request: SetBoolResponse(request.data, "done"))

    bridge.run(serve())
    client = bridge.client()
    service = client.service("/set")
    client.send_binary(struct.pack("<BIII", 2, service, 9, 4) + b"ros1" + b"\x01")
    frame = client.next_binary(3)
    assert (
        frame == struct.pack("<BIII", 3, service, 9, 4) + b"ros1" + b"\x01" + struct.pack("<I", 4) + b"done"
    )


def test_client_gets_the_reason_of_a_failed_call(bridge: Running) -> None:
    server = bridge.node("server")

    def refuse(_: object) -> SetBoolResponse:
        raise ValueError("not today")

    async def serve() -> None:
        await server.serve("/set", SetBool, refuse)

    bridge.run(serve())
    client = bridge.client()
    service = client.service("/set")
    for id_, encoding, call in ((service, b"ros1", 1), (service, b"json", 2), (999, b"ros1", 3)):
        client.send_binary(struct.pack("<BIII", 2, id_, call, 4) + encoding + b"\x01")
    failures = {
        each["callId"]: each["message"] for each in (client.next("serviceCallFailure") for _ in range(3))
    }
    assert "not today" in failures[1]
    assert "Only 'ros1' encoding is supported" in failures[2]
    assert failures[3] == "Service with id 999 does not exist"


def test_wrong_requests_get_a_status_and_the_client_lives_on(bridge: Running) -> None:
    client = bridge.client()
    client.next("advertise")
    client.socket.send("nonsense")
    client.send(op="subscribe", subscriptions=[{"id": 1, "channelId": 4711}])
    client.send(op="unsubscribe", subscriptionIds=[5])
    client.send_binary(struct.pack("<BI", 1, 5) + b"x")
    client.send_binary(b"\x63")
    wrong = {"id": 1, "topic": "/t", "encoding": "json", "schemaName": "std_msgs/String"}
    client.send(op="advertise", channels=[wrong])
    unknown = {"id": 1, "topic": "/t", "encoding": "ros1", "schemaName": "no_such_msgs/Type"}
    client.send(op="advertise", channels=[unknown])
    texts = [client.next("status")["message"] for _ in range(7)]
    for text, part in zip(
        texts,
        (
            "not JSON",
            "Channel 4711 is not available",
            "id 5 did not exist",
            "Channel 5 is not advertised",
            "Unrecognized client opcode 99",
            "Only 'ros1' encoding",
            "Failed to retrieve type information of data type 'no_such_msgs/Type'",
        ),
        strict=True,
    ):
        assert part in text
    client.send(op="getParameters", parameterNames=[], id="alive")
    assert client.next("parameterValues")["id"] == "alive"


def test_type_that_is_not_installed_is_read_from_its_publisher(bridge: Running) -> None:
    made = raw_class(InterfaceType("my_msgs/Odd", "0" * 32, "int32 x\n"))
    publisher = bridge.publisher(bridge.node("odd"), "/odd", made, latch=True)
    bridge.call(lambda: publisher.publish_raw(struct.pack("<i", 5)))
    client = bridge.client()
    client.subscribe("/odd")
    assert client.channels["/odd"]["schemaName"] == "my_msgs/Odd"
    assert client.channels["/odd"]["schema"] == "int32 x\n"
    assert client.next_binary(1)[13:] == struct.pack("<i", 5)


def test_definition_that_differs_replaces_the_channel(bridge: Running) -> None:
    """The publisher's definition differs from the installed std_msgs/String."""
    made = raw_class(InterfaceType("std_msgs/String", "1" * 32, "int32 x\n"))
    publisher = bridge.publisher(bridge.node("odd"), "/odd", made, latch=True)
    bridge.call(lambda: publisher.publish_raw(struct.pack("<i", 5)))
    client = bridge.client()
    first = client.channel("/odd")
    client.subscribe("/odd")
    assert client.next("unadvertise")["channelIds"] == [first]
    client.subscribe("/odd")
    assert client.channels["/odd"]["schema"] == "int32 x\n"
    assert client.next_binary(1)[13:] == struct.pack("<i", 5)


def test_topic_of_another_type_becomes_another_channel(bridge: Running) -> None:
    node = bridge.node("changing")
    publisher = bridge.publisher(node, "/changing", String)
    client = bridge.client()
    first = client.channel("/changing")
    bridge.run(publisher.close())
    publisher = bridge.publisher(node, "/changing", Bool, latch=True)
    bridge.run(publisher.publish(True))
    assert first in client.next("unadvertise")["channelIds"]
    client.subscribe("/changing")
    assert client.channels["/changing"]["schemaName"] == "std_msgs/Bool"
    assert client.next_binary(1)[13:] == b"\x01"


def test_parameters_are_read_set_and_deleted(bridge: Running) -> None:
    client = bridge.client()
    values = [
        {"name": "/i", "value": 3},
        {"name": "/f", "value": 3, "type": "float64"},
        {"name": "/b", "value": "QUJD", "type": "byte_array"},
        {"name": "/d", "value": {"x": [1, 2.5, "s", True]}},
        {"name": "/n/deep", "value": "text"},
    ]
    client.send(op="setParameters", parameters=values, id="set")
    answer = client.next("parameterValues", lambda each: each.get("id") == "set")
    expected = [dict(each) for each in values]
    assert answer["parameters"] == expected

    client.send(op="setParameters", parameters=[{"name": "/i"}], id="deleted")
    assert client.next("parameterValues", lambda each: each.get("id") == "deleted")["parameters"] == []
    client.send(op="getParameters", parameterNames=["/i", "/f"], id="some")
    assert "Failed to retrieve the following parameters: /i" in client.next("status")["message"]
    found = client.next("parameterValues", lambda each: each.get("id") == "some")["parameters"]
    assert found == [{"name": "/f", "value": 3.0, "type": "float64"}]
    client.send(op="getParameters", parameterNames=[], id="all")
    names = [
        each["name"] for each in client.next("parameterValues", lambda e: e.get("id") == "all")["parameters"]
    ]
    assert {"/f", "/b", "/d/x", "/n/deep"} <= set(names)
    assert "/i" not in names
    client.send(op="setParameters", parameters=[{"name": "/huge", "value": 1 << 40}])
    assert "Failed to set parameter '/huge'" in client.next("status")["message"]


def test_changes_of_parameters_reach_subscribers(bridge: Running) -> None:
    node = bridge.node("setter")
    bridge.run(node.set_param("/a", 1))
    bridge.run(node.set_param("/ns", {"x": 1, "y": 2}))
    client, everything = bridge.client(), bridge.client()
    client.send(op="subscribeParameterUpdates", parameterNames=["/a", "/ns/x", "/ns"])
    everything.send(op="subscribeParameterUpdates", parameterNames=[])
    for each in (client, everything):
        each.send(op="getParameters", parameterNames=["/a"], id="there")
        each.next("parameterValues", lambda message: message.get("id") == "there")

    async def watched() -> None:
        await until(lambda: "/" in bridge.bridge.node._node.parameters)

    bridge.run(watched())
    bridge.run(node.set_param("/a", 2))
    assert client.next("parameterValues")["parameters"] == [{"name": "/a", "value": 2}]
    assert everything.next("parameterValues")["parameters"] == [{"name": "/a", "value": 2}]
    bridge.run(node.set_param("/ns/x", 5))
    found = [each for _ in range(2) for each in client.next("parameterValues")["parameters"]]
    assert {"name": "/ns/x", "value": 5} in found
    assert {"name": "/ns", "value": {"x": 5, "y": 2}} in found
    bridge.run(node.delete_param("/a"))
    assert client.next("parameterValues")["parameters"] == [{"name": "/a"}]
    assert everything.next("parameterValues")["parameters"] == [{"name": "/ns/x", "value": 5}]
    assert everything.next("parameterValues")["parameters"] == [{"name": "/a"}]
    client.send(op="unsubscribeParameterUpdates", parameterNames=["/a", "/ns", "/ns/x"])
    # The response to it shows that the bridge has read the earlier messages.
    client.send(op="getParameters", parameterNames=["/a"], id="unsubscribed")
    client.next("parameterValues", lambda message: message.get("id") == "unsubscribed")
    everything.close()
    bridge.run(node.set_param("/a", 3))
    client.send(op="getParameters", parameterNames=["/a"], id="last")
    assert client.next("parameterValues").get("id") == "last"


def test_graph_and_its_changes_are_reported(bridge: Running) -> None:
    talker = bridge.node("talker")
    publisher = bridge.publisher(talker, "/chatter", String)
    client = bridge.client()
    client.channel("/chatter")
    client.send(op="subscribeConnectionGraph")
    whole = client.next("connectionGraphUpdate")
    assert {"name": "/chatter", "publisherIds": ["/talker"]} in whole["publishedTopics"]
    client.subscribe("/chatter")
    change = client.next("connectionGraphUpdate", lambda each: bool(each["subscribedTopics"]))
    assert {"name": "/chatter", "subscriberIds": ["/bridge"]} in change["subscribedTopics"]
    bridge.run(publisher.close())
    change = client.next(
        "connectionGraphUpdate", lambda each: bool(each["publishedTopics"] or each["removedTopics"])
    )
    assert {"name": "/chatter", "publisherIds": []} in change["publishedTopics"] or "/chatter" in change[
        "removedTopics"
    ]
    client.send(op="unsubscribeConnectionGraph")
    client.send(op="unsubscribeConnectionGraph")
    assert "not subscribed" in client.next("status")["message"]


def test_assets_are_read_from_known_packages_alone(
    run_bridge: Callable[..., Running], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "src" / "arm"
    files = {
        "package.xml": "<package><name>arm</name></package>",
        "meshes/a b.stl": "solid",
        "run.sh": "secret",
    }
    write_files(package, files)
    (tmp_path / "secret.stl").write_text("secret")
    if sys.platform != "win32":
        (package / "meshes" / "link.stl").symlink_to(tmp_path / "secret.stl")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    client = run_bridge().client()
    client.send(op="fetchAsset", uri="package://arm/meshes/a%20b.stl", requestId=1)
    assert client.next_binary(4) == struct.pack("<BIBI", 4, 1, 0, 0) + b"solid"
    # What xacro makes of file://$(find arm)/meshes.
    client.send(op="fetchAsset", uri=(package / "meshes" / "a b.stl").as_uri(), requestId=2)
    assert client.next_binary(4) == struct.pack("<BIBI", 4, 2, 0, 0) + b"solid"
    for number, uri in enumerate(
        (
            "package://arm/../secret.stl",
            "package://arm/%2e%2e/%2e%2e/secret.stl",
            "package://arm/meshes/link.stl",
            "package://arm/run.sh",
            "package://arm/none.stl",
            "package://no_such_package/a.stl",
            "file:///etc/passwd",
            (tmp_path / "secret.stl").as_uri(),
            (package / "meshes" / "link.stl").as_uri(),
            (package / "run.sh").as_uri(),
            f"{package.as_uri()}/../../secret.stl",
            f"{package.as_uri()}/%2e%2e/%2e%2e/secret.stl",
            "file://arm/meshes/a.stl",
            "file://",
            "file:///a%00b/c.stl",
            "file:///a\ud800/c.stl",
            f"{package.as_uri()}/a\ud800.stl",
            "package://a%00/b.stl",
            "https://example.org/a.stl",
            "https://example.org/\ud800.stl",
        )
    ):
        client.send(op="fetchAsset", uri=uri, requestId=number)
        frame = client.next_binary(4)
        assert struct.unpack_from("<BIB", frame) == (4, number, 1), uri
        assert b"secret\n" not in frame


@pytest.mark.parametrize("uri", ["file:///%5C%5Chost%5Cshare%5Cd%5Cm.stl", "file:///a%00b/c.stl"])
def test_asset_is_refused_before_its_folder_is_read(uri: str, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[Path] = []
    monkeypatch.setattr("minirospy.web.foxglove.assets.package_name", read.append)
    with pytest.raises(BridgeError, match="not allowed"):
        Assets(Packages()).open(uri)
    assert read == []


def test_asset_uri_without_a_package_is_refused_with_the_reason() -> None:
    with pytest.raises(
        BridgeError, match=r"^package:///arm/a.stl: the name of the package is missing before the path$"
    ):
        Assets(Packages()).open("package:///arm/a.stl")


def test_asset_larger_than_the_queue_limit_is_sent(
    run_bridge: Callable[..., Running], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_files(tmp_path / "arm", {"package.xml": "<package><name>arm</name></package>"})
    with (tmp_path / "arm" / "a.stl").open("wb") as file:
        file.truncate(70_000_000)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    client = run_bridge().client()
    client.send(op="fetchAsset", uri="package://arm/a.stl", requestId=1)
    assert len(client.next_binary(4)) == 10 + 70_000_000


def test_subscriptions_of_a_client_are_limited(bridge: Running) -> None:
    bridge.publisher(bridge.node("talker"), "/chatter", String)
    client = bridge.client()
    channel = client.channel("/chatter")
    client.send(op="subscribe", subscriptions=[{"id": id_, "channelId": channel} for id_ in range(1100)])
    assert client.next("status")["message"] == "a client may have 1000 subscriptions"
    names = [f"/p{number}" for number in range(6000)]
    client.send(op="subscribeParameterUpdates", parameterNames=names)
    client.send(op="subscribeParameterUpdates", parameterNames=[f"{name}/x" for name in names])
    assert "may subscribe to 10000 parameters" in client.next("status")["message"]


def test_type_of_a_client_is_known_without_a_class_of_it() -> None:
    text = "other_msgs/B b\nstd_msgs/String s\n" + "=" * 80 + "\nMSG: other_msgs/B\nint32 C=3\nfloat64[3] x\n"
    text += "=" * 80 + "\nMSG: std_msgs/String\nstring data\n"
    made = class_from_text("some_msgs/A", text)
    classes_from_text.cache_clear()
    assert type_of_text("some_msgs/A", text) == InterfaceType("some_msgs/A", made._md5sum, text)
    assert classes_from_text.cache_info().currsize == 0
    for wrong in ("other_msgs/B b", "int32 a b", "some_msgs/A a", "string S=\ud800\n"):
        assert type_of_text("some_msgs/A", wrong) is None, wrong


def test_asset_over_the_bound_is_refused(tmp_path: Path) -> None:
    write_files(tmp_path / "arm", {"package.xml": "<package><name>arm</name></package>", "a.stl": "12345"})
    assets = Assets(Packages.below(tmp_path), max_bytes=4)
    with pytest.raises(BridgeError, match="5 bytes, 4 are allowed"):
        assets.open("package://arm/a.stl")


def test_simulated_time_is_sent_and_stamps_messages(master: str, run_bridge: Callable[..., Running]) -> None:
    proxy = MasterProxy(master, "/test")
    proxy.call("setParam", "/use_sim_time", True)
    proxy.close()
    bridge = run_bridge()
    client = bridge.client()
    assert "time" in client.next("serverInfo")["capabilities"]
    clock = bridge.publisher(bridge.node("clock"), "/clock", Clock)

    async def tick() -> None:
        await clock.wait_for_subscribers()

        async def is_received() -> bool:
            await clock.publish(Time(5, 7))
            return bridge.bridge.node.now().secs == 5

        await until(is_received)

    bridge.run(tick())
    assert client.next_binary(2) == struct.pack("<BQ", 2, 5_000_000_007)
    publisher = bridge.publisher(bridge.node("talker"), "/chatter", String, latch=True)
    bridge.run(publisher.publish("x"))
    client.subscribe("/chatter")
    assert struct.unpack_from("<BIQ", client.next_binary(1)) == (1, 0, 5_000_000_007)


def test_restarted_publisher_is_connected_again(bridge: Running) -> None:
    """The restart occurs between two refreshes of the graph, and the client keeps its subscription."""
    node = bridge.node("talker")
    publisher = bridge.publisher(node, "/chatter", String, latch=True)
    bridge.run(publisher.publish("first"))
    client = bridge.client()
    client.subscribe("/chatter")
    assert text_of(client.next_binary(1))[1] == "first"

    async def restart() -> None:
        bridge.bridge.graph.max_refresh_interval = 1000.0
        await node.close()
        again = Node("talker", rosout=False)
        await again.start()
        bridge.nodes.append(again)
        second = await again.advertise("/chatter", String, latch=True)
        await second.publish("second")

    bridge.run(restart())
    while True:
        each = client.next_accepted(lambda each: isinstance(each, bytes) or each["op"] == "advertise")
        if isinstance(each, bytes):
            assert text_of(each)[1] == "second"
            break
        client.subscribe("/chatter")


def test_filters_hide_topics_services_and_parameters(run_bridge: Callable[..., Running]) -> None:
    bridge = run_bridge(
        filters=Filters(
            topics=NameFilter.of(["/open/*"]),
            publishable=NameFilter.of(["/in/*"]),
            services=NameFilter.of(deny=["*"]),
            parameters=NameFilter.of(deny=["/secret*"]),
        )
    )
    node = bridge.node("node")
    bridge.publisher(node, "/hidden", String)
    bridge.publisher(node, "/open/a", String)
    bridge.run(node.set_param("/secret", 1))
    client = bridge.client()
    client.channel("/open/a")
    assert "/hidden" not in client.channels
    assert client.next("advertiseServices")["services"] == []
    client.send(op="getParameters", parameterNames=["/secret"], id="x")
    assert client.next("parameterValues")["parameters"] == []
    client.send(op="setParameters", parameters=[{"name": "/secret", "value": 5}])
    client.next("status", lambda each: "may not be set" in each["message"])
    channel = {"id": 1, "topic": "/out", "encoding": "ros1", "schemaName": "std_msgs/String"}
    client.send(op="advertise", channels=[channel])
    client.next("status", lambda each: "may not be published" in each["message"])


def test_read_only_client_may_look_and_nothing_else(run_bridge: Callable[..., Running]) -> None:
    bridge = run_bridge(access=Access(read_token="r" * 20, write_token="w" * 20, requires_token=True))
    bridge.publisher(bridge.node("node"), "/t", String)
    client = bridge.client(path=f"/?token={'r' * 20}")
    capabilities = client.next("serverInfo")["capabilities"]
    assert "clientPublish" not in capabilities
    assert "services" not in capabilities
    client.subscribe("/t")
    channel = {"id": 1, "topic": "/out", "encoding": "ros1", "schemaName": "std_msgs/String"}
    client.send(op="advertise", channels=[channel])
    client.send(op="setParameters", parameters=[{"name": "/a", "value": 5}])
    client.send_binary(struct.pack("<BIII", 2, 1, 1, 4) + b"ros1")
    assert "read-only" in client.next("status")["message"]
    assert "read-only" in client.next("status")["message"]
    assert "read-only" in client.next("serviceCallFailure")["message"]
    assert "clientPublish" in bridge.client(path=f"/?token={'w' * 20}").next("serverInfo")["capabilities"]


def test_topic_subscribed_again_in_the_same_turn_goes_on(bridge: Running) -> None:
    publisher = bridge.publisher(bridge.node("talker"), "/again", String)
    graph = bridge.bridge.graph
    arrived = asyncio.Event()

    def first(_: object) -> None:
        """Discard the message."""

    def second(_: object) -> None:
        arrived.set()

    def exchange() -> None:
        graph.unsubscribe("/again", first)
        graph.subscribe("/again", second)

    async def wait() -> None:
        graph.subscribe("/again", first)
        await publisher.wait_for_subscribers()
        exchange()

        async def is_received() -> bool:
            await publisher.publish(String("x"))
            return arrived.is_set()

        await until(is_received)
        graph.unsubscribe("/again", second)

    bridge.run(asyncio.wait_for(wait(), 30))


def test_faults_of_one_message_are_reported_up_to_a_limit(bridge: Running) -> None:
    client = bridge.client()
    client.send(op="subscribe", subscriptions=[{"id": 1, "channelId": 999_999}] * 2000)
    client.send(op="getParameters", parameterNames=["/none"], id="behind")
    texts = []
    while (fields := client.next_accepted(lambda each: isinstance(each, dict)))["op"] != "parameterValues":  # type: ignore[call-overload]
        if fields["op"] == "status":  # type: ignore[call-overload]
            texts.append(fields["message"])  # type: ignore[call-overload]
    assert texts[:99] == ["Channel 999999 is not available; ignoring subscription 1"] * 99
    assert texts[99] == "further faults of this message are not reported"
    assert len(texts) < 102
    client.send(op="subscribe", subscriptions=[{"id": 1, "channelId": 999_999}])
    assert "is not available" in client.next("status")["message"]
