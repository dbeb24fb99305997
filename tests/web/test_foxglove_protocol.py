"""Frames of the Foxglove protocol, compared with its specification, and refused frames."""

from __future__ import annotations

import json
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.errors import BridgeProtocolError
from minirospy.web.foxglove import parsing, serializing
from minirospy.web.foxglove.protocol import (
    Channel,
    ClientAdvertise,
    ClientChannel,
    ClientMessage,
    ClientUnadvertise,
    FetchAsset,
    GetParameters,
    GraphTables,
    Parameter,
    PlaybackCommand,
    PlaybackControl,
    PlaybackState,
    PlaybackStatus,
    Schema,
    ServiceOffer,
    ServiceRequest,
    SetParameters,
    StatusLevel,
    Subscribe,
    SubscribeConnectionGraph,
    SubscribeParameterUpdates,
    Unsubscribe,
    UnsubscribeConnectionGraph,
    UnsubscribeParameterUpdates,
)

# The examples of the specification (docs/spec.md of foxglove/ws-protocol), with this server's encoding.
FROM_CLIENTS = [
    (
        '{"op": "subscribe", "subscriptions": [{"id": 0, "channelId": 3}, {"id": 1, "channelId": 5}]}',
        Subscribe(((0, 3), (1, 5))),
    ),
    ('{"op": "unsubscribe", "subscriptionIds": [0, 1]}', Unsubscribe((0, 1))),
    (
        '{"op": "advertise", "channels": [{"id": 1, "topic": "foo", "encoding": "ros1", "schemaName": "a/B"}]}',
        ClientAdvertise((ClientChannel(1, "foo", "ros1", Schema("a/B", "")),)),
    ),
    ('{"op": "unadvertise", "channelIds": [1, 2]}', ClientUnadvertise((1, 2))),
    (
        '{"op": "getParameters", "parameterNames": ["/int_param", "/float_param"], "id": "request-123"}',
        GetParameters(("/int_param", "/float_param"), "request-123"),
    ),
    ('{"op": "getParameters", "parameterNames": []}', GetParameters((), None)),
    (
        """{"op": "setParameters", "parameters": [
             {"name": "/int_param", "value": 3},
             {"name": "/float_param", "value": 4.1},
             {"name": "/byte_array_param", "value": "QUJDRA==", "type": "byte_array"},
             {"name": "/float_param_int", "value": 3, "type": "float64"},
             {"name": "/float_array_param", "value": [1.1, 2, 3.3], "type": "float64_array"},
             {"name": "/unset"}
           ], "id": "request-456"}""",
        SetParameters(
            (
                Parameter("/int_param", 3),
                Parameter("/float_param", 4.1),
                Parameter("/byte_array_param", b"ABCD"),
                Parameter("/float_param_int", 3.0),
                Parameter("/float_array_param", [1.1, 2.0, 3.3]),
                Parameter("/unset", is_set=False),
            ),
            "request-456",
        ),
    ),
    (
        '{"op": "subscribeParameterUpdates", "parameterNames": ["/int_param"]}',
        SubscribeParameterUpdates(("/int_param",)),
    ),
    (
        '{"op": "unsubscribeParameterUpdates", "parameterNames": ["/int_param"]}',
        UnsubscribeParameterUpdates(("/int_param",)),
    ),
    ('{"op": "subscribeConnectionGraph"}', SubscribeConnectionGraph()),
    ('{"op": "unsubscribeConnectionGraph"}', UnsubscribeConnectionGraph()),
    (
        '{"op": "fetchAsset", "uri": "package://foo/robot.urdf", "requestId": 123}',
        FetchAsset("package://foo/robot.urdf", 123),
    ),
]

