"""names: the tables of http://wiki.ros.org/Names and http://wiki.ros.org/Remapping%20Arguments."""

from __future__ import annotations

import pytest

from minirospy.base import names


@pytest.mark.parametrize(
    ("name", "node", "resolved"),
    [
        ("bar", "/node1", "/bar"),
        ("bar", "/wg/node2", "/wg/bar"),
        ("/bar", "/wg/node2", "/bar"),
        ("~bar", "/node1", "/node1/bar"),
        ("~bar", "/wg/node2", "/wg/node2/bar"),
        ("foo/bar", "/wg/node3", "/wg/foo/bar"),
        ("~foo/bar", "/wg/node3", "/wg/node3/foo/bar"),
        ("bar/", "/node1", "/bar"),
        ("/bar//baz/", "/node1", "/bar/baz"),
        ("~/bar", "/node1", "/node1/bar"),
        ("", "/wg/node1", "/wg/"),
    ],
)
def test_resolve(name: str, node: str, resolved: str) -> None:
    assert names.resolve(name, node) == resolved


def test_remapping_is_by_resolved_names() -> None:
    arguments = names.parse_arguments(["prog", "chatter:=/wg/chatter2", "x"])
    remappings = arguments.resolved_remappings("/talker")
    assert names.resolve("/chatter", "/talker", remappings) == "/wg/chatter2"
    assert names.resolve("chatter", "/talker", remappings) == "/wg/chatter2"
    assert arguments.plain == ["prog", "x"]


def test_arguments_are_parsed() -> None:
    arguments = names.parse_arguments(["p", "_rate:=5", "__name:=n", "__unknown:=x", "a:=b", "-v", ":=x"])
    assert arguments.parameters == {"rate": "5"}
    assert arguments.special == {"__name": "n", "__unknown": "x"}
    assert arguments.remappings == {"a": "b"}
    assert arguments.plain == ["p", "-v", ":=x"]


@pytest.mark.parametrize(
    "argument", ["--flag:=x", "-x:=y", "1:=2", "x-y:=z", "a b:=c", "[x]:=y", ":=", "http://a:=b"]
)
def test_argument_without_a_name_is_left_to_the_program(argument: str) -> None:
    assert names.parse_arguments([argument]) == ([argument], {}, {}, {}, [])


def test_argument_without_a_value_has_no_effect() -> None:
    assert names.parse_arguments(["a:=", "_p:=", "__name:= "]) == ([], {}, {}, {}, [])


def test_argument_with_two_values_is_reported() -> None:
    assert names.parse_arguments(["a:=b:=c", "_:=x"]) == ([], {"_": "x"}, {}, {}, ["a:=b:=c"])


def test_launch_argument_without_a_value_has_no_effect() -> None:
    words = ["file.launch", "a:=1", "b:=", "c:= ", "d:= x y ", "_e:=1", "__ns:=n", ":=1", "f:=g:=h"]
    assert names.parse_launch_arguments(words) == {"a": "1", "d": "x y", "f": "g:=h"}


@pytest.mark.parametrize(
    ("name", "legal"),
    [("a", True), ("/a/b", True), ("~a", True), ("", True), ("1a", False), ("a b", False), ("a//b", False), ("/", True),
     ("a-b", False), ("é", False)],
)  # fmt: skip
def test_legal_names(name: str, legal: bool) -> None:
    assert names.is_legal_name(name) is legal


@pytest.mark.parametrize(("name", "legal"), [("talker", True), ("a/b", False), ("", False), ("_a", False)])
def test_legal_base_names(name: str, legal: bool) -> None:
    assert names.is_legal_base_name(name) is legal


@pytest.mark.parametrize(
    ("name", "namespace"),
    [("/a/b/c", "/a/b/"), ("/a", "/"), ("/", "/"), ("", "/"), ("/a/b/", "/a/"), ("a", "/")],
)
def test_namespace_of(name: str, namespace: str) -> None:
    assert names.namespace_of(name) == namespace


@pytest.mark.parametrize(
    ("namespace", "name", "joined"),
    [("/a", "b", "/a/b"), ("/a/", "b", "/a/b"), ("/a", "/b", "/b"), ("/a", "~b", "~b"), ("~", "b", "~b"), ("", "b", "b"),
     ("/", "b", "/b")],
)  # fmt: skip
def test_join(namespace: str, name: str, joined: str) -> None:
    assert names.join(namespace, name) == joined


def test_anonymous_names_are_legal() -> None:
    assert names.is_legal_base_name(names.anonymous_name("talker"))
