"""core/graph/calls: the table of methods, called without a server."""

from __future__ import annotations

from typing import Any

import pytest

from minirospy.base.errors import RpcFault
from minirospy.base.steps import Steps, finish
from minirospy.core.graph.calls import (
    ERROR,
    FAILURE,
    SUCCESS,
    Answer,
    CallRefused,
    Dispatcher,
    Method,
    anything,
    api_uri,
    global_key,
    global_name,
    node_name,
    parameter_key,
    parameters,
    plain_key,
    some,
    subgraph,
    text,
    type_name,
    uris,
)


class Full(Exception):
    """An error from the tables that the methods use."""


def add(caller_id: str, topic: str, uri: str = "http://default:1/") -> Answer:
    return [SUCCESS, caller_id, [topic, uri]]


def refuse(caller_id: str) -> Answer:
    raise Full("no room")


def count(caller_id: str, last: int) -> Steps[Answer]:
    for _ in range(last):
        yield None
    if last > 3:
        raise Full("too far")
    return [SUCCESS, "", last]


DISPATCHER = Dispatcher(
    {
        "add": Method(add, 0, parameters(topic=global_name, uri=api_uri), optional=1),
        "refuse": Method(refuse, "nothing"),
        "count": Method(count, -5, parameters(last=anything)),
    },
    refusals=(Full,),
)


@pytest.mark.parametrize(
    ("name", "args", "answer"),
    [
        ("add", ["/n", "t", "http://x:1/"], [1, "/n", ["/t", "http://x:1/"]]),
        ("add", ["/n", "t"], [1, "/n", ["/t", "http://default:1/"]]),
        ("add", [], [-1, "missing required caller_id parameter", 0]),
        ("add", ["/n"], [-1, "Error: bad call arity", 0]),
        ("add", ["/n", "/t", "http://x:1/", 4], [-1, "Error: bad call arity", 0]),
        ("add", [5, "/t"], [-1, "caller_id must be a string", 0]),
        ("add", ["/n" * 3000, "/t"], [-1, "the caller_id has more than 4096 characters", 0]),
        ("add", ["/n\n", "/t"], [-1, "caller_id contains illegal chars", 0]),
        ("add", ["/n", 5], [-1, "ERROR: parameter [topic] must be a non-empty string", 0]),
        ("refuse", ["/n"], [-1, "no room", "nothing"]),
        ("count", ["/n", 3], [1, "", 3]),
        ("count", ["/n", 4], [-1, "too far", -5]),
    ],
)
def test_a_call_is_checked_and_answered(name: str, args: list[Any], answer: Answer) -> None:
    found = DISPATCHER.dispatch(name, args)
    assert (found if isinstance(found, list) else finish(found)) == answer


def test_an_unknown_method_is_a_fault() -> None:
    with pytest.raises(RpcFault, match=r'method "x+" is not supported') as caught:
        DISPATCHER.dispatch("x" * 10_000, ["/n"])
    assert len(caught.value.text) < 5000


def test_a_multicall_yields_between_its_calls() -> None:
    calls: list[Any] = [
        {"methodName": "add", "params": ["/n", "t"]},
        {"methodName": "nothing", "params": []},
        {"methodName": "system.multicall", "params": [[]]},
        {"methodName": "count", "params": ["/n", 2]},
        {"methodName": "system.listMethods", "params": []},
        5,
    ]
    steps = DISPATCHER.dispatch("system.multicall", [calls])
    taken = 0

    while True:
        try:
            next(steps)
        except StopIteration as end:
            answers = end.value
            break

        taken += 1

    assert taken == len(calls) + 2
    assert answers == [
        [[1, "/n", ["/t", "http://default:1/"]]],
        {"faultCode": 1, "faultString": "<class 'Exception'>:method \"nothing\" is not supported"},
        {"faultCode": 1, "faultString": "system.multicall inside itself"},
        [[1, "", 2]],
        [["add", "count", "refuse"]],
        {"faultCode": 1, "faultString": "a call is a struct of methodName and params"},
    ]