TO_CLIENTS = [
    (
        serializing.server_info(
            "example server", ["clientPublish", "time"], {"key": "value"}, "1675789422160"
        ),
        """{"op": "serverInfo", "name": "example server", "capabilities": ["clientPublish", "time"],
            "supportedEncodings": ["ros1"], "metadata": {"key": "value"}, "sessionId": "1675789422160"}""",
    ),
    (
        serializing.server_info("bag", ["playbackControl"], {}, "1", (1_500_000_000, 2_000_000_001)),
        """{"op": "serverInfo", "name": "bag", "capabilities": ["playbackControl"], "supportedEncodings": ["ros1"],
            "metadata": {}, "sessionId": "1", "dataStartTime": {"sec": 1, "nsec": 500000000},
            "dataEndTime": {"sec": 2, "nsec": 1}}""",
    ),
    (
        serializing.status(StatusLevel.INFO, "Some info", "status-123"),
        '{"op": "status", "level": 0, "message": "Some info", "id": "status-123"}',
    ),
    (serializing.status(StatusLevel.ERROR, "x"), '{"op": "status", "level": 2, "message": "x"}'),
    (serializing.remove_status(["status-123"]), '{"op": "removeStatus", "statusIds": ["status-123"]}'),
    (
        serializing.advertise([Channel(1, "foo", Schema("a/B", "int8 x"))]),
        """{"op": "advertise", "channels": [{"id": 1, "topic": "foo", "encoding": "ros1", "schemaName": "a/B",
            "schema": "int8 x", "schemaEncoding": "ros1msg"}]}""",
    ),
    (serializing.unadvertise([1, 2]), '{"op": "unadvertise", "channelIds": [1, 2]}'),
    (
        serializing.parameter_values(
            [
                Parameter("/int_param", 2),
                Parameter("/float_param", 1.2),
                Parameter("/string_param", "foo"),
                Parameter("/node/nested_ints_param", [1, 2, 3]),
                Parameter("/byte_array_param", b"ABCD"),
                Parameter("/float_array_param", [1.1, 2.0, 3.3]),
                Parameter("/struct", {"a": {"b": True}}),
                Parameter("/unset", is_set=False),
            ],
            "request-123",
        ),
        """{"op": "parameterValues", "parameters": [
             {"name": "/int_param", "value": 2},
             {"name": "/float_param", "value": 1.2, "type": "float64"},
             {"name": "/string_param", "value": "foo"},
             {"name": "/node/nested_ints_param", "value": [1, 2, 3]},
             {"name": "/byte_array_param", "value": "QUJDRA==", "type": "byte_array"},
             {"name": "/float_array_param", "value": [1.1, 2, 3.3], "type": "float64_array"},
             {"name": "/struct", "value": {"a": {"b": true}}},
             {"name": "/unset"}
           ], "id": "request-123"}""",
    ),
    (
        serializing.advertise_services(
            [
                ServiceOffer(
                    2,
                    "set_bool",
                    "std_srvs/SetBool",
                    Schema("std_srvs/SetBoolRequest", "bool data"),
                    Schema("std_srvs/SetBoolResponse", "bool success\nstring message"),
                )
            ]
        ),
        r"""{"op": "advertiseServices", "services": [{"id": 2, "name": "set_bool", "type": "std_srvs/SetBool",
            "request": {"encoding": "ros1", "schemaName": "std_srvs/SetBoolRequest", "schemaEncoding": "ros1msg",
                        "schema": "bool data"},
            "response": {"encoding": "ros1", "schemaName": "std_srvs/SetBoolResponse", "schemaEncoding": "ros1msg",
                         "schema": "bool success\nstring message"},
            "requestSchema": "bool data", "responseSchema": "bool success\nstring message"}]}""",
    ),
    (serializing.unadvertise_services([1, 2]), '{"op": "unadvertiseServices", "serviceIds": [1, 2]}'),
    (
        serializing.connection_graph_update(
            GraphTables(
                {"/foo": ["/node_1"], "/bar": ("/node_1",)}, {"/foo": ["/node_2"]}, {"/set": ["/node_2"]}
            ),
            ["/baz"],
            [],
        ),
        """{"op": "connectionGraphUpdate",
            "publishedTopics": [{"name": "/foo", "publisherIds": ["/node_1"]}, {"name": "/bar", "publisherIds": ["/node_1"]}],
            "subscribedTopics": [{"name": "/foo", "subscriberIds": ["/node_2"]}],
            "advertisedServices": [{"name": "/set", "providerIds": ["/node_2"]}],
            "removedTopics": ["/baz"], "removedServices": []}""",
    ),
    (
        serializing.service_call_failure(1, 1, "Service does not exist"),
        '{"op": "serviceCallFailure", "serviceId": 1, "callId": 1, "message": "Service does not exist"}',
    ),
]

