"""Short definitions that expand to huge types, and short messages that claim many elements: one clear error, no delay."""

from __future__ import annotations

import gc
import linecache
import struct
from collections.abc import Callable
from pathlib import Path

import pytest

from minirospy.base.errors import DefinitionError, DeserializationError
from minirospy.core.idl.digest import message_md5
from minirospy.core.idl.load import Catalogue, class_from_text, compile_package, specs_of_text
from minirospy.core.idl.parse import parse_message
from minirospy.introspect.messages import MessageClasses

SEPARATOR = "=" * 80


def full_text(own: str, **parts: str) -> str:
    return "".join([own, *(f"\n{SEPARATOR}\nMSG: p/{name}\n{text}" for name, text in parts.items())])


def chain(length: int, line: str, last: str = "int32 a\n") -> str:
    """Return types that each have fields of the next one; ``line`` defines a field, with the type's name inserted."""
    parts = {f"T{number}": line.format(f"p/T{number + 1}") for number in range(1, length)}
    return full_text(line.format("p/T1"), **parts, **{f"T{length}": last})


DOUBLED = "{0} a\n{0} b\n"
EXPLODING = {
    "doubling": chain(40, DOUBLED),
    "doubling of nothing": chain(40, DOUBLED, ""),
    "doubling of arrays": chain(40, "{0}[] a\n{0}[] b\n"),
    "growing by fixed arrays": chain(40, "{0}[100] a\n"),
    "a billion numbers": "int8[999999999] a\n",
    "a number of elements without end": f"int8[{'9' * 100_000}] a\n",
    "more elements than 32 bits": "int8[99999999999] a\n",
    "a thousand arrays of a million": "".join(f"float64[1000000] a{n}\n" for n in range(1000)),
    "a billion empty messages": full_text("p/E[999999999] a\n", E=""),
    "nested deeply": chain(60, "{0} a\n"),
    "nested without end": chain(3000, "{0} a\n"),
    "loops inside loops": chain(30, "{0}[] a\n"),
    "itself": "p/M a\n",
    "itself in between": full_text("p/A a\n", A="p/B b\n", B="p/A a\n"),
    "a hundred thousand fields": "".join(f"int8 a{n}\n" for n in range(100_000)),
    "ten thousand types": full_text(
        "".join(f"p/T{n} a{n}\n" for n in range(10_000)), **{f"T{n}": "" for n in range(10_000)}
    ),
    "two million characters": "# " + "x" * 2_000_000,
    "a long name": f"int8 {'a' * 500_000}=\n",
    "a long line that is not a definition": "a " * 300_000,
    "a constant without end": f"int64 A={'9' * 500_000}\n",
    "a hexadecimal constant without end": f"uint64 A=0x{'f' * 500_000}\n",
}


@pytest.mark.parametrize("text", EXPLODING.values(), ids=list(EXPLODING))
def test_definition_that_explodes_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(DefinitionError) as raised:
        class_from_text("p/M", text)
    assert "\n" not in str(raised.value)
    assert len(str(raised.value)) < 250


