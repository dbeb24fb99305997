"""The information that nodes report: processes, types, and the traffic of their connections."""

from __future__ import annotations

from typing import Any

import pytest
from std_msgs.msg import Bool, String

from minirospy import Node
from minirospy.base.errors import MinirospyError
from minirospy.introspect.configurations import parameter_values
from minirospy.introspect.doctor.graph import NodeAnswer
from minirospy.introspect.doctor.reach import MasterLocation
from minirospy.introspect.graph import Graph, NodeAddress
from minirospy.introspect.survey import Edge, Survey, connection_counts, describe, survey, traffic
from minirospy.runtime.rpc.master_proxy import BusConnection, SystemState
from minirospy.runtime.transport.loop import LoopThread

PLACE = MasterLocation("localhost", 11311, ["127.0.0.1"])


def answer(stats: object, pid: int = 5) -> NodeAnswer:
    """Return the response of a node /a that sends /t to /b on connection 1 and to /c on connection 2."""
    links = (
        BusConnection(1, "/b", "o", "TCPROS", "/t"),
        BusConnection(2, "/c", "o", "TCPROS", "/t"),
        BusConnection(3, "http://x/", "i", "TCPROS", "/u"),
    )
    return NodeAnswer(
        NodeAddress("/a", "http://localhost:1/"),
        None,
        {"/t": "std_msgs/Bool"},
        {},
        links,
        pid,
        0.001,
        (stats, [], []),
    )


def looked(seconds: float, stats: object, pid: int = 5) -> Survey:
    found = answer(stats, pid)
    state = SystemState({"/t": ["/a"]}, {"/t": ["/b", "/c"]}, {"/s": ["/a"]})
    return Survey(seconds, state, {"/a": found}, PLACE, connection_counts(found))


@pytest.mark.parametrize(
    ("before", "after"),
    [
        # The first format is rospy's and minirospy's, the second roscpp's.
        (
            [["/t", 0, [[1, 100, 10, True], [2, 0, 0, True]]]],
            [["/t", 0, [[1, 300, 20, True], [2, 8, 1, True]]]],
        ),
        ([["/t", [[1, 100, 90, 10, 0], [2, 0, 0, 0, 0]]]], [["/t", [[1, 300, 280, 20, 0], [2, 8, 4, 1, 0]]]]),
    ],
)
def test_traffic_is_the_difference_of_two_counts(before: object, after: object) -> None:
    assert traffic(looked(10, before), looked(12, after)) == {
        Edge("/a", "/t", "/b"): (5.0, 100.0),
        Edge("/a", "/t", "/c"): (0.5, 4.0),
    }


def test_traffic_omits_incomparable_counts() -> None:
    first = looked(10, [["/t", 0, [[1, 100, 10, True]]]])
    assert traffic(None, first) == {}
    assert traffic(first, first) == {}
    # There is no traffic for another process with the same name, a counter that wrapped around, or a new connection.
    assert traffic(first, looked(12, [["/t", 0, [[1, 300, 20, True]]]], pid=6)) == {}
    assert traffic(first, looked(12, [["/t", 0, [[1, 3, 20, True]]]])) == {}
    assert traffic(first, looked(12, [["/t", 0, [[2, 300, 20, True]]]])) == {}


@pytest.mark.parametrize(
    "stats", [0, None, [1], [["/t"]], [["/t", 0, [[1]]]], [["/t", 0, 5]], [["/t", 0, [["x", "y", "z"]]]]]
)
def test_rows_that_are_not_as_documented_count_nothing(stats: object) -> None:
    assert connection_counts(answer(stats)) == {}


def test_description_has_nodes_and_what_is_wrong_with_them() -> None:
    found = describe(looked(1, []))
    assert found["mismatches"] == {}
    (node,) = found["nodes"]  # type: ignore[misc]
    assert (node["name"], node["pid"], node["host"]) == ("/a", 5, "localhost")
    assert (node["publishes"], node["services"]) == ([["/t", "std_msgs/Bool"]], ["/s"])


def test_description_says_how_large_messages_are_sent() -> None:
    info = "UNIXROS connection to [unix on socket 1]; 3 of 4 large messages by shared memory"
    links = (
        BusConnection(1, "/b", "o", "TCPROS", "/t", True, info),
        BusConnection(2, "/c", "o", "TCPROS", "/t"),
    )
    node = NodeAnswer(NodeAddress("/a", "http://localhost:1/"), links=links)
    found = describe(Survey(1, SystemState({}, {}, {}), {"/a": node}, PLACE))
    (row,) = found["nodes"]  # type: ignore[misc]
    assert row["links"] == [
        ["/t", "o", "/b", "UNIXROS", True, [3, 4, ""]],
        ["/t", "o", "/c", "TCPROS", True, None],
    ]


def test_nodes_are_queried_and_their_traffic_is_counted(master: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # On a busy machine, a response may arrive late.
    monkeypatch.setattr("minirospy.introspect.doctor.graph.CONNECT_SECONDS", 30.0)
    loop = LoopThread("test-survey")
    nodes: list[Node] = []
    kept: list[object] = []

    async def build() -> tuple[Any, Any]:
        for name in ("talker", "listener", "other"):
            nodes.append(Node(name))
            await nodes[-1].start()
        publisher = nodes[0].advertise("/words", String, queue_size=None)
        subscription = await nodes[1].subscribe("/words", String)
        await publisher.wait_for_subscribers(timeout=60)
        kept.append(await nodes[2].subscribe("/words", Bool))
        return publisher, subscription

    async def send(publisher: Any, subscription: Any, count: int) -> None:
        for _ in range(count):
            await publisher.publish("word")
            await subscription.next(60)

    async def close() -> None:
        for node in nodes:
            await node.close()

    try:
        publisher, subscription = loop.run(build(), 60)
        with Graph.open("test") as graph:
            loop.run(send(publisher, subscription, 1), 60)
            before = survey(graph)
            loop.run(send(publisher, subscription, 9), 60)
            after = survey(graph)
        edge = Edge("/talker", "/words", "/listener")
        hz, size = traffic(before, after)[edge]
        span = after.seconds - before.seconds
        assert round(hz * span) == 9
        assert round(size * span) >= 9 * len("word")
        assert set(after.answers) >= {"/talker", "/listener", "/other"}
        assert after.answers["/talker"].pid > 0
        assert describe(after, before)["mismatches"] == {
            "/words": {"std_msgs/Bool": ["/other"], "std_msgs/String": ["/listener", "/talker"]}
        }
    finally:
        loop.run(close(), 60)
        loop.close()


def test_counts_that_are_not_finite_are_left_out() -> None:
    assert connection_counts(answer([["/t", 0, [[1, float("inf"), float("inf"), True]]]])) == {}


@pytest.mark.parametrize("text", ["a: !!bool x", "a: !!timestamp x", "a: !!int ''", "a: !!float ''"])
def test_configuration_whose_tag_does_not_fit_is_refused(text: str) -> None:
    with pytest.raises(MinirospyError, match="not YAML: a tag"):
        parameter_values(text)
