"""core/wire/tcpros: which peers accept each other. The checks of both sides are connected in memory."""

from __future__ import annotations

from typing import Any

import pytest

from minirospy.base.errors import HandshakeRefused, WireError
from minirospy.core.wire.tcpros import (
    InterfaceType,
    check_publisher,
    check_service,
    check_service_client,
    check_subscriber,
    publisher_header,
    service_client_header,
    service_header,
    subscriber_header,
)

BOOL = InterfaceType("std_msgs/Bool", "8b94c1b53db61fb6aed406028ad6332a", "bool data\n")
STRING = InterfaceType("std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1", "string data\n")
ANY_TYPE = InterfaceType("*", "*")


def test_type_of_a_message_and_of_a_service() -> None:
    class Message:
        _type, _md5sum, _full_text = BOOL

    class Service:
        _type, _md5sum = "std_srvs/Empty", "d41d8cd98f00b204e9800998ecf8427e"

    assert InterfaceType.of(Message) == BOOL
    assert InterfaceType.of(Service) == (Service._type, Service._md5sum, "")


@pytest.mark.parametrize(("mine", "theirs"), [(BOOL, BOOL), (BOOL, ANY_TYPE), (ANY_TYPE, BOOL)])
def test_a_fitting_pair_accepts_each_other(mine: InterfaceType, theirs: InterfaceType) -> None:
    asked = subscriber_header("/t", theirs, "/sub")
    assert check_subscriber(asked, "/t", mine) is None
    check_publisher(publisher_header("/t", mine, "/pub", latch=False), "/t", theirs)


def test_different_types_are_distinguished_by_name() -> None:
    why = check_subscriber(subscriber_header("/t", STRING, "/sub"), "/t", BOOL)
    assert why == "topic types do not match: [std_msgs/String] vs. [std_msgs/Bool]"


def test_a_type_of_the_same_name_with_another_definition_is_refused() -> None:
    old = InterfaceType("std_msgs/Bool", "0" * 32)
    why = check_subscriber(subscriber_header("/t", old, "/sub"), "/t", BOOL)
    assert why == (
        f"Client [/sub] wants topic [/t] to have datatype/md5sum [std_msgs/Bool/{old.md5sum}], "
        f"but our version has [std_msgs/Bool/{BOOL.md5sum}] Dropping connection."
    )


def test_a_renamed_type_with_the_same_fields_is_accepted() -> None:
    renamed = InterfaceType("my_msgs/Flag", BOOL.md5sum)
    assert check_subscriber(subscriber_header("/t", renamed, "/sub"), "/t", BOOL) is None


@pytest.mark.parametrize("missing", ["callerid", "md5sum"])
def test_a_subscriber_must_send(missing: str) -> None:
    fields = subscriber_header("/t", BOOL, "/sub")
    del fields[missing]
    assert check_subscriber(fields, "/t", BOOL) == f"Missing required '{missing}' field"


def test_a_subscriber_need_not_send_type_definition_nor_nodelay() -> None:
    fields = {"topic": "/t", "md5sum": BOOL.md5sum, "callerid": "/sub"}
    assert check_subscriber(fields, "/t", BOOL) is None


def test_a_publisher_need_only_send_md5sum_and_type() -> None:
    check_publisher({"md5sum": BOOL.md5sum, "type": BOOL.name}, "/t", BOOL)


def test_a_publishers_error_is_raised_with_its_text() -> None:
    with pytest.raises(HandshakeRefused, match="no such topic"):
        check_publisher({"error": "no such topic"}, "/t", BOOL)


def test_a_publisher_of_another_type_is_refused() -> None:
    with pytest.raises(HandshakeRefused, match="topic types do not match"):
        check_publisher(publisher_header("/t", STRING, "/pub", latch=True), "/t", BOOL)


def test_user_fields_override_so_that_a_relay_sends_its_type() -> None:
    extra = {"cookies": "yes", "type": BOOL.name, "md5sum": BOOL.md5sum}
    header = publisher_header("/t", ANY_TYPE, "/pub", latch=True, extra=extra)
    assert (header["cookies"], header["topic"], header["latching"]) == ("yes", "/t", "1")
    check_publisher(header, "/t", BOOL)
    with pytest.raises(HandshakeRefused):
        check_publisher(header, "/t", STRING)


def test_services() -> None:
    client = service_client_header("/s", STRING.md5sum, "/client", persistent=True)
    assert client["persistent"] == "1"
    why = check_service_client(client, BOOL)
    assert why is not None
    assert why.startswith("request from [/client]: md5sums do not match")
    assert check_service_client(service_client_header("/s", "*", "/client", probe=True), BOOL) is None
    check_service(service_header("/s", BOOL, "/server", "a/BRequest", "a/BResponse"))
    with pytest.raises(HandshakeRefused):
        check_service({"error": "no"})


