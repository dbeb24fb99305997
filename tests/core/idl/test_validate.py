"""No text in a third-party definition is executed: invalid names are refused, all other text remains text."""

from __future__ import annotations

import ast
import builtins
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from minirospy.base.errors import DefinitionError, NotFoundError
from minirospy.core.idl.emit import emit_class, emit_message, emit_package, emit_service
from minirospy.core.idl.load import (
    Catalogue,
    class_from_text,
    classes_from_text,
    compile_package,
    get_message_class,
    specs_of_text,
)
from minirospy.core.idl.parse import parse_message, parse_service
from minirospy.core.idl.spec import Constant, Field, FieldType, MessageSpec
from minirospy.core.idl.validate import check_spec, check_type_name, is_type_name
from minirospy.introspect.messages import MessageClasses

SEPARATOR = "=" * 80
EXECUTED: list[str] = []
"""The arguments with which the canary was called; the list must stay empty."""

CODE = "__import__('builtins').canary('x')"
ATTACKS = [
    f'x"+str({CODE})+"y/B',
    f'a/B"+str({CODE})+"',
    f"a/B(genpy.Message):\n pass\n{CODE}\nclass C",
    f'a/B"""\n{CODE}\n"""',
    f"a/B\n{CODE}",
    f"a/B\r{CODE}",
    f"a/B\x0c{CODE}",
    f"a/B {CODE}",
    f"a/B;{CODE}",
    f"a.msg._B import B\n{CODE}#/C",
    f"a/{{{CODE}}}",
    f"a/B\\\n{CODE}",
    "a/B\u2028x",
    "../../a/B",
    "/a/B",
    "a/../B",
    "a//B",
    "a/B/",
    "os.path/B",
    "idlelib.idle/B",
    "a/B\0",
    "\u00e4/B",
    "\uff41/B",
    "a/\u212a",
    "1/B",
    "a/_B",
    "",
    "/",
    "*",
    "a/None",
    "a/True",
    "lambda/B",
    "import/B",
]
NAMES_OF_GENERATED_CODE = {
    "annotations", "struct", "sys", "lru_cache", "TYPE_CHECKING", "Any", "genpy", "object", "super", "bytes", "str", "len",
    "isinstance", "bool", "list", "tuple", "map", "range", "hasattr", "memoryview", "setattr", "type", "dict", "int", "float",
    "TypeError", "AttributeError", "ValueError", "self", "args", "kwds", "buff", "data", "end", "write", "error", "name",
    "OverflowError", "value", "values", "view", "letter", "count", "order", "raw", "_",
}  # fmt: skip


@pytest.fixture(autouse=True)
def canary() -> Iterator[None]:
    """Provide the function that the attacks in these tests would call."""
    builtins.canary = EXECUTED.append  # type: ignore[attr-defined]
    yield
    del builtins.canary  # type: ignore[attr-defined]
    executed = EXECUTED.copy()
    EXECUTED.clear()
    assert not executed


def assert_harmless(source: str, names: set[str]) -> None:
    """Assert that generated source contains only the names of generated code and of the definition."""
    tree = ast.parse(source)
    stored = {
        node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }
    allowed = NAMES_OF_GENERATED_CODE | names | stored
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            assert node.id in allowed or node.id.startswith("_"), node.id
            assert not node.id.startswith("__") or node.id in ("__slots__", "__name__"), node.id
        elif isinstance(node, ast.Import):
            assert {alias.name for alias in node.names} <= {"struct", "sys", "genpy"}
        elif isinstance(node, ast.ImportFrom):
            assert node.module in {"__future__", "functools", "typing"} or ".msg._" in str(node.module)
        elif isinstance(node, ast.Attribute):
            assert not node.attr.startswith("__") or node.attr in {"__init__", "__new__", "__name__"}


def executed_by(type_: str, definition: str) -> None:
    """Create a class from a publisher's header, as the commands do, and use it."""
    header = {"type": type_, "md5sum": "*", "message_definition": definition}
    try:
        message = MessageClasses().for_header(header)()
    except (DefinitionError, NotFoundError):
        return
    str(message)