REFUSED_TEXTS = [
    ("", "not JSON"),
    ("{", "not JSON"),
    ("[" * 100_000, "not JSON"),
    ("[]", "not a JSON object"),
    ("{}", 'Unrecognized client opcode "None"'),
    ('{"op": {}}', "Unrecognized client opcode"),
    ('{"op": "explode"}', 'Unrecognized client opcode "explode"'),
    ('{"op": "subscribe"}', "subscribe: 'subscriptions' is not an array"),
    ('{"op": "subscribe", "subscriptions": [1]}', "not an array of objects"),
    ('{"op": "subscribe", "subscriptions": [{"id": 0}]}', "'channelId' is not a number"),
    ('{"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 1}]}', "'id' is not a number from 0"),
    ('{"op": "subscribe", "subscriptions": [{"id": true, "channelId": 1}]}', "'id' is not a number"),
    ('{"op": "subscribe", "subscriptions": [{"id": 4294967296, "channelId": 1}]}', "to 4294967295"),
    ('{"op": "unsubscribe", "subscriptionIds": ["x"]}', "'subscriptionIds' is not a number"),
    ('{"op": "advertise", "channels": [{"id": 1, "topic": 5}]}', "'topic' is not a string"),
    ('{"op": "getParameters", "parameterNames": [1]}', "not an array of strings"),
    (
        '{"op": "setParameters", "parameters": [{"name": "/a", "value": "%", "type": "byte_array"}]}',
        "the value of '/a' is not of type byte_array",
    ),
    (
        '{"op": "setParameters", "parameters": [{"name": "/a", "value": "x", "type": "float64"}]}',
        "the value of '/a' is not of type float64",
    ),
    (
        '{"op": "setParameters", "parameters": [{"name": "/a", "value": ["x"], "type": "float64_array"}]}',
        "the value of '/a' is not of type float64_array",
    ),
    (
        '{"op": "advertise", "channels": [{"id": 1, "topic": "foo", "encoding": "ros1"}]}',
        "'schemaName' is not a string",
    ),
    ('{"op": "unadvertise", "channelIds": [-1]}', "'channelIds' is not a number from 0 to 4294967295"),
    ('{"op": "unadvertise", "channelIds": [4294967296]}', "'channelIds' is not a number from 0 to"),
    ('{"op": "fetchAsset", "uri": "x"}', "'requestId' is not a number"),
]

REFUSED_BINARIES = [
    (b"", "empty binary message"),
    (b"\x09", "Unrecognized client opcode 9"),
    (b"\x01\x00", "Invalid message length 2"),
    (b"\x02" + bytes(11), "Invalid message length 12"),
    (struct.pack("<BIII", 2, 1, 1, 5) + b"ros1", "a text of 5 bytes"),
    (struct.pack("<BIII", 2, 1, 1, 2) + b"\xff\xff", "not UTF-8"),
    (struct.pack("<BBfBQI", 3, 7, 1.0, 0, 0, 0), "unknown playback command 7"),
    (struct.pack("<BBfBQI", 3, 0, float("nan"), 0, 0, 0), "a playback speed of nan"),
    (struct.pack("<BBfBQI", 3, 0, -1.0, 0, 0, 0), "a playback speed of -1.0"),
    (struct.pack("<BBfBQI", 3, 0, 0.0, 0, 0, 0), "a playback speed of 0.0"),
    (struct.pack("<BBfBQI", 3, 0, float("inf"), 0, 0, 0), "a playback speed of inf"),
]


@pytest.mark.parametrize(("text", "event"), FROM_CLIENTS, ids=lambda each: str(each)[8:30])
def test_json_of_the_specification_is_parsed(text: str, event: object) -> None:
    assert parsing.parse_text(text) == event


@pytest.mark.parametrize(("text", "expected"), TO_CLIENTS)
def test_json_to_clients_is_that_of_the_specification(text: str, expected: str) -> None:
    assert json.loads(text) == json.loads(expected)


@pytest.mark.parametrize(("text", "why"), REFUSED_TEXTS)
def test_wrong_json_is_refused_with_the_reason(text: str, why: str) -> None:
    with pytest.raises(BridgeProtocolError, match=why.replace("(", r"\(")):
        parsing.parse_text(text)


def test_json_with_a_million_arrays_is_refused() -> None:
    with pytest.raises(BridgeProtocolError, match="more than 1000000 values"):
        parsing.parse_text('{"op": "subscribe", "a": [' + "[]," * 1_100_000 + "0]}")


@pytest.mark.parametrize(("data", "why"), REFUSED_BINARIES)
def test_wrong_binary_is_refused_with_the_reason(data: bytes, why: str) -> None:
    with pytest.raises(BridgeProtocolError, match=why):
        parsing.parse_binary(data)


