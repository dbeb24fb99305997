"""core/wire/xmlrpc compared with the standard library's module, in both directions; and refused messages."""

from __future__ import annotations

import sys
import sysconfig
import xmlrpc.client
from collections import OrderedDict
from datetime import date, datetime
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.errors import RpcFault, RpcProtocolError
from minirospy.base.steps import ALONE, finish
from minirospy.core.wire import xmlrpc_reader
from minirospy.core.wire.http import MAX_BODY
from minirospy.core.wire.xmlrpc import (
    Call,
    DateTime,
    Serialized,
    parse_call,
    parse_call_in_steps,
    parse_response,
    serialize_call,
    serialize_call_in_steps,
    serialize_fault,
    serialize_response,
    serialize_response_in_steps,
)
from minirospy.core.wire.xmlrpc_reader import MAX_DEPTH, Reader
from tests.core.wire.memory import Allocations

# The characters that XML 1.0 allows: no control characters but tab and line feed, no surrogates.
TEXT = st.text(
    st.characters(exclude_categories=["Cs", "Cc"], exclude_characters="\ufffe\uffff")
    | st.sampled_from("\t\n]>&<")
)
SCALARS = (
    st.integers(-(2**31), 2**31 - 1) | st.booleans() | TEXT | st.floats(allow_nan=False, allow_infinity=False)
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXT, inner, max_size=4),
    max_leaves=12,
)


@given(VALUES)
def test_output_of_the_standard_library_is_read(value: Any) -> None:
    body = xmlrpc.client.dumps((value,), methodresponse=True).encode()
    assert parse_response(body) == value


@given(VALUES)
def test_standard_library_reads_our_output(value: Any) -> None:
    assert xmlrpc.client.loads(serialize_response(value)) == ((value,), None)


@given(st.lists(VALUES, max_size=4))
def test_calls(args: list[Any]) -> None:
    assert parse_call(serialize_call("system.multicall", args)) == Call("system.multicall", args)


def test_bytes_travel_as_base64() -> None:
    assert parse_response(serialize_response(b"x" * 3000)) == b"x" * 3000
    assert parse_response(serialize_response(b"\x00\xff")) == b"\x00\xff"
    (read,), _ = xmlrpc.client.loads(serialize_response(b"\x00\xff"))
    assert isinstance(read, xmlrpc.client.Binary)
    assert read.data == b"\x00\xff"


def test_a_value_without_a_type_is_a_string() -> None:
    body = b"<methodResponse><params><param><value> a &lt; b </value></param></params></methodResponse>"
    assert parse_response(body) == " a < b "


def test_a_fault_is_raised() -> None:
    with pytest.raises(RpcFault, match="no <such> thing") as raised:
        parse_response(serialize_fault(7, "no <such> thing"))
    assert raised.value.code == 7


@pytest.mark.parametrize("value", [2**31, -(2**31) - 1, None, object(), {1: 2}])
def test_values_without_an_xmlrpc_type_are_refused(value: object) -> None:
    with pytest.raises(RpcProtocolError):
        serialize_response(value)


def wrapped(value: bytes) -> bytes:
    return b"<methodResponse><params><param>" + value + b"</param></params></methodResponse>"


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"not XML",
        b"<a/>",
        b"<methodResponse/>",
        wrapped(b"<value><int>x</int></value>"),
        wrapped(b"<value><boolean>2</boolean></value>"),
        wrapped(b"<value><nil/></value>"),
        wrapped(b"<value><value>1</value></value>"),
        wrapped(b"<value><struct><member><value>1</value></member></struct></value>"),
        b'<!DOCTYPE a [<!ENTITY b "c">]>' + wrapped(b"<value>&b;</value>"),
        wrapped(b"<value><array><data>" * 100 + b"</data></array></value>" * 100),
        serialize_response(1)[:-20],
    ],
)
def test_invalid_answers_are_refused(body: bytes) -> None:
    with pytest.raises(RpcProtocolError):
        parse_response(body)


