"""The parser of CMakeLists.txt."""

from __future__ import annotations

import contextlib
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.errors import BuildError
from minirospy.workspace import cmake
from minirospy.workspace.cmake import Word, keyword_arguments, parse_cmake


def read(text: str) -> list[tuple[str, tuple[str, ...], int]]:
    return [
        (node.name, tuple(word.text for word in node.words), node.line) for node in parse_cmake(text, "f")
    ]


def test_words_lines_and_case() -> None:
    text = "project(x)\n\nAdd_Message_Files(\n  FILES\n  a.msg b.msg\n)\n"
    assert read(text) == [("project", ("x",), 1), ("add_message_files", ("FILES", "a.msg", "b.msg"), 3)]


def test_comments() -> None:
    text = "# f(\n#[[ g(\n]] a(1 # 2)\n3)\n#[=[ ]] h( ]=] b()"
    assert read(text) == [("a", ("1", "3"), 3), ("b", (), 5)]


def test_quotes_and_brackets() -> None:
    assert read('a("b c" "d\\"e;f" [[g "h]] [=[i]]j]=])') == [("a", ("b c", 'd\\"e;f', 'g "h', "i]]j"), 1)]


def test_a_hash_in_quotes_is_no_comment() -> None:
    assert read('a("b # c")') == [("a", ("b # c",), 1)]


def test_nested_brackets_are_words() -> None:
    assert read("if(A AND (B OR C))\nendif()") == [("if", ("A", "AND", "(", "B", "OR", "C", ")"), 1)]


def test_nested_commands() -> None:
    (condition, last) = parse_cmake(
        "if(A)\n f()\n foreach(x a)\n  g()\n endforeach(x)\nelse()\nENDIF(A)\nh()", "f"
    )
    assert [(node.name, [inner.name for inner in node.body]) for node in condition.body] == [
        ("f", []),
        ("foreach", ["g"]),
        ("else", []),
    ]
    assert (last.name, last.line) == ("h", 8)


def test_a_mark_of_the_byte_order_is_no_word() -> None:
    assert read("\ufeffa(b)\r\n") == [("a", ("b",), 1)]


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
        ("x()\nif(A)\nforeach(T a)\nendif()", "f:3: foreach() without endforeach()"),
        ("x()\nendif()", "f:2: endif() without if()"),
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


def test_brackets_that_do_not_close_are_searched_for_once_a_level() -> None:
    class Text(str):
        searches = 0

        def find(self, *arguments: Any) -> int:
            Text.searches += 1
            return super().find(*arguments)

    text = Text("set(" + "[=[ [[ #[==[ \n" * 1000 + "]==] \n")
    words = [match["word"] for match, _ in cmake._tokens(text, "CMakeLists.txt") if match["word"]]
    assert words[:3] == ["set", "[=[", "[["]
    # Every "[==[" is closed only at the end, so the first one is a comment up to that point.
    assert len(words) == 3
    assert Text.searches == 3

    text = Text("set(" + "[=[ [[ #[==[ \n" * 1000 + ")")
    (statement,) = parse_cmake(str(text), "CMakeLists.txt")
    assert statement.words == (Word("[=["), Word("[[")) * 1000
    Text.searches = 0
    assert len(list(cmake._tokens(text, "CMakeLists.txt"))) == 6003
    assert Text.searches == 3
