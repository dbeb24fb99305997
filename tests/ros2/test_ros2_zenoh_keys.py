"""rmw_zenoh's keys, tokens and attachments, and the hashes of types: golden values, compared with rosbags."""

from __future__ import annotations

import pytest
from rosbags.typesys import Stores, get_typestore

from minirospy.core.idl.type_hash import type_hash
from minirospy.ros2.definitions import Definitions
from minirospy.ros2.layouts import TypesDiffer
from minirospy.ros2.rules import BUILT_IN, parse_rules
from minirospy.ros2.zenoh_keys import (
    Entity,
    Kind,
    Qos,
    attachment,
    data_key,
    format_token,
    gid_of,
    parse_token,
    reply_attachment,
    xxh3_128,
)
from minirospy.ros2.zenoh_node import Graph
from tests.ros2.ros2_definitions import catalogue

STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
SESSION = "aac3178e146ba6f1fc6e6a4085e77f21"
NODE = f"@ros2_lv/0/{SESSION}/0/0/NN/%/%/listener"
# This is the example in rmw_zenoh's docs/design.md.
LISTENER = f"@ros2_lv/2/{SESSION}/0/10/MS/%/%/listener/%chatter/std_msgs::msg::dds_::String_/{STRING_HASH}/::,10:,:,:,,"

# These hashes are from the .json files next to the definitions in real ROS 2 Kilted.
HASHES = {
    "std_msgs/Char": "RIHS01_3ad2d04dd29ba19d04b16659afa3ccaedd691914b02a64e82e252f2fa6a586a9",
}
SERVICE_HASHES = {
    "std_srvs/Empty": "RIHS01_5888399dedec5ccc85ea6451949fd2c9f97bfdf963f9a588821639fcd31b5d19",
    "std_srvs/Trigger": "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f",
    "std_srvs/SetBool": "RIHS01_abe9e4bb6b41b40e6789712c00ec8871923e089af3f667a79992a428cff2da0a",
    "nav_msgs/GetMap": "RIHS01_c8ae77c9995b3554b5ba80e4d4d443f970ac65143102a1d893ec24fc07b31147",
    "sensor_msgs/SetCameraInfo": "RIHS01_a10cca5d33dc637c8d49db50ab288701a3592bb9cd854f2f16a0659613b68984",
    "rcl_interfaces/DescribeParameters": "RIHS01_845b484d71eb0673dae682f2e3ba3c4851a65a3dcfb97bddd82c5b57e91e4cff",
    "rcl_interfaces/GetParameters": "RIHS01_bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc",
    "rcl_interfaces/GetParameterTypes": "RIHS01_da199c878688b3e530bdfe3ca8f74cb9fa0c303101e980a9e8f260e25e1c80ca",
    "rcl_interfaces/ListParameters": "RIHS01_3e6062bfbb27bfb8730d4cef2558221f51a11646d78e7bb30a1e83afac3aad9d",
    "rcl_interfaces/SetParameters": "RIHS01_56eed9a67e169f9cb6c1f987bc88f868c14a8fc9f743a263bc734c154015d7e0",
    "rcl_interfaces/SetParametersAtomically": "RIHS01_0e192ef259c07fc3c07a13191d27002222e65e00ccec653ca05e856f79285fcd",
    "action_msgs/CancelGoal": "RIHS01_573d8b0a534451d7bc2ac8c5ffde8ac14b8593b7001175d0cd6516dcbeb8689a",
}
ACTION_HASHES = {
    "send_goal": "RIHS01_d807633803e38e164276573cd97e9fbd71e109c290bbf4cc312a0a1c9da7bbd9",
    "get_result": "RIHS01_5d30fdeb21d20e117aa5f36c7b4f0b6874f1a8cf7a9c038d58f1156c5737b209",
    "feedback": "RIHS01_37487bae8cea358366b97003c1ef1ca7ce7c08df36f9e8cca496624226aee64e",
    "cancel_goal": "RIHS01_573d8b0a534451d7bc2ac8c5ffde8ac14b8593b7001175d0cd6516dcbeb8689a",
    "status": "RIHS01_6c1684b00f177d37438febe6e709fc4e2b0d4248dca4854946f9ed8b30cda83e",
}
"""Hashes for the endpoints of an action with the type test_msgs/Fibonacci."""
RULES = """
- ros1_package_name: turtlesim
  ros1_message_name: Color
  ros2_package_name: own_msgs
  ros2_message_name: Color
  fields_1_to_2: {r: red, b: blue}
"""


def definitions() -> Definitions:
    return Definitions(BUILT_IN.with_(parse_rules(RULES, "rules")), catalogue())


