"""The view Graph in Debian's chromium: traffic, dead nodes, mismatched types and folded actions; its pure parts under node."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable
from typing import Any
from xmlrpc.client import ServerProxy

from std_msgs.msg import Bool, String

from tests.interop.browser import Page
from tests.interop.test_interop_dashboard import (
    address,
    browse,
    needs_chromium,
    needs_node,
    publisher,
    repeated,
    serve,
)
from tests.interop.test_interop_reconfigure_page import page_functions
from tests.web.dashboard.conftest import Served

__all__ = ["browse", "serve"]

PARTS = ("goal", "cancel", "status", "feedback", "result")


def table(**rows: list[str]) -> dict[str, object]:
    """Return a JavaScript Map from each name, below /, to its nodes."""
    return {"map": [["/" + name.replace("__", "/"), nodes] for name, nodes in rows.items()]}


def elements(published: object, subscribed: object, **options: object) -> dict[str, Any]:
    graph = {"published": published, "subscribed": subscribed, "services": {"map": []}}
    asked = {"mode": "active", "hidesDebug": True, "filter": "", "ownNode": "/page", "folds": True, **options}
    (found,) = page_functions(("graph_elements", "elementsOf", [graph, asked]))
    return dict(found)


def pairs(found: dict[str, Any]) -> set[tuple[str, str]]:
    return {(edge["from"], edge["to"]) for edge in found["edges"]}


@needs_node
def test_action_is_one_element_between_its_clients_and_its_server() -> None:
    published = table(
        go__goal=["/client"], go__cancel=["/client"], **{f"go__{each}": ["/server"] for each in PARTS[2:]}
    )
    subscribed = table(
        go__goal=["/server"],
        go__cancel=["/server"],
        go__status=["/client", "/watcher", "/page"],
        go__result=["/client"],
    )
    found = elements(published, subscribed)
    assert (found["actions"], found["topics"]) == (["/go"], [])
    assert pairs(found) == {("n/client", "a/go"), ("a/go", "n/server"), ("a/go", "n/watcher")}
    assert elements(published, subscribed, folds=False)["actions"] == []
    in_nodes = elements(published, subscribed, mode="nodes")
    assert pairs(in_nodes) == {("n/client", "n/server"), ("n/server", "n/watcher")}
    assert in_nodes["edges"][0]["label"] == "/go (action)"
    assert "/client" not in elements(published, subscribed, filter="watcher")["nodes"]


@needs_node
def test_traffic_counts_a_message_once_for_several_receivers() -> None:
    rows = [
        ["/a", "/t", "/x", 10, 100],
        ["/a", "/t", "/y", 9, 90],
        ["/b", "/t", "/x", 1, 5],
        ["/a", "/u", "/x", 7, 7],
    ]
    edges = [[["/t", "/a", None]], [["/t", None, "/x"]], [["/t", "/a", "/y"]], [["/t", "/c", None]]]
    assert page_functions(*(("graph_elements", "trafficOf", [{"pairs": each}, rows]) for each in edges)) == [
        {"hz": 10, "bytes": 190},
        {"hz": 11, "bytes": 105},
        {"hz": 9, "bytes": 90},
        None,
    ]


@needs_node
def test_groups_are_namespaces_of_several_elements() -> None:
    keys = ["n/base/driver", "t/base/odom", "n/planner", "t/scan", "n/camera/driver"]
    assert page_functions(("graph_elements", "groupsOf", [keys])) == [
        {"base": ["n/base/driver", "t/base/odom"]}
    ]


@needs_node
def test_connected_keys_are_those_of_links_in_a_row() -> None:
    (found,) = page_functions(("graph_elements", "connectedOf", [list("abcdef"), ["ab", "dc", "bc", "ee"]]))
    groups = {**{key: list("abcd") for key in "abcd"}, "e": ["e"], "f": ["f"]}
    assert {key: sorted(part) for key, part in found.items()} == groups


@needs_node
def test_boxes_in_rows_fit_the_aspect_of_the_view_and_do_not_overlap() -> None:
    boxes = [{"width": 100 + 10 * (each % 3), "height": 40 + 30 * (each % 4)} for each in range(12)]
    views = (0.5, 1, 2.5)
    for aspect, found in zip(
        views,
        page_functions(*(("graph_elements", "packed", [boxes, aspect]) for aspect in views)),
        strict=True,
    ):
        assert aspect / 1.8 < found["width"] / found["height"] < aspect * 1.8
        areas = [(each["x"], each["y"], box) for each, box in zip(found["places"], boxes, strict=True)]
        assert max(x + box["width"] for x, _, box in areas) == found["width"]
        assert max(y + box["height"] for _, y, box in areas) == found["height"]
        for (x, y, box), (left, top, other) in itertools.combinations(areas, 2):
            assert (
                x + box["width"] <= left
                or left + other["width"] <= x
                or y + box["height"] <= top
                or top + other["height"] <= y
            )
    assert page_functions(("graph_elements", "packed", [[], 1])) == [{"width": 0, "height": 0, "places": []}]


@needs_chromium
def test_parts_that_are_not_connected_fill_a_narrow_view_in_rows(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    with ServerProxy(os.environ["ROS_MASTER_URI"]) as master:
        for part in range(4):
            for step in range(2):
                topic = f"/part{part}/topic{step}"
                for register, node in (("registerPublisher", step), ("registerSubscriber", step + 1)):
                    name = f"/part{part}/node{node}"
                    answer = getattr(master, register)(
                        name, topic, "std_msgs/String", f"http://127.0.0.1:{1 + node}/"
                    )
                    assert answer[0] == 1, answer
    page = browse(address(served, "graph"), width=390, height=844)
    page.wait("return document.querySelectorAll('.graph .topic').length === 8")
    places = page.evaluate(
        "[0, 1, 2, 3].map(part => document.querySelector(`[data-key='n/part${part}/node0'] rect`).getBoundingClientRect())"
        ".map(({x, y}) => [x, y])"
    )
    assert [len({each[axis] for each in places}) for axis in (0, 1)] == [2, 2]
    # Nodes that share only their namespace also form one component.
    page.click("label", "namespaces")
    page.wait("return document.querySelectorAll('.graph .namespace').length === 4")
    for key in ("n/part3/node2", "t/part0/topic1"):
        page.wait(
            f"const box = document.querySelector(\"[data-key='{key}']\").getBoundingClientRect();"
            "const view = document.querySelector('svg.graph').getBoundingClientRect();"
            "return box.left >= view.left && box.right <= view.right && box.top >= view.top && box.bottom <= view.bottom"
        )


@needs_chromium
def test_traffic_and_faults_are_shown_without_subscribing(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    kept: list[object] = []
    for name, type_ in (("listener", String), ("confused", Bool)):
        node = served.node(name)

        async def listen(node: Any = node, type_: Any = type_) -> None:
            kept.append(await node.subscribe("/robot/words", type_))

        served.run(listen())
    with ServerProxy(os.environ["ROS_MASTER_URI"]) as master:
        answer = master.registerSubscriber("/dead", "/robot/words", "std_msgs/String", "http://127.0.0.1:1/")
        assert answer[0] == 1, answer  # type: ignore[index]
    page = browse(address(served, "graph"))
    with repeated(served, publisher(served, "/robot/words", String), String("x" * 1000)):
        page.wait_text(".edge[data-to='n/listener'] .traffic", "Hz")
        page.wait_text(".edge[data-to='t/robot/words'] .traffic:last-child", "kB/s")
        page.wait_text("[role=status].error", "/robot/words has two types")
        page.wait_text("[role=status].error", "1 dead node")
        for key in ("n/dead", "t/robot/words"):
            page.wait(f"return document.querySelector(\".bad[data-key='{key}']\")")
        page.click(".graph .node", "/dead")
        page.wait_text(".side .error", "It does not answer: nothing listens at their port")
        page.click(".graph .topic", "/robot/words")
        page.wait_text(".side .error", "Use one type, or two names")
        page.wait_text(".side .error", "std_msgs/Bool: /confused")
        page.click(".graph .topic", "/robot/words")
        page.click("label", "namespaces")
        page.click("label", "rates")
        page.wait("return [...document.querySelectorAll('.traffic')].every(e => !e.textContent)")
        assert "groups=1" in page.evaluate("location.hash")
        assert "rates=0" in page.evaluate("location.hash")
        # The URL is the same in every language.
        page.click("#language")
        page.wait_text(".bar label", "Raten")
        assert page.evaluate("[...document.querySelectorAll('.bar label')].map(e => e.firstChild.checked)") == [
            True, False, True, True,
        ]  # fmt: skip


def register_dead(name: str, topic: str) -> None:
    """Register a subscriber that does not respond."""
    with ServerProxy(os.environ["ROS_MASTER_URI"]) as master:
        answer = master.registerSubscriber(name, topic, "std_msgs/String", "http://127.0.0.1:1/")
        assert answer[0] == 1, answer  # type: ignore[index]


def key_of(topic: str) -> str:
    return f".graph [data-key='t{topic}']"


@needs_chromium
def test_click_is_not_lost_while_the_graph_changes(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    for topic in ("/first", "/second", "/third"):
        register_dead("/dead", topic)
        publisher(served, topic, String)
    page = browse(address(served, "graph"))
    page.click(key_of("/first"))
    page.wait_text(".side h2", "/first")
    # The pressed topic receives the focus instead of the first one, and the graph changes before the release.
    page.press(key_of("/second"))
    register_dead("/late", "/second")
    page.wait_text("[role=status].error", "2 dead nodes")
    page.release(key_of("/second"))
    page.wait_text(".side h2", "/second")
    page.wait("return document.querySelector(\"[data-key='n/late']\")")
    # After the redraw, the keyboard focus is unchanged.
    assert page.evaluate("document.activeElement.dataset.key") == "t/second"
    # The page moves while the mouse button is pressed.
    page.press(key_of("/third"))
    x, y = middle(page, key_of("/third"))
    page.evaluate("document.querySelector('.bar').style.paddingBottom = '200px'")
    mouse(page, "mouseReleased", x, y)
    page.wait_text(".side h2", "/third")
    assert page.evaluate("document.querySelectorAll('.side h2').length") == 1


@needs_chromium
def test_drag_of_a_node_moves_the_drawing_and_a_trembling_click_does_not(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    register_dead("/dead", "/words")
    publisher(served, "/words", String)
    page = browse(address(served, "graph"))
    page.wait(f'return document.querySelector("{key_of("/words")}")')
    # The line about the dead node makes the bar higher, and the drawing is fitted again.
    page.wait_text("[role=status].error", "1 dead node")
    where = "document.querySelector('.graph > g').getAttribute('transform')"
    before = page.evaluate(where)
    drag(page, key_of("/words"), 60)
    assert page.evaluate(where) != before
    assert page.evaluate("document.querySelector('.side').hidden")
    page.click("button", "Fit")
    assert page.evaluate(where) == before
    drag(page, key_of("/words"), 2)
    page.wait_text(".side h2", "/words")
    # The graph is fitted again, because the details occupy part of the area.
    page.wait(f"return {where} !== {before!r}")


def middle(page: Page, find: str) -> tuple[float, float]:
    x, y = page.evaluate(
        f'{{ const r = document.querySelector("{find}").getBoundingClientRect();'
        "[r.x + r.width / 2, r.y + r.height / 2] }"
    )
    return x, y


def mouse(page: Page, kind: str, x: float, y: float) -> None:
    held = {} if kind == "mouseReleased" else {"buttons": 1}
    page.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1, **held)


def drag(page: Page, find: str, by: float) -> None:
    """Drag an element to the right with the mouse."""
    x, y = middle(page, find)
    mouse(page, "mousePressed", x, y)
    for part in (0.5, 1):
        mouse(page, "mouseMoved", x + by * part, y)
    mouse(page, "mouseReleased", x + by, y)
