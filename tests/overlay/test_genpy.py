"""genpy as user code and generated modules import it."""

from __future__ import annotations

import subprocess
import sys
from io import BytesIO
from pathlib import Path
from typing import Any

import genmsg
import genmsg.msg_loader
import genmsg.msgs
import genpy
import genpy.base
import genpy.dynamic
import genpy.message
import genpy.rostime
import pytest
from genmsg import InvalidMsgSpec
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool, Header, String
from std_srvs.srv import SetBool

from minirospy.core.idl.load import Catalogue, class_from_text, message_class, service_class

ROOT = Path(__file__).parents[2]


def wire(message: Any) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def test_submodules_are_there_after_import_genpy() -> None:
    code = "import genpy; print(genpy.message.Message is genpy.Message, genpy.rostime.Time is genpy.Time)"
    assert subprocess.check_output([sys.executable, "-c", code], text=True) == "True True\n"


def test_generated_modules_find_their_imports() -> None:
    assert genpy.struct_I.pack(1) == b"\1\0\0\0"
    assert genpy.message.struct_I is genpy.struct_I
    assert issubclass(genpy.SerializationError, genpy.MessageException)


def test_the_error_handler_that_modules_of_real_genpy_name(caplog: pytest.LogCaptureFixture) -> None:
    import codecs

    handler: Any = codecs.lookup_error("rosmsg")
    handler.msg_type = "test/Text"
    assert b"a\xff\xfeb".decode("utf-8", "rosmsg") == "a\ufffd\ufffdb"
    assert b"\xff".decode("utf-8", "rosmsg") == "\ufffd"
    assert [record.message.split(":")[0] for record in caplog.records] == [
        "Characters replaced when decoding message test/Text (will print only once)"
    ]


def test_dynamic_classes() -> None:
    made = genpy.dynamic.generate_dynamic("sensor_msgs/LaserScan", LaserScan._full_text)
    assert sorted(made) == ["sensor_msgs/LaserScan", "std_msgs/Header"]
    scan = made["sensor_msgs/LaserScan"]
    assert (scan._type, scan._md5sum, scan._full_text) == (
        LaserScan._type,
        LaserScan._md5sum,
        LaserScan._full_text,
    )
    assert scan._has_header
    assert type(scan().header) is made["std_msgs/Header"]
    assert made["std_msgs/Header"]._md5sum == Header._md5sum


@pytest.mark.parametrize(
    ("type_", "text", "why"),
    [
        ("x/Y", "int32", "Invalid declaration: int32"),
        ("Y", "int32 a\n", "not of the form package/Type"),
        ("/Y", "int32 a\n", "not of the form package/Type"),
        ("x/Y", "x/Y y\n", "contains itself"),
    ],
)
def test_texts_that_make_no_class(type_: str, text: str, why: str) -> None:
    with pytest.raises(InvalidMsgSpec, match=why):
        genpy.dynamic.generate_dynamic(type_, text)


@pytest.mark.parametrize("text", ["int32 a", "int32 a\n", "\n# a\r\nint32 a # b\n\n", "int32 A=1\nint32 a\n"])
def test_the_full_text_is_kept_as_it_came(text: str) -> None:
    assert class_from_text("x/Y", text)._full_text == text


CATALOGUE = Catalogue.below(ROOT / "msgs")


def types_of(package: str) -> list[Any]:
    services = [service_class(spec.full_name) for spec in CATALOGUE.services(package)]
    return [
        *(message_class(spec.full_name) for spec in CATALOGUE.messages(package)),
        *(each for srv in services for each in (srv._request_class, srv._response_class)),
    ]


def test_types_are_found() -> None:
    assert sum(len(CATALOGUE.messages(package)) for package in CATALOGUE.packages) > 200


@pytest.mark.parametrize("part", range(4))
def test_every_type_as_a_class_made_at_run_time(part: int) -> None:
    for installed in [each for package in CATALOGUE.packages for each in types_of(package)][part::4]:
        type_ = installed._type
        made = class_from_text(type_, installed._full_text)
        assert made._md5sum == installed._md5sum, type_
        assert made._full_text == installed._full_text, type_
        assert made.__slots__ == installed.__slots__, type_
        assert made._slot_types == installed._slot_types, type_
        assert repr(made()) == repr(installed()), type_
        assert wire(made()) == wire(installed()), type_
        assert repr(made().deserialize(wire(installed()))) == repr(installed()), type_