@pytest.mark.parametrize("name", ATTACKS)
def test_type_name_with_anything_but_a_name_is_refused(name: str) -> None:
    assert not is_type_name(name)
    with pytest.raises(DefinitionError) as raised:
        check_type_name(name)
    assert "\n" not in str(raised.value)
    assert str(raised.value).isascii()
    assert len(str(raised.value)) < 300
    assert get_message_class(name) is None

    spec = MessageSpec(*name.partition("/")[::2], (), (), "")
    with pytest.raises(DefinitionError):
        emit_message(spec, {}.__getitem__)
    executed_by(name, "int32 a\n")
    executed_by("p/M", f"int32 a\n{SEPARATOR}\nMSG: {name}\nint32 b\n")
    executed_by("p/M", f"{name} a\n{SEPARATOR}\nMSG: {name}\nint32 b\n")
    assert not EXECUTED


@pytest.mark.parametrize("name", [name for name in ATTACKS if "/" in name])
def test_package_whose_folder_or_file_is_an_attack_is_refused(name: str) -> None:
    package, _, short = name.partition("/")
    with pytest.raises(DefinitionError):
        emit_package(package, "msg", [short])
    with pytest.raises(DefinitionError):
        emit_service(parse_service("---\n", package, short), {}.__getitem__)
    assert not EXECUTED


@pytest.mark.skipif(sys.platform == "win32", reason="no such file names")
def test_file_of_a_definition_whose_name_is_code_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "p" / "msg"
    folder.mkdir(parents=True)
    (folder / 'x"+str(canary(1))+".msg').write_text("int32 a\n")
    with pytest.raises(DefinitionError, match="not of the form package/Type"):
        compile_package(Catalogue.below(tmp_path), "p")


@pytest.mark.parametrize("name", ["a b", "a=1", "x\n", "x:", "", "_x", "1x", "\u00e4", "a.b", 'x"', "x#"])
def test_field_or_constant_that_is_not_a_name_is_refused_by_the_emitter(name: str) -> None:
    field = MessageSpec("p", "M", (Field(name, FieldType("int8")),), (), "")
    constant = MessageSpec("p", "M", (), (Constant(name, "int8", 1, "1"),), "")
    for spec in (field, constant):
        with pytest.raises(DefinitionError, match="not a legal field name"):
            check_spec(spec)
        with pytest.raises(DefinitionError):
            emit_message(spec, {}.__getitem__)


def test_fields_named_like_keywords_get_an_underscore_as_genpy_has_it() -> None:
    made = class_from_text("p/M", "int32 from\nint32 self\nint32 lambda\nint32 class=5\n")
    assert made.__slots__ == ["from_", "self_", "lambda_"]
    assert made.class_ == 5
    with pytest.raises(DefinitionError, match="declared twice in Python"):
        class_from_text("p/M", "int32 from\nint32 from_\n")


def test_similar_names_of_types_are_not_mixed_up() -> None:
    text = "\n".join(
        [
            "a/b_C one\na_b/C two\nstruct/I three\n",
            *(f"{SEPARATOR}\nMSG: {name}\n{field}" for name, field in (("a/b_C", "int8 x\n"), ("a_b/C", "int8 y\n"))),
            f"{SEPARATOR}\nMSG: struct/I\nuint32 z\n",
        ]
    )  # fmt: skip
    made = class_from_text("p/M", text)()
    assert [type(part).__slots__ for part in (made.one, made.two, made.three)] == [["x"], ["y"], ["z"]]
    assert made.deserialize(b"\1\2\3\0\0\0").three.z == 3


