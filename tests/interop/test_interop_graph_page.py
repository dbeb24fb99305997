"""The view Graph in Debian's chromium: traffic, dead nodes, types that differ, folded actions; pure parts under node."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any
from xmlrpc.client import ServerProxy

from std_msgs.msg import Bool, String

from tests.dashboard.conftest import Served
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

__all__ = ["browse", "serve"]

PARTS = ("goal", "cancel", "status", "feedback", "result")


def table(**rows: list[str]) -> dict[str, object]:
    """Return a Map of names below / with the nodes of each."""
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
        # The address is the same in every language.
        page.click("#language")
        page.wait_text(".bar label", "Raten")
        assert page.evaluate("[...document.querySelectorAll('.bar label')].map(e => e.firstChild.checked)") == [
            True, False, True, True,
        ]  # fmt: skip