@given(
    st.binary()
    | st.lists(st.sampled_from([b"<value>", b"</value>", b"<int>", b"</int>", b"1", b"<struct>"])).map(
        b"".join
    )
)
def test_any_bytes_are_read_or_refused(body: bytes) -> None:
    for text in (body, wrapped(body)):
        try:
            parse_response(text)
        except (RpcProtocolError, RpcFault):
            pass


def test_dates_in_any_form() -> None:
    for text in ("20200102T03:04:05", "2020-01-02T03:04:05Z", "some day"):
        body = wrapped(b"<value><dateTime.iso8601>" + text.encode() + b"</dateTime.iso8601></value>")
        assert text.encode() in serialize_response(parse_response(body))


# --- in steps


LARGE = [
    [list(range(20_000)), {"a": 1.5, "b": [True, "x" * 200]}],
    ["<&>\r" * 100_000],
    ["\U0001f600" + "x" * 300_000],
    [{f"k{number}": [number] for number in range(5_000)}],
    [b"\x00\xff" * 200_000],
    [{"<key>" * 30_000: DateTime("some day")}],
]


@pytest.mark.parametrize("args", LARGE)
def test_a_large_call_is_written_and_read_in_steps_as_in_one(args: list[Any]) -> None:
    pieces = finish(serialize_call_in_steps("method", args, MAX_BODY))
    assert b"".join(pieces) == serialize_call("method", args)
    assert len(pieces) > 2
    assert finish(parse_call_in_steps(b"".join(pieces))) == ("method", args)
    pieces = finish(serialize_response_in_steps(args, MAX_BODY))
    assert b"".join(pieces) == serialize_response(args)


@given(st.lists(VALUES, max_size=3))
def test_any_call_is_written_and_read_in_steps_as_in_one(args: list[Any]) -> None:
    body = b"".join(finish(serialize_call_in_steps("m", args, MAX_BODY)))
    assert body == serialize_call("m", args)
    reader = Reader()
    for at in range(0, len(body), 7):
        reader.feed(body[at : at + 7])
    reader.feed(b"", is_last=True)
    reader.close()
    assert repr(reader.params) == repr(parse_call(body).args)


def test_long_base64_is_decoded_as_it_comes() -> None:
    data = bytes(range(256)) * 2_000
    body = xmlrpc.client.dumps((xmlrpc.client.Binary(data), "after"), "m").encode()
    assert finish(parse_call_in_steps(body)).args == [data, "after"]


@pytest.mark.parametrize("kind", ["value", "string", "base64", "name", "methodName"])
def test_long_text_is_not_copied_when_it_is_whole(kind: str) -> None:
    # Joining 60 MiB at the end would take 50 ms.
    if sys.gettrace() and kind != "base64":
        pytest.skip("Python copies more where it is traced")
    if sysconfig.get_config_var("Py_GIL_DISABLED") and sys.version_info < (3, 14) and kind != "base64":
        pytest.skip("without the GIL, Python 3.13 never adds to a text in place")
    text = "QUJD" * 1_000_000
    body = {
        "value": f"<value>{text}</value>",
        "string": f"<value><string>{text}</string></value>",
        "base64": f"<value><base64>{text}</base64></value>",
        "name": f"<value><struct><member><name>{text}</name><value>1</value></member></struct></value>",
        "methodName": f"<methodName>{text}</methodName>",
    }[kind].encode()
    data = b"<methodCall>" + body + b"</methodCall>"
    end = data.index(b"<", 1_000_000)
    reader = Reader()

    with Allocations() as memory:
        for at in range(0, end, 8192):
            reader.feed(data[at : min(at + 8192, end)])
        memory.mark()
        reader.feed(data[end:], is_last=True)
        assert memory.peak() < 1_000_000

    reader.close()
    value: Any = reader.params[0] if reader.params else reader.method
    assert value == {"base64": b"ABC" * 1_000_000, "name": {text: "1"}}.get(kind, text)