@pytest.mark.parametrize("caller_id", ["/a\nb", "/a\x1b[2J", "/a\r", "/a\x9b"])
def test_caller_id_with_control_characters_is_refused(caller_id: str) -> None:
    why = "field [callerid] contains illegal chars"
    assert check_subscriber(subscriber_header("/t", BOOL, caller_id), "/t", BOOL) == why
    assert check_service_client(service_client_header("/s", BOOL.md5sum, caller_id), BOOL) == why


def test_text_of_a_refusal_is_escaped() -> None:
    with pytest.raises(HandshakeRefused, match=r"^no\\x1b\[2J$"):
        check_publisher({"error": "no\x1b[2J"}, "/t", BOOL)
    evil = InterfaceType("a/B\x1b", "m\x1b")
    with pytest.raises(HandshakeRefused, match=r"\\x1b") as raised:
        check_publisher(publisher_header("/t", evil, "/pub", latch=False), "/t", BOOL)
    assert "\x1b" not in str(raised.value)


# Check the header fields that are sent, which are those of rospy and roscpp.


def test_subscriber_header_fields() -> None:
    fields = {
        "callerid": "/sub",
        "md5sum": BOOL.md5sum,
        "message_definition": "bool data\n",
        "tcp_nodelay": "0",
        "topic": "/t",
        "type": "std_msgs/Bool",
    }
    assert subscriber_header("/t", BOOL, "/sub") == fields
    more = subscriber_header("/t", BOOL, "/sub", tcp_nodelay=True, split_frames=True)
    assert more == {**fields, "tcp_nodelay": "1", "split_frames": "2"}


def test_publisher_header_fields() -> None:
    fields = {
        "callerid": "/pub",
        "latching": "0",
        "md5sum": BOOL.md5sum,
        "message_definition": "bool data\n",
        "topic": "/t",
        "type": "std_msgs/Bool",
    }
    assert publisher_header("/t", BOOL, "/pub", latch=False) == fields
    extra: dict[str, Any] = {"number": 5}
    found = publisher_header("/t", BOOL, "/pub", latch=True, extra=extra)
    assert found == {**fields, "latching": "1", "number": "5"}


def test_service_client_header_fields() -> None:
    fields = {"callerid": "/client", "md5sum": BOOL.md5sum, "service": "/s"}
    assert service_client_header("/s", BOOL.md5sum, "/client") == fields
    extra: dict[str, Any] = {"number": 5, "callerid": "/x"}
    found = service_client_header("/s", BOOL.md5sum, "/client", persistent=True, probe=True, extra=extra)
    assert found == {**fields, "persistent": "1", "probe": "1", "number": "5", "callerid": "/x"}


def test_service_header_fields() -> None:
    assert service_header("/s", BOOL, "/server", "a/BRequest", "a/BResponse") == {
        "callerid": "/server",
        "md5sum": BOOL.md5sum,
        "request_type": "a/BRequest",
        "response_type": "a/BResponse",
        "service": "/s",
        "type": "std_msgs/Bool",
    }


@pytest.mark.parametrize("missing", ["service", "md5sum", "callerid"])
def test_service_client_must_send(missing: str) -> None:
    fields = service_client_header("/s", BOOL.md5sum, "/client")
    del fields[missing]
    assert check_service_client(fields, BOOL) == f"Missing required '{missing}' field"


def test_service_client_of_another_type_is_refused_with_both_md5sums() -> None:
    why = check_service_client(service_client_header("/s", STRING.md5sum, "/client"), BOOL)
    assert why == f"request from [/client]: md5sums do not match: [{STRING.md5sum}] vs. [{BOOL.md5sum}]"


@pytest.mark.parametrize("missing", ["md5sum", "type"])
def test_publisher_must_send(missing: str) -> None:
    fields = publisher_header("/t", BOOL, "/pub", latch=False)
    del fields[missing]
    with pytest.raises(
        HandshakeRefused, match=rf"publisher of \[/t\] sent a connection header without \[{missing}\]"
    ):
        check_publisher(fields, "/t", BOOL)


@pytest.mark.parametrize("name", ["std_msgs/Bool", "*"])
def test_publisher_of_another_definition_is_refused(name: str) -> None:
    with pytest.raises(HandshakeRefused, match=r"topic \[/t\]: md5sums do not match: \[0\] vs\. \[8b94"):
        check_publisher({"md5sum": "0", "type": name}, "/t", BOOL)


def test_service_without_an_md5sum_is_refused() -> None:
    with pytest.raises(WireError, match=r"header missing required field \[md5sum\]"):
        check_service({"type": "std_msgs/Bool"})
