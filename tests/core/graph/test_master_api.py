"""core/graph/master_api without a server: the journal records, log lines and notifications for each change, and their steps."""

from __future__ import annotations

import logging
import os
from collections.abc import Generator, Sequence
from typing import Any

import pytest

from minirospy.base.errors import RpcFault
from minirospy.base.steps import ALONE, Steps, finish
from minirospy.core.graph import parameters, registry_limits
from minirospy.core.graph.calls import Answer
from minirospy.core.graph.master_api import PARAMETERS, MasterApi, Notice, key_of_node
from minirospy.core.graph.parameters import ParameterUpdate
from minirospy.core.graph.registry import NodeShutdown, PublisherUpdate

URI = "http://n:1/"
INVALID = "Error: invalid arguments"


class Recorded(MasterApi):
    """A master that records its actions in order."""

    def __init__(self) -> None:
        super().__init__()
        self.done: list[Any] = []
        self.stored: list[object] = []
        self.lines: list[str] = []
        self.record = lambda *record: self.done.append(list(record))
        self.log = self.lines.append
        self.store = self._store

    def _store(self, value: object) -> Steps[int]:
        self.stored.append(value)
        yield None
        return 7

    @property
    def uri(self) -> str:
        return "http://master:1/"

    def notify(self, action: Notice) -> None:
        self.done.append(action)

    def defer(self, uri: str, topic: str) -> None:
        self.done.append(("hold", uri, topic))

    def stop(self) -> None:
        self.done.append("stop")

    def get_status(self, caller_id: str) -> Answer:
        return [1, "", {}]

    def call(self, method: str, *args: object) -> Any:
        """Return the response; clear the actions and log lines recorded before."""
        self.done.clear()
        self.lines.clear()
        answer = self.dispatch(method, args)
        return finish(answer) if isinstance(answer, Generator) else answer


@pytest.fixture
def master() -> Recorded:
    return Recorded()


UPDATE = PublisherUpdate("http://s:1/", "/t")


@pytest.mark.parametrize(
    ("before", "call", "answer", "done", "line"),
    [
        (
            [("registerSubscriber", "/s", "/t", "*", "http://s:1/")],
            ("registerPublisher", "/n", "/t", "a/B", URI),
            [1, "Registered [/n] as publisher of [/t]", ["http://s:1/"]],
            # The caller gets its response before the subscriber gets its update; the journal is written first.
            [UPDATE, ["+pub", "/n", "/t", "a/B", URI]],
            f"+PUB [/t] /n {URI}",
        ),
        (
            [
                ("registerSubscriber", "/s", "/t", "*", "http://s:1/"),
                ("registerPublisher", "/n", "/t", "a/B", URI),
            ],
            ("unregisterPublisher", "/n", "/t", URI),
            [1, "Unregistered [/n] as provider of [/t]", 1],
            [["-pub", "/n", "/t", URI], UPDATE],
            f"-PUB [/t] /n {URI}",
        ),
        (
            [("registerPublisher", "/p", "/t", "a/B", "http://p:1/")],
            ("registerSubscriber", "/n", "/t", "a/B", URI),
            [1, "Subscribed to [/t]", ["http://p:1/"]],
            [("hold", URI, "/t"), ["+sub", "/n", "/t", "a/B", URI]],
            f"+SUB [/t] /n {URI}",
        ),
        (
            [("registerSubscriber", "/n", "/t", "*", URI)],
            ("unregisterSubscriber", "/n", "/t", URI),
            [1, "Unregistered [/n] as provider of [/t]", 1],
            [["-sub", "/n", "/t", URI]],
            f"-SUB [/t] /n {URI}",
        ),
        (
            [],
            ("registerService", "/n", "/srv", "rosrpc://n:2", URI),
            [1, "Registered [/n] as provider of [/srv]", 1],
            [["+srv", "/n", "/srv", "rosrpc://n:2", URI]],
            f"+SERVICE [/srv] /n {URI}",
        ),
        (
            [("registerService", "/n", "/srv", "rosrpc://n:2", URI)],
            ("unregisterService", "/n", "/srv", "rosrpc://n:2"),
            [1, "Unregistered [/n] as provider of [/srv]", 1],
            [["-srv", "/n", "/srv", "rosrpc://n:2"]],
            "-SERVICE [/srv] /n rosrpc://n:2",
        ),
        (
            [("subscribeParam", "/s", "http://s:1/", "/p")],
            ("setParam", "/n", "/p", 5),
            [1, "parameter /p set", 0],
            [["set", "/p", 5], ParameterUpdate("http://s:1/", "/p/")],
            "+PARAM [/p] by /n",
        ),
        (
            [("setParam", "/n", "/p", 5), ("subscribeParam", "/s", "http://s:1/", "/p")],
            ("deleteParam", "/n", "/p"),
            [1, "parameter /p deleted", 0],
            [["del", "/p"], ParameterUpdate("http://s:1/", "/p/")],
            "-PARAM [/p] by /n",
        ),
        (
            [("setParam", "/n", "/p", 5)],
            ("subscribeParam", "/n", URI, "/p"),
            [1, "Subscribed to parameter [/p]", 5],
            [("hold", URI, PARAMETERS), ["+par", "/n", "/p", URI]],
            "+CACHEDPARAM [/p] by /n",
        ),
        (
            [("subscribeParam", "/n", URI, "/p")],
            ("unsubscribeParam", "/n", URI, "/p"),
            [1, "Unsubscribe to parameter [/p]", 1],
            [["-par", "/n", "/p", URI]],
            "-CACHEDPARAM [/p] by /n",
        ),
    ],
    ids=lambda value: value[0] if isinstance(value, tuple) else "",
)
def test_change_is_recorded_logged_and_sent(
    master: Recorded,
    before: Sequence[tuple[str, ...]],
    call: tuple[str, ...],
    answer: Answer,
    done: list[object],
    line: str,
) -> None:
    for each in before:
        assert master.call(*each)[0] == 1
    assert master.call(*call) == answer
    assert master.done == done
    assert master.lines == [line]