def test_module_that_is_not_a_package_of_messages_is_not_imported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ran = "import builtins\nbuiltins.canary(__name__)\n"
    (tmp_path / "evil_module.py").write_text(ran)
    for folder in ("evil_package", "evil_package/sub", "real_msgs", "real_msgs/msg"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "__init__.py").write_text("" if folder.startswith("real") else ran)
    monkeypatch.syspath_prepend(str(tmp_path))

    for name in (
        "evil_module/X",
        "evil_package/X",
        "evil_package.sub/X",
        "antigravity/X",
        "this/X",
        "real_msgs/X",
    ):
        assert get_message_class(name) is None

    assert not EXECUTED
    assert "antigravity" not in sys.modules
    (tmp_path / "real_msgs/msg/__init__.py").write_text(
        "class X:\n    _type = 'real_msgs/X'\n    _md5sum = '1'\n"
    )
    sys.modules.pop("real_msgs.msg", None)
    assert get_message_class("real_msgs/X")._md5sum == "1"


# --- anything at all

legal_names = st.from_regex(r"[A-Za-z][A-Za-z0-9_]{0,8}", fullmatch=True)
hostile = st.one_of(
    st.sampled_from(ATTACKS),
    st.text(max_size=30),
    st.text("ab/\\\"'#=[]{}() \n\r\t\0;:.,_1", max_size=20),
    st.tuples(st.text("\"'\\\n)}", max_size=4), st.just(CODE), st.text("\"'\\\n#({", max_size=4)).map(
        "".join
    ),
)
types = st.one_of(
    st.sampled_from(["int8", "string", "float64[]", "uint8[3]", "time", "p/N", "Header"]), hostile
)
lines = st.one_of(
    st.builds("{} {}".format, types, st.one_of(legal_names, hostile)),
    st.builds("{} {}={}".format, types, st.one_of(legal_names, hostile), hostile),
    st.builds("string {}={}".format, legal_names, hostile),
    st.builds("int8 {} # {}".format, legal_names, hostile),
    st.builds("# {}".format, hostile),
    hostile,
)


@given(
    st.one_of(legal_names.map("p/{}".format), hostile), st.lists(lines, max_size=6).map("\n".join), hostile
)
@example('x"+str(' + CODE + ')+"y/B', "int32 a\n", "p/N")
@example("p/M", f'string A="""+{CODE}+"""\nstring B=\\\nint8 c #"""', "p/N")
@example("p/M", f'string A=\\"+{CODE}+\\"', "p/N")
def test_no_definition_of_any_name_and_text_runs_anything(name: str, text: str, inner: str) -> None:
    definition = f"{text}\n{SEPARATOR}\nMSG: p/N\nint8 x\n{SEPARATOR}\nMSG: {inner}\n{text}"

    try:
        specs = specs_of_text(name, definition)
        emitted = [emit_class(specs[each], specs.__getitem__).source for each in specs]
    except (DefinitionError, KeyError):
        # KeyError means that the text lacks a type.
        pass
    else:
        for source, spec in zip(emitted, specs.values(), strict=True):
            assert_harmless(source, {spec.name})

    executed_by(name, definition)
    executed_by(name, text)
    assert not EXECUTED


@given(
    st.dictionaries(st.sampled_from(["type", "md5sum", "message_definition", "callerid", "topic"]), hostile)
)
def test_no_connection_header_runs_anything(header: dict[str, str]) -> None:
    try:
        MessageClasses().for_header(header)()
    except (DefinitionError, NotFoundError):
        pass
    assert not EXECUTED


@given(st.lists(lines, max_size=6).map("\n".join))
def test_no_service_of_any_text_runs_anything(text: str) -> None:
    known = {"p/N": parse_message("int8 x\n", "p", "N")}
    known["std_msgs/Header"] = known["p/N"]
    try:
        spec = parse_service(text + "\n---\n" + text, "p", "S")
        source = emit_service(spec, known.__getitem__)
    except (DefinitionError, KeyError):
        return
    assert_harmless(source, {"S", "SRequest", "SResponse"})


def test_text_of_legal_definitions_comes_back_as_it_was() -> None:
    text = 'string A="""\' \\ # {x}\nint8 b # """\n'
    made = class_from_text("p/M", text)
    assert made._full_text == text
    assert made.A == '"""\' \\ # {x}'
    assert dict(classes_from_text("p/M", text)) == {"p/M": made}