@pytest.mark.parametrize("args", [[], [5], [[], []]])
def test_a_multicall_takes_one_list(args: list[Any]) -> None:
    with pytest.raises(RpcFault, match=r"system\.multicall takes a list"):
        DISPATCHER.dispatch("system.multicall", args)


@pytest.mark.parametrize(
    ("read", "value", "found"),
    [
        (anything, None, None),
        (some, [1], [1]),
        (text, "a b", "a b"),
        (global_name, "t-b", "/ns/t-b"),
        (global_name, "~p", "/ns/n/p"),
        (node_name, "/", "/"),
        (parameter_key, "a b:c\n", "/ns/a b:c\n"),
        (plain_key, "~x", "~x"),
        (type_name, "std_msgs/Bool", "std_msgs/Bool"),
        (type_name, "*", "*"),
        (api_uri, "rosrpc://x:1", "rosrpc://x:1"),
        (subgraph, "", ""),
        (subgraph, "a/", "/ns/a"),
        (uris, ["http://x:1/"], ["http://x:1/"]),
        (uris, [], []),
        (uris, ["http://x:1/"] * 20_000, ["http://x:1/"] * 20_000),
        (global_key, "/a", "/a"),
        (node_name, "/" + "a" * 4095, "/" + "a" * 4095),
        (global_name, "/a//b/", "/a/b"),
    ],
)
def test_an_argument_is_read(read: Any, value: Any, found: Any) -> None:
    assert read(value, "p", "/ns/n") == found


@pytest.mark.parametrize(
    ("read", "value", "why"),
    [
        (some, "", "must be specified and non-empty"),
        (text, 5, "must be a non-empty string"),
        (text, "", "must be a non-empty string"),
        (global_name, "/", "cannot be the global namespace"),
        (global_name, "a b", "contains illegal chars"),
        (global_name, "a\tb", "contains illegal chars"),
        (node_name, "a:b", "contains illegal chars"),
        (node_name, "a" * 4097, "has more than 4096 characters"),
        (parameter_key, 5, "must be a string"),
        (parameter_key, "", "must be specified"),
        (plain_key, "a" * 4097, "has more than 4096 characters"),
        (type_name, "Bool", "not a valid package resource name"),
        (type_name, "a/B\n", "not a valid package resource name"),
        (api_uri, "", "is not an XMLRPC URI"),
        (api_uri, "file:///x", "is not an RPC URI"),
        (api_uri, "http://x:1/\r\nX: y", "contains illegal chars"),
        (subgraph, 5, "must be a string"),
        (uris, "x", "must be a list"),
        (uris, [5], "must be a list of strings"),
        (uris, ["http://x:1/"] * 20_001, "has more than 20000 URIs"),
        (uris, ["http://x:1/", "x"], r"does not contain valid URLs \[x\]"),
        (uris, ["http:///x"], r"does not contain valid URLs \[http:///x\]"),
        (uris, ["://x"], r"does not contain valid URLs \[://x\]"),
        (global_key, "~a", "must be a globally referenced name"),
        (global_key, "a", "must be a globally referenced name"),
        (global_key, "", "must be a non-empty string"),
        (api_uri, "http://x y", "contains illegal chars"),
        (api_uri, 5, "is not an XMLRPC URI"),
        (subgraph, "a" * 4097, "has more than 4096 characters"),
        (type_name, "a/b/C", "not a valid package resource name"),
    ],
)
def test_a_bad_argument_is_refused_by_name(read: Any, value: Any, why: str) -> None:
    with pytest.raises(CallRefused, match=rf"param(eter)? \[p\].*{why}"):
        read(value, "p", "/ns/n")


def test_status_codes_are_those_of_the_api() -> None:
    assert (SUCCESS, FAILURE, ERROR) == (1, 0, -1)