@pytest.mark.parametrize(
    ("call", "answer"),
    [
        (("unregisterPublisher", "/n", "/t", URI), [1, "[/n] is not a registered node", 0]),
        (("unregisterSubscriber", "/n", "/t", URI), [1, "[/n] is not a registered node", 0]),
        (("unregisterService", "/n", "/t", "rosrpc://n:1"), [1, "[/n] is not a registered node", 0]),
        (("unregisterPublisher", "/other", "/t", URI), [1, "[/other] is not a known provider of [/t]", 0]),
        (("unregisterSubscriber", "/other", "/t", URI), [1, "[/other] is not a known provider of [/t]", 0]),
        (
            ("unregisterService", "/other", "/t", "rosrpc://n:1"),
            [1, "[rosrpc://n:1] is no longer the current service api handle for [/t]", 0],
        ),
        (("unsubscribeParam", "/n", URI, "/p"), [1, "Unsubscribe to parameter [/p]", 1]),
        (("deleteParam", "/n", "/p"), [-1, "parameter [/p] is not set", 0]),
        (("getParam", "/n", "/p"), [-1, "Parameter [/p] is not set", 0]),
        (("setParam", "/n", "/", 5), [-1, f"{INVALID}: cannot set root of parameter tree to non-dictionary", 0]),
        (("setParam", "/n", "/p", 2**31), [-1, f"{INVALID}: the integer 2147483648 does not fit XML-RPC's 32 bits", 0]),
        (("hasParam", "/n", "/p"), [1, "/p", False]),
        (("searchParam", "/n", "~p"), [0, "Internal failure: invalid key", 0]),
        (("searchParam", "n", "p"), [0, "Internal failure: namespace must be global", 0]),
        (("searchParam", "/n", "p"), [-1, "Cannot find parameter [p] in an upwards search", ""]),
        (("searchParam", "/n/m", "set"), [1, "Found [/set]", "/set"]),
        (("lookupNode", "/n", "/nobody"), [-1, "unknown node [/nobody]", ""]),
        (("lookupNode", "/n", "/other"), [1, "node api", "http://o:1/"]),
        (("lookupService", "/n", "/nothing"), [-1, "no provider", ""]),
        (("lookupService", "/n", "/offered"), [1, "rosrpc URI: [rosrpc://o:2]", "rosrpc://o:2"]),
        (("getPid", "/n"), [1, "", os.getpid()]),
        (("getUri", "/n"), [1, "", "http://master:1/"]),
        (("getParamNames", "/n"), [1, "Parameter names", ["/set"]]),
        (("getParam", "/n", "/set"), [1, "Parameter [/set]", 1]),
        (("getTopicTypes", "/n"), [1, "current system state", []]),
        (("getPublishedTopics", "/n", ""), [1, "current topics", []]),
        (("getSystemState", "/n"), [1, "current system state", [[], [], [["/offered", ["/other"]]]]]),
    ],
)  # fmt: skip
def test_call_that_changes_nothing_writes_nothing(
    master: Recorded, call: tuple[str, ...], answer: Answer
) -> None:
    master.call("registerService", "/other", "/offered", "rosrpc://o:2", "http://o:1/")
    master.call("setParam", "/other", "/set", 1)
    assert master.call(*call) == answer
    assert master.done == master.lines == []