def test_memory_of_a_text_is_that_of_its_widest_character() -> None:
    # 6 MiB of ASCII are within the limit; if one character needs four bytes, they are not.
    text = b"<methodCall><value>" + b"x" * 6 * 1024 * 1024
    for wide, is_refused in ((b"", False), ("\u20ac".encode(), False), ("\U0001f600".encode(), True)):
        steps = parse_call_in_steps(text + wide + b"</value><methodName>m</methodName></methodCall>")
        if is_refused:
            with pytest.raises(RpcProtocolError, match="wide characters of more than 16 MiB in memory"):
                finish(steps)
        else:
            assert len(finish(steps).args[0]) >= 6 * 1024 * 1024


def test_a_short_wide_text_may_come_with_a_long_narrow_one() -> None:
    narrow, wide = "x" * 20 * 1024 * 1024, "\u20ac" * 100_000
    body = f"<methodCall><methodName>m</methodName><value>{narrow}</value><value>{wide}</value></methodCall>"
    assert finish(parse_call_in_steps(body.encode())).args == [narrow, wide]


def test_width_of_a_text_is_not_that_of_the_one_before() -> None:
    wide = "\U0001f600" * 100_000
    text = "x" * 20 * 1024 * 1024
    body = f"<methodCall><methodName>m</methodName><a>{wide}</a><value>{wide}</value><value>{text}</value></methodCall>"
    assert [len(value) for value in finish(parse_call_in_steps(body.encode())).args] == [len(wide), len(text)]


def test_lines_of_a_text_are_one_piece() -> None:
    # expat reports each line separately: short lines would take many times the size of the string.
    reader = Reader()
    reader.feed(b"<a>" + b"x\n" * 1000)
    assert len(reader._text) == 1
    reader.close()


def test_limits_are_as_documented() -> None:
    assert (MAX_DEPTH, xmlrpc_reader.MAX_ELEMENTS, xmlrpc_reader.MAX_MEMORY) == (64, 10**6, 64 * 2**20)
    assert xmlrpc_reader.MAX_WIDE == 16 * 2**20
    assert (xmlrpc_reader.MAX_TOKEN, xmlrpc_reader.MAX_SCALAR) == (64 * 2**10, 2048)


def nested(levels: int) -> Any:
    value: Any = 1
    for _ in range(levels):
        value = [value]
    return value


@pytest.mark.parametrize("levels", [64, 65])
def test_64_levels_of_lists_are_written_and_read(levels: int) -> None:
    is_refused = levels > 64
    for write in (
        lambda: serialize_response(nested(levels)),
        lambda: serialize_call("m", [nested(levels)]),
        lambda: b"".join(finish(serialize_response_in_steps(nested(levels), MAX_BODY))),
        lambda: b"".join(finish(serialize_call_in_steps("m", [nested(levels)], MAX_BODY))),
        lambda: serialize_response({"a": nested(levels - 1)}),
        lambda: b"".join(finish(serialize_response_in_steps({"a": nested(levels - 1)}, MAX_BODY))),
    ):
        if is_refused:
            with pytest.raises(RpcProtocolError, match="a value is nested deeper than 64 levels"):
                write()
        else:
            assert b"<int>1</int>" in write()


def test_empty_list_at_the_65th_level_is_refused() -> None:
    value: Any = []
    for _ in range(65):
        value = [value]
    finish(serialize_response_in_steps(value[0], MAX_BODY))
    with pytest.raises(RpcProtocolError, match="a value is nested deeper than 64 levels"):
        finish(serialize_response_in_steps(value, MAX_BODY))


@pytest.mark.parametrize("levels", [256, 257])
def test_levels_of_tags_are_limited(levels: int) -> None:
    reader = Reader()
    reader.feed(b"<a>" * 256)
    if levels > 256:
        with pytest.raises(RpcProtocolError, match="a value is nested deeper than 64 levels"):
            reader.feed(b"<a>")
    else:
        reader.feed(b"</a><a>" * 1000)
    reader.close()