def test_classes_by_name() -> None:
    assert genpy.message.get_message_class("std_msgs/Bool") is Bool
    assert genpy.message.get_message_class("Header") is Header
    assert genpy.message.get_message_class("std_msgs/Bool", reload_on_error=True) is Bool
    assert genpy.message.get_message_class("std_msgs/Nope") is None
    assert genpy.message.get_message_class("nope/Nope") is None
    assert genpy.message.get_service_class("std_srvs/SetBool") is SetBool
    assert genpy.message.get_service_class("std_msgs/Bool") is None
    for nameless in ("Bool", "/Bool", "/", ""):
        with pytest.raises(ValueError, match=f"message type is missing package name: {nameless}$"):
            genpy.message.get_message_class(nameless)
    for wrong in ("std_msgs/msg/Bool", "//Bool"):
        with pytest.raises(ValueError, match=rf"invalid name \[{wrong}\]"):
            genpy.message.get_message_class(wrong)


def test_small_things() -> None:
    assert genpy.message.isstring("a")
    assert not genpy.message.isstring(b"a")
    assert not genpy.message.isstring(1)
    assert genpy.base.is_simple("int32")
    assert not genpy.base.is_simple("string")
    assert not genpy.base.is_simple("int32[]")
    assert genpy.base.SIMPLE_TYPES[:3] == ["int8", "uint8", "bool"]
    assert genpy.message.get_printable_message_args(PoseStamped(), prefix="a.").startswith(
        "a.header.seq a.header.stamp "
    )


def test_filling_and_showing() -> None:
    text = String()
    genpy.message.fill_message_args(text, ["hello"])
    assert genpy.message.strify_message(text) == 'data: "hello"'
    genpy.message.check_type("data", "string", text.data)
    with pytest.raises(genpy.SerializationError):
        genpy.message.check_type("data", "int8", 300)


# The full text of a message as it is in a bag, whose package is not installed
UNKNOWN = f"{'=' * 80}\n".join(("Part[] parts\n", "MSG: not_installed/Part\nstring from\nint32 number\n"))


def test_filling_an_array_of_a_type_that_is_only_in_the_full_text() -> None:
    whole = genpy.dynamic.generate_dynamic("not_installed/Whole", UNKNOWN)
    message = whole["not_installed/Whole"]()
    genpy.message.fill_message_args(message, [{"parts": [{"from_": "a", "number": 2}, ["b", 3]]}])
    assert [type(part) for part in message.parts] == [whole["not_installed/Part"]] * 2
    assert [(part.from_, part.number) for part in message.parts] == [("a", 2), ("b", 3)]


def test_filling_an_array_of_an_unknown_type() -> None:
    base: Any = genpy.dynamic.generate_dynamic("not_installed/Whole", UNKNOWN)["not_installed/Whole"]

    class Whole(base):  # type: ignore[misc]
        _slot_types = ("not_installed/Missing[]",)

    with pytest.raises(genpy.MessageException) as caught:
        genpy.message.fill_message_args(Whole(), [{"parts": [{}]}])
    assert (
        str(caught.value)
        == "Cannot instantiate messages for field [parts] : cannot load class not_installed/Missing"
    )


@pytest.mark.parametrize(
    ("text", "request_fields", "response_fields", "md5"),
    [
        ("int32 a", ["a"], [], "5c9fb1a886e81e3162a5c87bf55c072b"),
        ("int32 a\n---", ["a"], [], "5c9fb1a886e81e3162a5c87bf55c072b"),
        ("", [], [], "d41d8cd98f00b204e9800998ecf8427e"),
        ("int32 a\n---\nint32 b\n---\nint32 c", ["a"], ["b", "c"], "812989c1ece7c05c389b0c6e56bd04ee"),
    ],
)
def test_service_with_any_number_of_lines_between(
    text: str, request_fields: list[str], response_fields: list[str], md5: str
) -> None:
    """The md5sums are those of Debian's genmsg."""
    context = genmsg.MsgContext.create_default()
    spec = genmsg.msg_loader.load_srv_from_string(context, text, "p/S")
    assert (spec.request.names, spec.response.names) == (request_fields, response_fields)
    assert genmsg.compute_md5(context, spec) == md5


def test_genmsg_refuses_what_is_not_a_specification() -> None:
    context = genmsg.MsgContext.create_default()
    spec = genmsg.msg_loader.load_msg_from_string(context, "time t\nDog[] d\nDog e", "p/M")
    genmsg.msg_loader.load_msg_from_string(context, "int8 legs", "p/Dog")
    assert genmsg.msg_loader.load_depends(context, spec, {}) == ["p/Dog"]
    with pytest.raises(ValueError, match="spec does not appear"):
        genmsg.msg_loader.load_depends(context, None, {})
    with pytest.raises(ValueError, match="search_path"):
        genmsg.msg_loader.get_msg_file("p", "M", None)
    with pytest.raises(ValueError, match="non-None"):
        genmsg.msgs.Constant("int8", "A", None, "1")
