"""The tools' endpoint over WebSocket: requests from the page for which the Foxglove protocol has no message."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any
from xmlrpc.client import ServerProxy

import pytest
from std_msgs.msg import String
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from minirospy.web.access import Access
from minirospy.web.dashboard import tools_endpoint
from minirospy.web.dashboard.tools_endpoint import SUBPROTOCOL

if TYPE_CHECKING:
    from minirospy.introspect.graph import Graph
    from minirospy.introspect.processes import ProcessLoads
    from minirospy.introspect.survey import Survey
    from tests.web.dashboard.conftest import Served


class Tools:
    """A client of the endpoint."""

    def __init__(self, served: Served, token: str = "") -> None:
        names = [Subprotocol(SUBPROTOCOL)] + ([Subprotocol(f"minirospy.token.{token}")] if token else [])
        self._stack = contextlib.ExitStack()
        self.socket = self._stack.enter_context(
            connect(f"ws://127.0.0.1:{served.port}/", subprotocols=names, compression=None, open_timeout=100)
        )

    def receive(self) -> dict[str, Any]:
        found: dict[str, Any] = json.loads(self.socket.recv(timeout=60))
        return found

    def request(self, **fields: object) -> dict[str, Any]:
        """Return the response to a request."""
        self.socket.send(json.dumps({"id": 7, **fields}))
        while (found := self.receive()).get("id") != 7:
            pass
        return found

    def __enter__(self) -> Tools:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()


def test_values_of_a_file_are_read(serve: Callable[..., Served]) -> None:
    of_ros = (
        "!!python/object/new:dynamic_reconfigure.encoding.Config\ndictitems:\n  angle: .inf\n  label: 2026-01-01\n"
        "  groups: !!python/object/new:dynamic_reconfigure.encoding.Config\n    dictitems: {id: 0}\n    state: []\n"
        "  is_on: true\n  nothing: null\nstate: []\n"
    )
    with Tools(serve()) as tools:
        assert tools.request(do="yaml", text="power: 3\n---\npower: 4\nlabel: a b\n")["result"] == {
            "power": 4,
            "label": "a b",
        }
        assert tools.request(do="yaml", text=of_ros)["result"] == {
            "angle": "inf",
            "label": "2026-01-01",
            "is_on": True,
        }
        assert "not YAML" in tools.request(do="yaml", text="{")["error"]
        assert "is not a dictionary" in tools.request(do="yaml", text="- 1")["error"]
        bomb = "a0: &a0 [1, 1]\n" + "".join(f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}]\n" for n in range(1, 60))
        assert "unfold to more than" in tools.request(do="yaml", text=bomb)["error"]
        tools.socket.send(json.dumps({"id": 8, "do": "yaml", "text": "a" * 100_000}))
        assert "100000 characters at most" in tools.receive()["error"]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        '{"id": 1}',
        '{"id": "x", "do": "yaml"}',
        '{"id": 1, "do": "exec"}',
        '{"id": 1, "do": []}',
        '{"id": Infinity, "do": "yaml"}',
    ],
)
def test_invalid_request_is_refused(serve: Callable[..., Served], text: str) -> None:
    with Tools(serve()) as tools:
        tools.socket.send(text)
        assert tools.receive()["error"].startswith("not an operation on the graph")
        tools.socket.send(b"\0")
        assert "binary" in tools.receive()["error"]
        assert tools.request(do="yaml", text="a: 1")["result"] == {"a": 1}


def report(tools: Tools, accepts: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """Return the first report that ``accepts`` accepts."""
    while True:
        found = tools.receive()
        if "report" in found and accepts(found["report"]):
            return dict(found["report"])


def node_in(found: dict[str, Any], name: str) -> dict[str, Any]:
    return next((each for each in found.get("nodes", ()) if each["name"] == name), {})


def test_nodes_are_reported_while_watched(
    serve: Callable[..., Served], monkeypatch: pytest.MonkeyPatch
) -> None:
    # On a busy machine a response may arrive late.
    monkeypatch.setattr("minirospy.introspect.doctor.graph.CONNECT_SECONDS", 30.0)
    served = serve()
    talker = served.node("talker")

    async def advertise() -> None:
        talker.advertise("/words", String)

    served.run(advertise())
    with Tools(served) as tools:
        assert tools.request(do="watch")["result"] == {}
        found = report(tools, lambda each: node_in(each, "/talker"))
        node = node_in(found, "/talker")
        assert node["pid"] == os.getpid()
        assert ["/words", "std_msgs/String"] in node["publishes"]
        assert node["trouble"] == ""
        with Tools(served) as other:
            other.request(do="watch")
            report(other, lambda each: node_in(each, "/talker"))
        assert tools.request(do="unwatch")["result"] == {}
        assert tools.request(do="watch")["result"] == {}
        report(tools, lambda each: node_in(each, "/talker"))


def test_node_is_pinged_and_killed(serve: Callable[..., Served]) -> None:
    served = serve()
    stopped = threading.Event()
    victim = served.node("victim")

    async def watch() -> None:
        task = asyncio.ensure_future(victim.spin())
        task.add_done_callback(lambda _: stopped.set())

    served.run(watch())
    with Tools(served) as tools:
        assert 0 < tools.request(do="ping", node="/victim")["result"]["seconds"] < 60
        assert "victi" in tools.request(do="ping", node="/victi")["error"]
        assert tools.request(do="kill", node="/victim")["result"] == {}
    assert stopped.wait(60)


def test_parameter_is_parsed_as_by_rosparam(serve: Callable[..., Served]) -> None:
    served = serve()
    node = served.node("robot")
    cases: dict[str, tuple[str, object]] = {
        "5": ("int", 5), "5.0": ("double", 5.0), "yes": ("bool", True), "1e3": ("string", "1e3"), "": ("string", ""),
        "[1, 2.0, a b]": ("list", [1, 2.0, "a b"]), "'5'": ("string", "5"), "{gain: 0.5}": ("dictionary", {"gain": 0.5}),
    }  # fmt: skip
    with Tools(served) as tools:
        for text, (type_, value) in cases.items():
            assert tools.request(do="value", text=text)["result"]["type"] == type_, text
            assert tools.request(do="set", name="/p", text=text)["result"] == {}
            found = served.run(node.get_param("/p"))
            assert (found, type(found)) == (value, type(value))
        assert "null" in tools.request(do="set", name="/p", text="null")["error"]
        assert "32 bits" in tools.request(do="value", text="5000000000")["error"]
        assert "error" in tools.request(do="value", text="[1")
        assert "error" in tools.request(do="set", name="/a b", text="1")


def test_kill_of_a_node_that_has_exited_is_an_error(serve: Callable[..., Served]) -> None:
    served = serve()
    with ServerProxy(os.environ["ROS_MASTER_URI"]) as master:
        answer = master.registerPublisher("/dead", "/nothing", "std_msgs/String", "http://127.0.0.1:1/")
        assert answer[0] == 1, answer  # type: ignore[index]
    with Tools(served) as tools:
        assert "node [/dead] does not answer" in tools.request(do="kill", node="/dead")["error"]


def test_cleanup_unregisters_nodes_that_do_not_answer_and_no_others(serve: Callable[..., Served]) -> None:
    served = serve()
    served.node("alive")
    with ServerProxy(os.environ["ROS_MASTER_URI"]) as master:
        for name in ("/dead", "/dead_too"):
            answer = master.registerPublisher(name, "/nothing", "std_msgs/String", "http://127.0.0.1:1/")
            assert answer[0] == 1, answer  # type: ignore[index]
        with Tools(served) as tools:
            tools.request(do="watch")
            found = report(tools, lambda each: node_in(each, "/dead"))
            assert "nothing listens at their port on '127.0.0.1'" in node_in(found, "/dead")["trouble"]
            assert "rosnode cleanup" in node_in(found, "/dead")["advice"]
            assert tools.request(do="cleanup", nodes=["/dead", "/alive"])["result"] == ["/dead"]
            assert "is a list" in tools.request(do="cleanup", nodes="/alive")["error"]
        state: Any = master.getSystemState("/test")
    publishers = dict(map(tuple, state[2][0]))
    assert publishers["/nothing"] == ["/dead_too"]


def test_reader_kills_and_removes_nothing(serve: Callable[..., Served]) -> None:
    served = serve(
        access=Access(read_token="read-token-00", write_token="write-token-0", requires_token=True)
    )
    served.node("victim")
    with Tools(served, "read-token-00") as tools:
        assert "read-only" in tools.request(do="kill", node="/victim")["error"]
        assert "read-only" in tools.request(do="cleanup", nodes=["/victim"])["error"]
        assert "read-only" in tools.request(do="set", name="/p", text="1")["error"]
        assert tools.request(do="ping", node="/victim")["result"]


def test_definition_of_a_type_is_that_of_the_packages(serve: Callable[..., Served]) -> None:
    with Tools(serve()) as tools:
        found = tools.request(do="type", name="actionlib_tutorials/FibonacciActionGoal")["result"]
        assert "MSG: actionlib_tutorials/FibonacciGoal" in found["definition"]
        assert "no_such/Type" in tools.request(do="type", name="no_such/Type")["error"]


def test_type_of_a_topic_that_is_only_subscribed_is_known(serve: Callable[..., Served]) -> None:
    from geometry_msgs.msg import Twist

    served = serve()
    robot = served.node("robot")

    async def listen() -> object:
        return await robot.subscribe("/cmd_vel", Twist)

    subscription = served.run(listen())
    with Tools(served) as tools:
        found = tools.request(do="type", topic="/cmd_vel")["result"]
        assert found["name"] == "geometry_msgs/Twist"
        assert "Vector3" in found["definition"]
        assert "topic [/nobody] not found" in tools.request(do="type", topic="/nobody")["error"]
    assert subscription


@pytest.mark.parametrize(
    "error",
    [OSError("no space"), RecursionError("too deep"), OverflowError("too large"), ZeroDivisionError("by 0")],
)
def test_request_that_fails_in_any_way_is_answered(
    serve: Callable[..., Served], monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    def fail(_: str) -> None:
        raise error

    monkeypatch.setattr(tools_endpoint, "parameter_values", fail)
    with Tools(serve()) as tools:
        answer = tools.request(do="yaml", text="a: 1")["error"]
        assert str(error) in answer or answer == "the dashboard failed on this operation: ZeroDivisionError"
        assert "node is missing" in tools.request(do="ping")["error"]


def test_survey_that_fails_is_reported_and_repeated(
    serve: Callable[..., Served], monkeypatch: pytest.MonkeyPatch
) -> None:
    survey = tools_endpoint.survey
    failed = threading.Event()

    def fail_once(graph: Any, processes: Any) -> Any:
        if not failed.is_set():
            failed.set()
            raise OSError("no more files")
        return survey(graph, processes)

    monkeypatch.setattr(tools_endpoint, "survey", fail_once)
    monkeypatch.setattr(tools_endpoint, "REPORT_SECONDS", 0.05)
    with Tools(serve()) as tools:
        tools.request(do="watch")
        report(tools, lambda each: "no more files" in each.get("trouble", ""))
        report(tools, lambda each: "nodes" in each)


def test_surveys_do_not_pile_up_if_watching_is_toggled(
    serve: Callable[..., Served], monkeypatch: pytest.MonkeyPatch
) -> None:
    running, most = [0], [0]
    lock, go_on = threading.Lock(), threading.Event()
    survey = tools_endpoint.survey

    def slow(graph: Any, processes: Any) -> Any:
        with lock:
            running[0] += 1
            most[0] = max(most[0], running[0])
        go_on.wait(60)
        with lock:
            running[0] -= 1
        return survey(graph, processes)

    monkeypatch.setattr(tools_endpoint, "survey", slow)
    with Tools(serve()) as tools:
        for _ in range(5):
            tools.request(do="watch")
            tools.request(do="unwatch")
        tools.request(do="watch")
        go_on.set()
        report(tools, lambda each: "nodes" in each)
    assert most == [1]


def test_request_that_fails_is_answered_and_reports_go_on(
    serve: Callable[..., Served], monkeypatch: pytest.MonkeyPatch
) -> None:
    served = serve()
    served.node("talker")
    faults = iter([ZeroDivisionError])
    survey = tools_endpoint.survey

    def failing(graph: Graph, processes: ProcessLoads) -> Survey:
        for fault in faults:
            raise fault
        return survey(graph, processes)

    def ping(*_: object) -> float:
        raise ZeroDivisionError

    monkeypatch.setattr(tools_endpoint, "survey", failing)
    monkeypatch.setattr(tools_endpoint, "ping_node", ping)
    with Tools(served) as tools:
        failed = "the dashboard failed on this operation: ZeroDivisionError"
        assert tools.request(do="ping", node="/talker")["error"] == failed
        tools.request(do="watch")
        report(tools, lambda each: node_in(each, "/talker"))