def test_elements_are_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xmlrpc_reader, "MAX_ELEMENTS", 5)
    reader = Reader()
    reader.feed(b"<a><b/><b/><b/><b/>")
    with pytest.raises(RpcProtocolError, match="more than 5 elements"):
        reader.feed(b"<b/>")
    reader.close()


def test_incomplete_tag_may_have_64_kib() -> None:
    reader = Reader()
    reader.feed(b"<a " + b"x" * 65533)
    with pytest.raises(RpcProtocolError, match="a tag or comment of more than 65536 bytes"):
        reader.feed(b"x")
    reader.close()


def test_number_may_have_2048_characters() -> None:
    assert parse_response(wrapped(b"<value><double> " + b"0" * 2046 + b"5</double></value>")) == 5.0
    with pytest.raises(RpcProtocolError, match="a value of type double has more than 2048 characters"):
        parse_response(wrapped(b"<value><double> " + b"0" * 2047 + b"5</double></value>"))


@pytest.mark.parametrize("size", [30, 300_000])
def test_base64_that_is_not_whole_is_refused(size: int) -> None:
    body = b"<methodCall><value><base64>" + b"QUJD" * size + b"QU</base64></value></methodCall>"
    with pytest.raises(RpcProtocolError, match="not XML-RPC: Incorrect padding"):
        finish(parse_call_in_steps(body))


def test_base64_may_have_line_feeds_and_spaces_anywhere() -> None:
    body = b"<methodCall><methodName>m</methodName><value><base64>%s</base64></value></methodCall>"
    data = b"Q U\nJ D\r\n" * 100_000
    assert finish(parse_call_in_steps(body % data)).args == [b"ABC" * 100_000]
    assert parse_call(body % b" QUJD \n").args == [b"ABC"]


@pytest.mark.parametrize(
    ("body", "why"),
    [
        (b"<a/>", "not an XML-RPC answer"),
        (serialize_call("m", [1]), "not an XML-RPC answer"),
        (b"<methodResponse/>", "an XML-RPC answer without a value"),
        (b"<methodResponse><params/></methodResponse>", "an XML-RPC answer without a value"),
        (
            b"<methodResponse><params><param><value>a</value></param><param><value>b</value></param></params>"
            b"</methodResponse>",
            "an XML-RPC answer without a value",
        ),
        (b"<methodResponse><fault/></methodResponse>", "an XML-RPC fault without code and text"),
        (
            b"<methodResponse><fault><value><struct><member><name>faultCode</name><value>1</value></member>"
            b"</struct></value></fault></methodResponse>",
            "an XML-RPC fault without code and text",
        ),
        (wrapped(b"<value><boolean>2</boolean></value>"), "a boolean is 0 or 1, not '2'"),
        (wrapped(b"<value><nil/></value>"), "ROS has no nil"),
        (wrapped(b"<value><value>1</value></value>"), "a value inside a value"),
        (b"<!DOCTYPE a>" + wrapped(b"<value>b</value>"), "a document type has no place in XML-RPC"),
    ],
)
def test_why_an_answer_is_refused(body: bytes, why: str) -> None:
    with pytest.raises(RpcProtocolError, match=why):
        parse_response(body)


@pytest.mark.parametrize(
    "body", [b"<a/>", b"<methodCall/>", serialize_response(1), b"<a><methodName>m</methodName></a>"]
)
def test_why_a_call_is_refused(body: bytes) -> None:
    for parse in (parse_call, lambda body: finish(parse_call_in_steps(body))):
        with pytest.raises(RpcProtocolError, match="not an XML-RPC method call"):
            parse(body)