@pytest.mark.parametrize("name", ["doubling", "growing by fixed arrays", "nested deeply", "itself"])
def test_definition_that_explodes_in_a_file_is_refused(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "p" / "msg"
    folder.mkdir(parents=True)
    own, *parts = EXPLODING[name].split(f"\n{SEPARATOR}\nMSG: p/")
    (folder / "M.msg").write_text(own)
    for part in parts:
        short, _, text = part.partition("\n")
        (folder / f"{short}.msg").write_text(text)
    with pytest.raises(DefinitionError):
        compile_package(Catalogue.below(tmp_path), "p")


@pytest.mark.parametrize("name", ["doubling", "doubling of nothing"])
def test_md5sum_counts_each_type_once(name: str) -> None:
    specs = specs_of_text("p/M", EXPLODING[name])
    assert len(message_md5(specs["p/M"], specs.__getitem__)) == 32


def test_md5sum_of_deep_types_is_refused() -> None:
    specs = specs_of_text("p/M", EXPLODING["nested without end"])
    with pytest.raises(DefinitionError, match="nested deeper than"):
        message_md5(specs["p/M"], specs.__getitem__)


LARGE = {
    "many fields": "".join(f"float64 a{n}\n" for n in range(1000)),
    "long arrays": "uint8[1000000] a\nfloat64[1000000] b\n",
    "deep": chain(40, "{0} a\n"),
    "arrays in arrays": chain(15, "{0}[] a\n"),
    # This is like MoveIt's largest action, whose types have some 17,000 fields if each use is counted.
    "one large type in nine layers": chain(9, "{0} a\n", "".join(f"int8 b{n}\n" for n in range(1900))),
    "many types": full_text(
        "".join(f"p/T{n} a{n}\n" for n in range(100)), **{f"T{n}": "int8 a\nstring b\n" for n in range(100)}
    ),
}


@pytest.mark.parametrize("text", LARGE.values(), ids=list(LARGE))
def test_large_definitions_are_accepted(text: str) -> None:
    assert class_from_text("p/M", text)()._full_text == text


def count(number: int) -> bytes:
    return struct.pack("<I", number)


ASKING = {
    "numbers": ("float64[] a\n", lambda: count(2**32 - 1)),
    "bytes": ("uint8[] a\n", lambda: count(2**32 - 1)),
    "booleans": ("bool[] a\n", lambda: count(2**32 - 1)),
    "a text": ("string a\n", lambda: count(2**32 - 1)),
    "texts": ("string[] a\n", lambda: count(2**32 - 1)),
    "times": ("time[] a\n", lambda: count(2**32 - 1)),
    "messages": (full_text("p/A[] a\n", A="int8 x\nstring y\n"), lambda: count(2**32 - 1)),
    "messages of fixed size": (full_text("p/A[] a\n", A="int8 x\n"), lambda: count(2**32 - 1)),
    "empty messages": (full_text("p/A[] a\n", A=""), lambda: count(2**32 - 1)),
    "empty messages in messages": (
        full_text("p/B[] b\n", B="p/A[] a\n", A=""),
        lambda: count(20_000) + count(50_000) * 20_000,
    ),
    "empty messages in arrays of fixed length": (
        full_text("p/B[] b\n", B="uint8 x\np/A[50000] a\n", A=""),
        lambda: count(50_000) + bytes(50_000),
    ),
    "numbers in messages": (full_text("p/A[] a\n", A="float64[] x\n"), lambda: count(2**32 - 1) * 5),
}  # fmt: skip


@pytest.mark.parametrize(("text", "body"), ASKING.values(), ids=list(ASKING))
def test_message_with_counts_beyond_its_bytes_is_refused(text: str, body: Callable[[], bytes]) -> None:
    with pytest.raises(DeserializationError):
        class_from_text("p/M", text)().deserialize(body())


def test_empty_messages_are_read_as_many_as_there_are() -> None:
    made = class_from_text("p/M", full_text("p/B[] b\np/A[1000] c\n", B="p/A[] a\n", A=""))
    message = made().deserialize(count(3) + count(2) + count(0) + count(1))
    assert [len(each.a) for each in message.b] == [2, 0, 1]
    assert len(message.c) == 1000


def test_error_of_a_definition_is_escaped() -> None:
    with pytest.raises(DefinitionError) as raised:
        parse_message("int8 a\x1b[2J\n", "p", "M")
    assert "\x1b" not in str(raised.value)


def test_definitions_without_end_do_not_fill_the_memory() -> None:
    classes = MessageClasses()
    for number in range(600):
        header = {"type": f"p/M{number}", "md5sum": "*", "message_definition": "int8 a\n"}
        assert classes.for_header(header)().a == 0
    gc.collect()
    sources = [name for name in linecache.cache if name.startswith("<generated p/M")]
    # The number equals that of cached classes, for this reader and for others that use the same definitions.
    assert len(sources) < 600
