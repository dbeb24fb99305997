"""The reader of CMakeLists.txt."""

from __future__ import annotations

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.errors import BuildError
from minirospy.workspace.cmake import keyword_arguments, parse_cmake


def read(text: str, **variables: str) -> list[tuple[str, tuple[str, ...], int]]:
    return [tuple(command) for command in parse_cmake(text, "f", variables)]  # type: ignore[misc]


def test_words_lines_and_case() -> None:
    text = "project(x)\n\nAdd_Message_Files(\n  FILES\n  a.msg b.msg\n)\n"
    assert read(text) == [("project", ("x",), 1), ("add_message_files", ("FILES", "a.msg", "b.msg"), 3)]


def test_comments() -> None:
    text = "# f(\n#[[ g(\n]] a(1 # 2)\n3)\n#[=[ ]] h( ]=] b()"
    assert read(text) == [("a", ("1", "3"), 3), ("b", (), 5)]


def test_quotes_and_brackets() -> None:
    assert read('a("b c" "d\\"e;f" [[g "h]] [=[i]]j]=])') == [("a", ("b c", 'd"e;f', 'g "h', "i]]j"), 1)]


def test_a_hash_in_quotes_is_no_comment() -> None:
    assert read('a("b # c")') == [("a", ("b # c",), 1)]


def test_nested_brackets_are_words() -> None:
    assert read("if(A AND (B OR C))\nendif()") == [
        ("if", ("A", "AND", "(", "B", "OR", "C", ")"), 1),
        ("endif", (), 2),
    ]


def test_variables() -> None:
    text = 'project(p)\nset(F a b)\nset(G "c;d")\nf(${F} ${G} "${F}" ${PROJECT_NAME}_x ${nobody} ${P}/y $ENV{HOME})'
    assert read(text, P="lib")[-1] == ("f", ("a", "b", "c", "d", "a;b", "p_x", "lib/y"), 4)


def test_lists_and_the_cache() -> None:
    text = 'set(F a CACHE STRING "what for")\nlist(APPEND F b c)\nlist(APPEND G d)\nf(${F} ${G})'
    assert read(text)[-1] == ("f", ("a", "b", "c", "d"), 4)


def test_loops() -> None:
    text = (
        "set(L x y)\nforeach(T a b)\n f(${T})\n foreach(U IN LISTS L ITEMS z)\n  g(${T}${U})\n endforeach()\n"
    )
    text += "endforeach(T)\nh()"
    assert [(name, *arguments) for name, arguments, _ in read(text)] == [
        ("set", "L", "x", "y"),
        *(("f", "a"), ("g", "ax"), ("g", "ay"), ("g", "az")),
        *(("f", "b"), ("g", "bx"), ("g", "by"), ("g", "bz")),
        ("h",),
    ]


def test_keywords() -> None:
    found = keyword_arguments(("x", "FILES", "a", "b", "DIRECTORY", "d"), frozenset(["FILES", "DIRECTORY"]))
    assert found == {"": ["x"], "FILES": ["a", "b"], "DIRECTORY": ["d"]}


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("a(b", "f:1: a( is not closed"),
        ("x()\na(b\nc(d)\n", "f:2: a( is not closed"),
        ("a", "f:1: a( is not closed"),
        ("a b()", "f:1: [a] is not followed by ( ... )"),
        ("x()\nforeach(T a)\nf()", "f:2: foreach() without endforeach()"),
        ("\n)", "f:2: a closing bracket without an opening one"),
        ("(a)", "f:1: a bracket without a command before it"),
        ('a(\n"b)', 'f:2: a quote or bracket is not closed: "b)'),
    ],
)
def test_errors_have_a_line(text: str, error: str) -> None:
    with pytest.raises(BuildError) as caught:
        read(text)
    assert str(caught.value) == error


@given(st.text('ab()[]="#\\ \n;$ {}', max_size=40))
def test_any_text_is_read_or_refused(text: str) -> None:
    with contextlib.suppress(BuildError):
        read(text)