def test_short_plain_call_is_read_in_one_step() -> None:
    body = serialize_call("m", ["x" * 30_000])
    assert list(parse_call_in_steps(body)) == []
    assert finish(parse_call_in_steps(body)) == ("m", ["x" * 30_000])
    longer = serialize_call("m", ["x" * 32_768])
    assert len(list(parse_call_in_steps(longer))) == -(-len(longer) // 8192)


@pytest.mark.parametrize(
    ("value", "why"),
    [
        (2**31, "the integer 2147483648 does not fit XML-RPC's 32 bits"),
        (-(2**31) - 1, "the integer -2147483649 does not fit XML-RPC's 32 bits"),
        ({1: 2}, "the key 1 of a dictionary is not a string"),
        (None, "XML-RPC has no type for NoneType: None"),
        ({1, 2}, "XML-RPC has no type for set"),
    ],
)
def test_why_a_value_is_refused(value: object, why: str) -> None:
    for write in (
        lambda: serialize_response([value]),
        lambda: finish(serialize_response_in_steps([value], MAX_BODY)),
    ):
        with pytest.raises(RpcProtocolError, match=why):
            write()


def test_values_are_written_like_this() -> None:
    head, tail = (
        "<?xml version='1.0'?>\n<methodResponse><params><param>",
        "</param></params></methodResponse>\n",
    )

    for value, xml in (
        (-1, "<value><int>-1</int></value>"),
        (-(2**31), "<value><int>-2147483648</int></value>"),
        (2**31 - 1, "<value><int>2147483647</int></value>"),
        (True, "<value><boolean>1</boolean></value>"),
        (0.1, "<value><double>0.1</double></value>"),
        ("&<>\r\n", "<value><string>&amp;&lt;&gt;&#13;\n</string></value>"),
        ((1,), "<value><array><data><value><int>1</int></value></data></array></value>"),
        (
            {"<": "a"},
            "<value><struct>\n<member><name>&lt;</name><value><string>a</string></value></member>\n</struct></value>",
        ),
        (b"ABC", "<value><base64>QUJD</base64></value>"),
        (bytearray(b"ABC"), "<value><base64>QUJD</base64></value>"),
        (xmlrpc.client.Binary(b"ABC"), "<value><base64>QUJD</base64></value>"),
        (DateTime("<"), "<value><dateTime.iso8601>&lt;</dateTime.iso8601></value>"),
        (
            xmlrpc.client.DateTime("20200102T03:04:05"),
            "<value><dateTime.iso8601>20200102T03:04:05</dateTime.iso8601></value>",
        ),
        (
            datetime(2020, 1, 2, 3, 4, 5),
            "<value><dateTime.iso8601>20200102T03:04:05</dateTime.iso8601></value>",
        ),
        (date(2020, 1, 2), "<value><dateTime.iso8601>20200102T00:00:00</dateTime.iso8601></value>"),
    ):
        assert serialize_response(value).decode() == head + xml + tail
        assert b"".join(finish(serialize_response_in_steps(value, MAX_BODY))).decode() == head + xml + tail

    assert serialize_fault(3, "x").decode() == (
        "<?xml version='1.0'?>\n<methodResponse><fault><value><struct>\n"
        "<member><name>faultCode</name><value><int>3</int></value></member>\n"
        "<member><name>faultString</name><value><string>x</string></value></member>\n"
        "</struct></value></fault></methodResponse>\n"
    )


def test_subclasses_are_written_as_their_kind() -> None:
    class Number(float):
        def __repr__(self) -> str:
            return "number"

    class Text(str):
        pass

    assert parse_response(serialize_response([Number(0.5), Text("a"), OrderedDict(a=1)])) == [
        0.5,
        "a",
        {"a": 1},
    ]


@pytest.mark.parametrize("tag", ["int", "i4", "i8", "i1", "i2"])
def test_integers_of_any_size_are_read(tag: str) -> None:
    assert parse_response(wrapped(b"<value><%s> 7 </%s></value>" % (tag.encode(), tag.encode()))) == 7


def test_booleans_and_dates_are_read() -> None:
    assert parse_response(wrapped(b"<value><boolean> 1 </boolean></value>")) is True
    assert parse_response(wrapped(b"<value><boolean>0 </boolean></value>")) is False
    read = parse_response(wrapped(b"<value><dateTime.iso8601>20200102T03:04:05</dateTime.iso8601></value>"))
    assert read == datetime(2020, 1, 2, 3, 4, 5)


def test_steps_of_writing_are_of_one_size() -> None:
    def sizes(value: Any) -> list[int]:
        return [len(each) for each in finish(serialize_response_in_steps(value, MAX_BODY))]

    numbers = sizes([1] * 900)
    assert len(numbers) == 4
    assert numbers[1:3] == [300 * len("<value><int>1</int></value>")] * 2
    assert len(sizes([[1] * 900] * 3)) == 10
    # One piece contains 240 entries of five parts each.
    assert len(sizes({str(number): number for number in range(1000)})) == 5
    for text in ("x" * 300_000, {"x" * 300_000: 1}):
        assert len(sizes(text)) == 5
        assert sizes(text)[1:3] == [65536, 65536]
    assert len(sizes("x" * 65536)) == 1
    assert sizes(b"x" * 100_000)[1:4] == [32768, 32768, 32768]


@pytest.mark.parametrize("value", [1, [1] * 1000])
def test_answer_may_be_as_long_as_the_limit(value: Any) -> None:
    size = len(serialize_response(value))
    assert len(b"".join(finish(serialize_response_in_steps(value, size)))) == size
    with pytest.raises(RpcProtocolError, match=f"more than {size - 1} bytes of XML"):
        finish(serialize_response_in_steps(value, size - 1))


def test_answer_beyond_a_mebibyte_is_written_alone() -> None:
    needs = list(serialize_response_in_steps("x" * 20 * 65536, MAX_BODY))
    assert needs == [None] * 14 + [ALONE] + [None] * 4


def test_answer_that_is_written_already_is_joined() -> None:
    assert serialize_response(Serialized([b"<a", b"/>"])) == b"<a/>"


def test_each_step_is_short() -> None:
    body = serialize_call("m", [list(range(20_000))])
    assert sum(1 for _ in parse_call_in_steps(body)) > len(body) // 10_000
    steps = serialize_response_in_steps(list(range(20_000)), MAX_BODY)
    assert sum(1 for _ in steps) > 50


@pytest.mark.parametrize(
    ("body", "why", "status"),
    [
        (b"<methodCall><" + b"x" * 200_000, "a tag or comment of more than 65536 bytes", 400),
        (b"<methodCall><a b='" + b"x" * 200_000, "a tag or comment of more than 65536 bytes", 400),
        (b"<methodCall><!--" + b"> " * 100_000, "a tag or comment of more than 65536 bytes", 400),
        (b"<methodCall>" + b"<a>" * 20_000, "nested deeper", 400),
        (
            b"<methodCall><value><int>" + b"9" * 100_000 + b"</int></value></methodCall>",
            "int has more than 2048",
            400,
        ),
        (
            b"<methodCall><value><double>" + b"9" * 100_000 + b"</double></value></methodCall>",
            "double has more than 2048",
            400,
        ),
        (
            b"<methodCall><value>" + b"\xf0\x9f\x98\x80" + b"x" * 500_000,
            "more than 1 MiB in memory",
            413,
        ),
    ],
)
def test_too_large_input_is_refused_before_its_end(
    body: bytes, why: str, status: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(xmlrpc_reader, "MAX_MEMORY", 1024 * 1024)
    with pytest.raises(RpcProtocolError, match=why) as caught:
        finish(parse_call_in_steps(body))
    assert caught.value.status == status


def test_an_answer_that_is_too_large_is_refused_while_it_is_written() -> None:
    with pytest.raises(RpcProtocolError, match="more than 100000 bytes"):
        finish(serialize_response_in_steps([list(range(1000))] * 10**6, 100_000))