def test_older_node_of_a_name_is_stopped_before_the_change_is_recorded(master: Recorded) -> None:
    """The older node's subscriptions are removed with it, so replaying the journal must remove them too."""
    master.call("registerSubscriber", "/s", "/t", "*", "http://s:1/")
    master.call("registerPublisher", "/n", "/t", "a/B", "http://old:1/")
    for call, record in (
        (("registerPublisher", "/n", "/u", "a/B", URI), ["+pub", "/n", "/u", "a/B", URI]),
        (("registerSubscriber", "/n", "/u", "*", "http://n:2/"), ["+sub", "/n", "/u", "*", "http://n:2/"]),
        (("subscribeParam", "/n", "http://n:3/", "/p"), ["+par", "/n", "/p", "http://n:3/"]),
        (
            ("registerService", "/n", "/srv", "rosrpc://n:2", "http://n:4/"),
            ["+srv", "/n", "/srv", "rosrpc://n:2", "http://n:4/"],
        ),
    ):
        assert master.call(*call)[0] == 1
        stops = [index for index, each in enumerate(master.done) if isinstance(each, NodeShutdown)]
        assert stops == [0]
        assert master.done.index(record) > 0


def test_more_than_two_hundred_notices_are_sent_in_steps(master: Recorded) -> None:
    for count, steps in ((200, 0), (201, 1), (400, 2)):
        while master.registry.count_subscribers("/t") < count:
            number = master.registry.count_subscribers("/t")
            master.call("registerSubscriber", f"/s{number}", "/t", "*", f"http://s:{number + 1}/")
        for call in (("registerPublisher", "/n", "/t", "a/B", URI), ("unregisterPublisher", "/n", "/t", URI)):
            master.done.clear()
            answer = master.dispatch(call[0], call[1:])
            if not steps:
                assert isinstance(answer, list)
            else:
                assert isinstance(answer, Generator)
                # One notification is sent immediately if the name may have been taken over.
                assert sum(1 for _ in answer) == (steps if call[0].startswith("un") else (count - 1) // 200)
            assert sum(isinstance(each, PublisherUpdate) for each in master.done) == count


def test_notices_about_a_parameter_are_sent_in_steps_too(master: Recorded) -> None:
    for number in range(201):
        master.call("subscribeParam", f"/s{number}", f"http://s:{number + 1}/", "/p")
    for call in (("setParam", "/n", "/p", 1), ("deleteParam", "/n", "/p")):
        master.done.clear()
        answer: Any = master.dispatch(call[0], call[1:])
        assert list(answer) == [None]
        assert sum(isinstance(each, ParameterUpdate) for each in master.done) == 201


def test_large_value_is_stored_before_it_is_set(master: Recorded) -> None:
    value = list(range(5000))
    steps: Any = master.dispatch("setParam", ["/n", "/p", value])
    assert next(steps) is ALONE
    while not master.stored:
        assert not master.parameters.has("/p")
        next(steps)
    assert master.done == []
    assert finish(steps) == [1, "parameter /p set", 0]
    assert master.stored == [value]
    assert master.done == [["put", "/p", 7]]
    assert master.parameters.get("/p") == value


def test_small_value_is_counted_in_steps_where_there_may_be_no_room(master: Recorded) -> None:
    master.parameters._bytes = master.parameters._most - 10
    steps: Any = master.dispatch("setParam", ["/n", "/p", "x"])
    assert next(steps) is ALONE
    assert finish(steps) == [1, "parameter /p set", 0]
    assert master.stored == []
    assert master.done == [["set", "/p", "x"]]


def test_large_value_that_cannot_be_set_is_refused(master: Recorded) -> None:
    values: list[tuple[str, object, str]] = [
        ("/p", [0] * 5000 + [2**31], "the integer 2147483648 does not fit XML-RPC's 32 bits"),
        ("/", [0] * 5000, "cannot set root of parameter tree to non-dictionary"),
    ]
    for name, value, why in values:
        assert master.call("setParam", "/n", name, value) == [-1, f"{INVALID}: {why}", 0]
        assert master.done == []


def test_master_without_a_journal_stores_nothing() -> None:
    class Plain(Recorded):
        def __init__(self) -> None:
            super().__init__()
            MasterApi.__init__(self)

    master = Plain()
    assert finish(master.store([1])) == 0
    assert master.call("setParam", "/n", "/p", list(range(5000))) == [1, "parameter /p set", 0]
    assert master.call("registerPublisher", "/n", "/t", "a/B", URI)[0] == 1


def test_names_of_many_parameters_come_in_steps(master: Recorded) -> None:
    table = {f"p{number}": number for number in range(3000)}
    master.call("setParam", "/n", "/t", table)
    steps: Any = master.dispatch("getParamNames", ["/n"])
    assert sum(1 for _ in steps) == 3
    assert master.call("getParamNames", "/n") == [1, "Parameter names", [f"/t/{name}" for name in table]]


def test_shutdown_takes_a_message_or_none(master: Recorded, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    for args in (["/n"], ["/n", "the \x1breason"]):
        assert master.call("shutdown", *args) == [1, "shutdown", 0]
        assert master.done == ["stop"]
    assert [each.getMessage() for each in caplog.records] == [
        "shutdown request from /n: ",
        "shutdown request from /n: the \\x1breason",
    ]
    assert master.call("shutdown", "/n", "a", "b") == [-1, "Error: bad call arity", 0]


def test_method_that_is_not_there_is_rosmasters_fault(master: Recorded) -> None:
    with pytest.raises(RpcFault) as caught:
        master.call("nothing", "/n")
    assert caught.value.text == "<class 'Exception'>:method \"nothing\" is not supported"


@pytest.mark.parametrize(
    ("method", "value"),
    [
        ("getPid", -1),
        ("getUri", ""),
        ("shutdown", 0),
        ("lookupNode", ""),
        ("lookupService", ""),
        ("getSystemState", [[], [], []]),
        ("getTopicTypes", []),
        ("getPublishedTopics", 0),
        ("registerPublisher", []),
        ("unregisterPublisher", 0),
        ("registerSubscriber", []),
        ("unregisterSubscriber", 0),
        ("registerService", 0),
        ("unregisterService", 0),
        ("getParam", 0),
        ("setParam", 0),
        ("hasParam", False),
        ("deleteParam", 0),
        ("searchParam", 0),
        ("getParamNames", []),
        ("subscribeParam", 0),
        ("unsubscribeParam", 0),
        ("minirospy.status", {}),
    ],
)
def test_call_without_arguments_has_the_value_that_refuses(
    master: Recorded, method: str, value: object
) -> None:
    answer = master.call(method)
    assert answer == [-1, "missing required caller_id parameter", value]
    assert type(answer[2]) is type(value)


def test_arguments_are_named_as_by_rosmaster(master: Recorded) -> None:
    calls: list[tuple[str, tuple[str, ...], str]] = [
        ("registerPublisher", ("", "a/B", URI), "topic"),
        ("registerSubscriber", ("/t", "", URI), "topic_type"),
        ("registerService", ("", "rosrpc://n:1", URI), "service"),
        ("lookupNode", ("",), "node"),
        ("lookupService", ("",), "service"),
    ]
    for method, args, name in calls:
        assert master.call(method, "/n", *args)[1] == f"ERROR: parameter [{name}] must be a non-empty string"
    calls = [
        ("registerPublisher", ("/t", "a/B", ""), "caller_api"),
        ("unregisterPublisher", ("/t", ""), "caller_api"),
        ("registerService", ("/s", "", URI), "service_api"),
        ("registerService", ("/s", "rosrpc://n:1", ""), "caller_api"),
        ("unregisterService", ("/s", ""), "service_api"),
        ("subscribeParam", ("", "/p"), "caller_api"),
        ("unsubscribeParam", ("", "/p"), "caller_api"),
    ]
    for method, args, name in calls:
        assert master.call(method, "/n", *args)[1] == f"ERROR: parameter [{name}] is not an XMLRPC URI"
    for method in ("getParam", "hasParam", "deleteParam", "searchParam"):
        assert master.call(method, "/n", "")[1] == "ERROR: parameter [key] must be specified and non-empty"

    assert master.call("setParam", "/n", "", 1)[1] == "ERROR: parameter [key] must be specified and non-empty"
    assert master.call("getPublishedTopics", "/n", 5)[1] == "ERROR: parameter [subgraph] must be a string"


def test_keys_of_a_node_end_without_a_slash() -> None:
    assert [key_of_node(key) for key in ("/", "/a", "/a/", "/a/b//")] == ["/", "/a", "/a", "/a/b"]


def test_subscription_that_is_refused_leaves_nothing_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    master = Recorded()
    master.call("subscribeParam", "/n", URI, "/p")
    monkeypatch.setattr(registry_limits, "MAX_ENTRIES", 1)
    assert master.call("subscribeParam", "/n", URI, "/q")[0] == -1
    assert master.parameters.subscribed_keys(URI) == ["/p/"]
    monkeypatch.setattr(registry_limits, "MAX_ENTRIES", 10)
    monkeypatch.setattr(parameters, "MAX_SUBSCRIPTIONS", 0)
    master = Recorded()
    assert master.call("subscribeParam", "/n", URI, "/p")[0] == -1
    assert master.registry.nodes() == {}
    assert master.done == []


@pytest.mark.parametrize(("items", "is_short"), [(200, True), (400, False), (1900, False)])
def test_answer_of_more_than_300_items_is_made_in_steps(items: int, is_short: bool) -> None:
    # A thousand clients may request it at the same time.
    master = Recorded()
    master.parameters.set("/p", list(range(items)), "")
    answer = master.dispatch("getParam", ("/n", "/p"))
    assert isinstance(answer, Generator) is not is_short
    found = finish(answer) if isinstance(answer, Generator) else answer
    assert found == [1, "Parameter [/p]", list(range(items))]


@pytest.mark.parametrize(
    "call",
    [
        ("getParamNames", "/n"),
        ("getParam", "/n", "/"),
        ("getTopicTypes", "/n"),
        ("getPublishedTopics", "/n", ""),
        ("getSystemState", "/n"),
    ],
)
def test_long_lists_are_made_one_at_a_time(call: tuple[str, ...]) -> None:
    master = Recorded()
    for number in range(5000):
        master.parameters.set(f"/p{number}", number, "", 200)
        master.registry.register_publisher("/n", f"/t{number}", "a/B", URI)
    steps = master.dispatch(call[0], call[1:])
    # Nothing is collected yet for a client that must wait.
    assert isinstance(steps, Generator)
    assert next(steps) is ALONE
    assert finish(steps)[0] == 1