def test_binary_messages_of_clients_are_parsed() -> None:
    message = parsing.parse_binary(b"\x01" + b"\x02\x00\x00\x00" + b"abc")
    assert message == ClientMessage(2, memoryview(b"abc"))

    request = (
        b"\x02" + b"\x01\x00\x00\x00" + b"\x07\x00\x00\x00" + b"\x04\x00\x00\x00" + b"ros1" + b"\x00\x01"
    )
    assert parsing.parse_binary(request) == ServiceRequest(1, 7, "ros1", b"\x00\x01")

    control = (
        b"\x03\x01"
        + b"\x00\x00\x00\x40"
        + b"\x01"
        + b"\x08\x00\x00\x00\x00\x00\x00\x00"
        + b"\x02\x00\x00\x00"
        + b"r1"
    )
    assert parsing.parse_binary(control) == PlaybackControl(PlaybackCommand.PAUSE, 2.0, 8, "r1")
    without_seek = struct.pack("<BBfBQI", 3, 0, 0.5, 0, 99, 0)
    assert parsing.parse_binary(without_seek) == PlaybackControl(PlaybackCommand.PLAY, 0.5, None, "")


def test_binary_messages_to_clients_are_little_endian() -> None:
    assert serializing.message_head(258, 3) == b"\x01" + b"\x02\x01\x00\x00" + b"\x03" + bytes(7)
    assert serializing.time_frame(1) == b"\x02" + b"\x01" + bytes(7)
    assert (
        serializing.service_response_head(1, 7)
        == b"\x03" + b"\x01\0\0\0" + b"\x07\0\0\0" + b"\x04\0\0\0" + b"ros1"
    )
    assert serializing.asset_head(123) == b"\x04" + b"\x7b\0\0\0" + b"\x00" + b"\0\0\0\0"
    assert serializing.asset_failure(1, "no") == b"\x04" + b"\x01\0\0\0" + b"\x01" + b"\x02\0\0\0" + b"no"
    state = PlaybackState(PlaybackStatus.PAUSED, 5, 2.0, did_seek=True, request_id="r1")
    expected = b"\x05\x01" + b"\x05" + bytes(7) + b"\x00\x00\x00\x40" + b"\x01" + b"\x02\0\0\0" + b"r1"
    assert serializing.playback_state(state) == expected


def test_numbers_that_json_lacks_become_texts() -> None:
    text = serializing.parameter_values([Parameter("/a", float("nan")), Parameter("/b", [float("inf"), 1.0])])
    values = [each["value"] for each in json.loads(text)["parameters"]]
    assert values == ["nan", ["inf", 1.0]]


@given(st.binary(max_size=60))
def test_any_binary_is_parsed_or_refused(data: bytes) -> None:
    try:
        parsing.parse_binary(data)
    except BridgeProtocolError as error:
        assert str(error)  # noqa: PT017 one of the two outcomes


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=5,
)
_KEYS = ["subscriptions", "channels", "parameters", "parameterNames", "id", "uri", "requestId", "channelIds"]


@given(
    st.sampled_from(
        [
            "subscribe",
            "unsubscribe",
            "advertise",
            "unadvertise",
            "getParameters",
            "setParameters",
            "fetchAsset",
        ]
    ),
    st.dictionaries(st.sampled_from(_KEYS), _JSON),
)
def test_any_json_is_parsed_or_refused(op: str, fields: dict[str, object]) -> None:
    try:
        parsing.parse_text(json.dumps({**fields, "op": op}))
    except BridgeProtocolError as error:
        assert str(error).startswith(op)  # noqa: PT017 one of the two outcomes


def test_numbers_texts_and_schemas_are_those_of_the_message() -> None:
    parameters = [
        {"name": "/a", "value": 3, "type": "float64"},
        {"name": "/b", "value": [1, 2], "type": "float64_array"},
    ]
    found = parsing.parse_text(json.dumps({"op": "setParameters", "parameters": parameters}))
    assert isinstance(found, SetParameters)
    values = [each.value for each in found.parameters]
    assert values == [3.0, [1.0, 2.0]]
    assert isinstance(values[0], float)
    assert all(isinstance(each, float) for each in values[1])  # type: ignore[attr-defined]

    channel = {"id": 0, "topic": "/a", "encoding": "ros1", "schemaName": "a/B", "schema": "int8 x"}
    advertised = parsing.parse_text(json.dumps({"op": "advertise", "channels": [channel]}))
    assert isinstance(advertised, ClientAdvertise)
    assert advertised.channels[0].schema == Schema("a/B", "int8 x")


@pytest.mark.parametrize("count", [100_000, 100_001])
def test_entries_of_an_array_are_limited(count: int) -> None:
    text = json.dumps({"op": "unadvertise", "channelIds": [(1 << 32) - 1] * count})
    if count == 100_000:
        assert parsing.parse_text(text) == ClientUnadvertise(((1 << 32) - 1,) * count)
        return
    with pytest.raises(BridgeProtocolError, match="'channelIds' has 100001 entries, 100000 are allowed"):
        parsing.parse_text(text)
