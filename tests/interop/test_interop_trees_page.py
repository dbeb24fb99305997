"""Topics, nodes and parameters as trees by namespace, in Debian's chromium."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from std_msgs.msg import Float64

from tests.interop.browser import Page
from tests.interop.test_interop_dashboard import address, browse, needs_chromium, serve
from tests.waiting import wait_until
from tests.web.dashboard.conftest import Served

__all__ = ["browse", "serve"]

SHOWN = "[...document.querySelectorAll('{}')].filter(e => e.getClientRects().length).map(e => e.textContent)"
FOLDER = "[data-folder='{}'] button"


def shown(page: Page, find: str) -> list[str]:
    found: list[str] = page.evaluate(SHOWN.format(find))
    return found


def fill(served: Served, count: int) -> list[Any]:
    nodes = [served.node("a"), served.node("b")]
    kept: list[Any] = []

    async def advertise() -> None:
        for number in range(count):
            topic = f"/robot/part_{number % 6}/topic_{number:03d}"
            kept.append(await nodes[number % 2].advertise(topic, Float64))
            await nodes[0].set_param(f"/gains/joint_{number % 6}/p_{number:03d}", number)

    served.run(advertise())
    return kept


@needs_chromium
def test_topics_of_folded_namespaces_are_not_subscribed(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    kept = fill(served, 300)
    page = browse(address(served, "topics"))
    page.wait_text(".bar", "301 of 301 topics")
    page.wait_text(FOLDER.format("/robot/part_2"), "part_2/50 inside")
    assert shown(page, '.row[data-topic^="/robot/"] .name') == []
    graph = served.dashboard.bridge.graph  # type: ignore[union-attr]
    assert not [topic for topic in graph.topics if topic.startswith("/robot/")]

    page.click(FOLDER.format("/robot/part_2"))
    page.wait("return document.querySelectorAll(\".row[data-topic^='/robot/']:not([hidden])\").length === 50")
    assert shown(page, '.row[data-topic^="/robot/"] .name')[:2] == ["topic_002", "topic_008"]
    wait_until(lambda: "/robot/part_2/topic_008" in graph.topics)
    assert "/robot/part_3/topic_009" not in graph.topics
    page.click(FOLDER.format("/robot/part_2"))
    page.wait("return document.querySelectorAll(\".row[data-topic^='/robot/']:not([hidden])\").length === 0")

    # A filter keeps the path of what it finds.
    page.type("input[type=search]", "topic_017")
    page.wait("return document.querySelectorAll(\".row[data-topic^='/robot/']:not([hidden])\").length === 1")
    assert shown(page, '.row[data-topic^="/robot/"] .name') == ["/robot/part_5/topic_017"]
    page.type("input[type=search]", "topic_01")
    page.wait("return document.querySelectorAll(\".row[data-topic^='/robot/']:not([hidden])\").length === 10")
    page.type("input[type=search]", "")
    page.wait("return document.querySelectorAll(\".row[data-topic^='/robot/']:not([hidden])\").length === 0")
    assert kept


@needs_chromium
def test_topic_of_a_link_is_open_in_its_folder(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    kept = fill(served, 300)
    page = browse(address(served, "topics?open=/robot/part_5/topic_299"))
    page.wait(
        "const box = document.querySelector(\".row[data-topic='/robot/part_5/topic_299']\")?.getBoundingClientRect();"
        "return box?.height && box.top >= 0 && box.bottom < innerHeight + 1"
    )
    assert kept


@needs_chromium
def test_parameters_are_folded_and_set_in_their_folder(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    kept = fill(served, 90)
    page = browse(address(served, "parameters"))
    page.wait_text(".bar", "90 of 90 parameters")
    page.click(FOLDER.format("/gains/joint_4"))
    page.wait_text(".row.parameter .name", "p_004")
    row = ".row.parameter[data-name='/gains/joint_4/p_010']"
    page.type(f"{row} input", "5.5")
    page.evaluate(f"document.querySelector({json.dumps(row)}).requestSubmit()")
    node = served.node_of_dashboard
    # The field shows what was typed at once, so only the master can tell when the parameter is set.
    wait_until(lambda: served.run(node.get_param("/gains/joint_4/p_010")) == 5.5)
    page.wait_text(".bar", "90 of 90 parameters")
    page.wait(f"return document.querySelector({json.dumps(row + ' input')}).value === '5.5'")
    assert kept


@needs_chromium
def test_nodes_are_a_tree_unless_they_are_sorted(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()

    async def start() -> None:
        from minirospy import Node

        for number in range(24):
            node = Node(f"node_{number:02d}", namespace=f"/robot/arm_{number % 2}")
            await node.start()
            served.nodes.append(node)

    served.run(start())
    page = browse(address(served, "nodes"))
    page.wait_text(FOLDER.format("/robot/arm_1"), "arm_1/12 inside")
    page.click(FOLDER.format("/robot/arm_1"))
    page.wait("return document.querySelector(\"tr[data-node='/robot/arm_1/node_01']\").hidden")
    page.click("tr[data-node='/robot/arm_0/node_02'] button", "node_02")
    page.wait_text(".side h2", "/robot/arm_0/node_02")
    page.click("th button", "Memory")
    page.wait("return !document.querySelector('[data-folder]')")
    page.wait_text("tr[data-node='/robot/arm_1/node_01'] button", "/robot/arm_1/node_01")