# --- tokens and keys


def test_tokens_are_those_of_rmw_zenoh() -> None:
    listener = Entity(
        "2", SESSION, 10, Kind.SUBSCRIPTION, "listener", "/", "/chatter", "std_msgs/String", STRING_HASH
    )
    assert format_token(listener) == LISTENER
    assert parse_token(LISTENER) == listener
    assert listener.key == f"2/chatter/std_msgs::msg::dds_::String_/{STRING_HASH}"
    node = Entity("0", SESSION, 0, Kind.NODE, "listener")
    assert format_token(node) == NODE
    assert parse_token(NODE) == node


def test_tokens_of_namespaces_and_services_are_read_back() -> None:
    client = Entity(
        "0", "a1", 3, Kind.CLIENT, "arm", "/robot/one", "/robot/one/move", "arm_msgs/srv/Move", STRING_HASH
    )  # fmt: skip
    token = format_token(client)
    assert "/3/SC/%/%robot%one/arm/%robot%one%move/arm_msgs::srv::dds_::Move_/" in token
    assert parse_token(token) == client
    assert client.short_type == "arm_msgs/Move"
    # Newer versions of rmw_zenoh append a part for GPU buffers.
    assert parse_token(token + "/cuda") == client


@pytest.mark.parametrize(
    ("text", "qos"),
    [
        ("::,10:,:,:,,", Qos()),
        ("2::,5:,:,:,,", Qos(is_reliable=False, depth=5)),
        (":1:,1:,:,:,,", Qos(is_transient_local=True, depth=1)),
        ("::,:,:,:,,", Qos(depth=42)),
        ("1:2:2,7:1,0:2,0:1,3,4", Qos(depth=7)),
    ],
)
def test_quality_of_service_is_the_text_of_a_token(text: str, qos: Qos) -> None:
    found = parse_token(LISTENER.replace("::,10:,:,:,,", text))
    assert found
    assert found.qos == qos
    if not text.startswith("1"):
        assert str(qos) == text


@pytest.mark.parametrize(
    "key",
    [
        "", "@ros2_lv", NODE.replace("/NN/", "/XX/"), NODE.replace("@ros2_lv", "other"), LISTENER.rpartition("/")[0],
        LISTENER.replace("%chatter", "chatter"), LISTENER.replace("%chatter", "%a%%b"),
        LISTENER.replace("%chatter", "%<script>"), LISTENER.replace("String_", "String"), LISTENER.replace("::,10", ","),
        LISTENER.replace("RIHS01", "RIHS02"), LISTENER.replace("/10/", "/x/"), LISTENER.replace("/10/", f"/{'9' * 5000}/"),
        LISTENER.replace("%chatter", "%" + "a" * 5000),
    ],
)  # fmt: skip
def test_tokens_that_are_none_are_ignored(key: str) -> None:
    assert parse_token(key) is None
    graph = Graph()
    graph.set(key, True)
    assert not graph.nodes()
    assert not graph.ends(*Kind)


def test_the_graph_follows_tokens_but_those_of_its_own_session() -> None:
    graph = Graph("own")
    other = LISTENER.replace("/10/", "/11/").replace("/MS/", "/MP/")
    for key in (NODE, LISTENER, LISTENER, other, LISTENER.replace(SESSION, "own")):
        graph.set(key, True)
    assert [each.node for each in graph.nodes()] == ["listener"]
    assert [each.id for each in graph.of_name("/chatter", Kind.SUBSCRIPTION)] == [10]
    assert [each.id for each in graph.ends(Kind.SUBSCRIPTION, Kind.PUBLISHER)] == [10, 11]
    for key in (LISTENER, LISTENER, other, NODE):
        graph.set(key, False)
    assert not graph.ends(*Kind)
    assert not graph.nodes()


# --- attachments and ids


def test_attachments_are_two_numbers_and_an_id() -> None:
    gid = bytes(range(16))
    data = bytes.fromhex("0700000000000000 0008000000000000 10") + gid
    assert attachment(7, 2048, gid) == data
    assert reply_attachment(data, 4096) == bytes.fromhex("0700000000000000 0010000000000000 10") + gid
    without_length = data[:16] + gid
    assert reply_attachment(without_length, 4096)[16:] == gid
    for other in (b"", data[:-2], data + b"\0"):
        with pytest.raises(ValueError, match="not an attachment of rmw_zenoh"):
            reply_attachment(other, 1)


@pytest.mark.parametrize(
    ("size", "digest"),
    [
        (17, "179272f73d236ec07f057db358c45b68"), (32, "97d6fcb666957d45d2ee4c42b3c9e725"),
        (33, "86de391395848de03706b0ab3a5c1702"), (100, "1ec03ef0a50bb229f36695fd16ef95da"),
        (128, "417bd6640b1a32056cdc88afc32f7914"), (129, "3b9ab08233b630bc4ef5456bac745edd"),
        (160, "f4091bc313cd7fc685bbc76dcdc1954e"), (161, "77838fa5cee0ad36a0b7172ca25a8090"),
        (240, "b6bb836fe1682bc9e74055da86beb565"), (241, "026d1c4295cde802a1a2b8bc61cba11d"),
        (300, "bc1d02cf6769dafdfc06b6fb77868c94"), (1025, "6e18288f28425ce95c91ec04caeb8228"),
        (3000, "aa242c014767841b27fba92fe7b924d3"),
    ],
)  # fmt: skip
def test_hash_is_that_of_rmw_zenoh(size: int, digest: str) -> None:
    assert xxh3_128(bytes(each % 251 for each in range(size))).hex() == digest


def test_ids_are_made_of_tokens() -> None:
    # This was computed with xxhash 4.1.0, as in pyzeros.
    assert gid_of(LISTENER).hex() == "76148a538308fe55a6c5375462ca1de6"


def test_keys_of_topics_have_no_slash_at_the_ends() -> None:
    key = data_key("0", "/a/b", "tf2_msgs/TFMessage", "TypeHashNotSupported")
    assert key == "0/a/b/tf2_msgs::msg::dds_::TFMessage_/TypeHashNotSupported"


# --- hashes


def test_hashes_are_those_of_rosbags() -> None:
    found = definitions()
    compared = 0
    for store in map(get_typestore, (Stores.ROS2_JAZZY, Stores.ROS2_KILTED)):
        for package in catalogue().packages:
            for spec in catalogue().messages(package):
                name = BUILT_IN.ros2_messages(spec.full_name)[0]
                # rosbags treats char as a number, which ROS 2 maps to uint8; see below.
                if (whole := name.replace("/", "/msg/")) in store.fielddefs and name != "std_msgs/Char":
                    assert found.hash(name) == store.hash_rihs01(whole), name
                    compared += 1
    assert compared > 200


def test_hashes_are_those_of_real_ros2() -> None:
    found = definitions()
    for name, digest in HASHES.items():
        assert found.hash(name) == digest, name
    for name, digest in SERVICE_HASHES.items():
        assert found.hash(name.replace("/", "/srv/")) == digest, name


def test_hashes_of_actions_are_those_of_real_ros2() -> None:
    renamed = "- {ros1_package_name: actionlib_tutorials, ros1_action_name: Fibonacci, ros2_package_name: test_msgs, "
    rules = parse_rules(renamed + "ros2_action_name: Fibonacci}", "rules")
    found = Definitions(BUILT_IN.with_(rules), catalogue())
    parts = {"send_goal": "SendGoal", "get_result": "GetResult", "feedback": "FeedbackMessage"}
    for name, part in parts.items():
        assert found.hash(f"test_msgs/action/Fibonacci_{part}") == ACTION_HASHES[name], part
    assert found.hash("action_msgs/GoalStatusArray") == ACTION_HASHES["status"]
    assert found.action("test_msgs/Fibonacci")[0] == {"order": "int32"}
    with pytest.raises(TypesDiffer, match=r"the action type \[test_msgs/Other\] is not defined here"):
        found.hash("test_msgs/action/Other_SendGoal")


def test_a_field_of_a_type_that_messages_lack_has_no_hash() -> None:
    with pytest.raises(ValueError, match=r"no type \[wstring\]"):
        type_hash("a/B", lambda _: {"text": "wstring"})


# --- definitions


def test_definitions_follow_the_rules() -> None:
    found = definitions()
    assert found.message("std_msgs/Header") == {"stamp": "builtin_interfaces/Time", "frame_id": "string"}
    assert found.message("own_msgs/Color") == {"red": "uint8", "blue": "uint8"}
    assert list(found.message("sensor_msgs/CameraInfo"))[4:8] == ["d", "k", "r", "p"]
    assert "variance" in found.message("sensor_msgs/Range")
    assert "variance" not in found.message("sensor_msgs/Range", is_humble=True)


@pytest.mark.parametrize("kind", ["message", "service"])
def test_a_type_without_a_definition_is_refused_with_the_reason(kind: str) -> None:
    with pytest.raises(TypesDiffer, match=r"\[none_msgs/None.*is not defined here: put its package on"):
        getattr(definitions(), kind)("none_msgs/None")
