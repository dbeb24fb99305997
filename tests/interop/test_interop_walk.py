"""Visit all views in one session of Debian's chromium, from the menu, there and back, on a desktop's and on a phone's screen."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import actionlib.msg
import pytest
from actionlib_msgs.msg import GoalStatusArray
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Image
from smach_msgs.msg import SmachContainerStatus, SmachContainerStructure
from std_msgs.msg import Bool
from std_srvs.srv import SetBool
from turtlesim.msg import Color, Pose

from minirospy.board.board import Board
from minirospy.web.dashboard.views import VIEWS
from tests.interop import robot_scene
from tests.interop.browser import Page
from tests.interop.test_interop_control_page import Manager
from tests.interop.test_interop_dashboard import address, browse, needs_chromium, publisher, statuses
from tests.web.dashboard.bags import make_bag
from tests.web.dashboard.conftest import Served, serve

__all__ = ["browse", "serve"]

SEEN = {
    "overview": ("tr[data-topic] th", "/button_state"),
    "topics": (".topic .name", "/button_state"),
    "console": (".line .text", "the battery is low"),
    "graph": ("svg.graph .node", "/talker_scan"),
    "image": ("select option", "/camera"),
    "3d": (".labels .name", "base_link"),
    "simulation": (".empty", "roslaunch gazebo_ros empty_world.launch"),
    "tf": (".tf .frame-box", "left_wheel"),
    "board": ("svg.board text", "GPIO 11"),
    "turtlesim": (".turtle-row", "/turtle1"),
    "teleop": (".teleop", "/joy"),
    "publish": ("select option", "/odometry"),
    "services": ("select option", "/set_led_state"),
    "actions": ("select option", "/count"),
    "parameters": (".row.parameter", "/robot_description"),
    "reconfigure": (".empty", "dynamic_reconfigure"),
    "nodes": (".nodes td", "/talker_scan"),
    "launch": (".launch-files button", "workshop.launch"),
    "bag": ("select option", "walk.bag"),
    "joints": (".joint .name", "left_wheel_joint"),
    "controllers": (".controllers .name", "arm"),
    "trajectory": (".joint .name", "shoulder"),
    "smach": (".smach-state", "DOCK"),
    "diagnostics": (".report", "Battery"),
    "class": (".class-table th", "Anna"),
}
"""A selector for each view, and a text that the selected element shows for the scene in any language."""

UNREACHABLE = """(() => {
  const bad = [], width = innerWidth, height = innerHeight;
  const used = "button, a, input, select, textarea, [tabindex='0'], [role=button]";
  for (const e of document.querySelectorAll(`#view :is(${used}), header :is(${used})`)) {
    if (e.disabled || !e.getClientRects().length || !e.checkVisibility({ visibilityProperty: true })) continue;
    e.scrollIntoView({ block: "nearest", inline: "nearest" });
    const r = e.getBoundingClientRect();
    const name = `${e.tagName} ${e.className} ${e.getAttribute("aria-label") ?? e.textContent}`.slice(0, 70);
    const x = r.x + r.width / 2, y = Math.min(height - 1, Math.max(0, r.y + Math.min(r.height, height) / 2));
    const top = document.elementFromPoint(x, y);
    if (r.left < -1 || r.right > width + 1) bad.push(`cut off: ${name}`);
    else if (!top || !(e.contains(top) || top.closest("label")?.contains(e))) bad.push(`covered by ${top?.tagName}: ${name}`);
  }
  const view = document.getElementById("view");
  view.scrollTop = 0;
  for (const e of [document.documentElement, view])
    if (e.scrollWidth > e.clientWidth) bad.push(`${e.tagName} is wider than the window`);
  return bad;
})()"""
"""Finds controls that cannot be reached because they are outside the window or covered by another element."""

LEFT_IN_ENGLISH = """import("/js/german.js").then(({ GERMAN }) => {
  const isLeft = (text) => text && Object.hasOwn(GERMAN, text) && GERMAN[text] !== text;
  const found = new Set();
  for (const e of document.querySelectorAll("#view *, header *")) {
    if (e.closest("svg") || !e.checkVisibility()) continue;
    const own = [...e.childNodes].filter((each) => each.nodeType === Node.TEXT_NODE).map((each) => each.data.trim());
    const spoken = ["title", "aria-label", "placeholder"].map((name) => e.getAttribute(name));
    for (const text of [...own, ...spoken]) if (isLeft(text)) found.add(text);
  }
  return [...found];
})"""


def furnish(served: Served) -> None:
    """Publish the workshop's topics, and a small robot in a room."""
    image = Image(width=4, height=2, encoding="mono8", step=4, data=bytes(range(0, 160, 20)))
    states = SmachContainerStructure(
        path="/ROOT", children=["DRIVE", "DOCK"], internal_outcomes=["arrived"], outcomes_from=["DRIVE"],
        outcomes_to=["DOCK"], container_outcomes=["done"],
    )  # fmt: skip
    feedback = actionlib.msg.TestActionFeedback()
    feedback.status.goal_id.id = "goal-1"
    messages: dict[str, Any] = {
        **robot_scene.everything(),
        "/button_state": Bool(True),
        "/camera": image,
        "/rosout_agg": Log(level=4, name="/talker_scan", msg="the battery is low", file="a.py", function="f"),
        "/turtle1/pose": Pose(x=5.5, y=5.5),
        "/turtle1/color_sensor": Color(69, 86, 255),
        "/count/status": GoalStatusArray(),
        "/count/feedback": feedback,
        "/machine/smach/container_structure": states,
        "/machine/smach/container_status": SmachContainerStatus(path="/ROOT", active_states=["DOCK"]),
        "/diagnostics_agg": statuses(("/Robot", 1, "low"), ("/Robot/Battery", 1, "low"), voltage="21.3"),
    }
    for topic, message in messages.items():
        served.run(publisher(served, topic, type(message), latch=True).publish(message))

    async def others() -> None:
        await served.node_of_dashboard.set_param("/robot_description", robot_scene.description())
        await served.node_of_dashboard.set_param("/minirospy_class/anna/student", "Anna")
        await server.serve("/set_led_state", SetBool, lambda request: (request.data, "set"))

    server = served.node("led")
    served.run(others())
    Manager(served).states["arm"] = "running"


def use(page: Page, view: str) -> None:
    """Perform a view's typical first action, and wait for its result."""
    if view == "plot":
        page.type(".bar input", "/button_state/data")
        page.click("button[type=submit]")
        page.wait_text(".series[data-label='/button_state/data'] .num", "1")
    elif view == "panels":
        page.wait("return document.querySelector('#view select')")
    elif view == "layout":
        page.click("button.start", "Workshop")
        page.wait("return document.querySelectorAll('.pane').length === 4")
        page.wait_text(".pane .line .text", "the battery is low")
        page.wait_text(".pane .series .num", "1")
    elif view == "nodes":
        page.click(".nodes td button", "/talker_scan")
        page.wait_text(".side h2", "/talker_scan")
        page.wait("return document.querySelector('.scroll').clientHeight > 120")
    elif view == "3d":
        page.wait_text(*SEEN[view])
        if page.evaluate("!document.querySelector('.scene-side').checkVisibility()"):
            page.click(".scenebar > button[aria-pressed=false]")
        page.wait("return document.querySelector('.scene-side').clientHeight > 200")
    elif view in ("image", "publish", "services", "actions", "bag"):
        find, name = SEEN[view]
        page.wait(
            f"return [...document.querySelectorAll({json.dumps(find)})].some(e => e.value === {name!r})"
        )
        page.choose("#view select", name)
        result = {
            "image": "canvas.image",
            "publish": "fieldset fieldset label.field",
            "services": "label.field",
            "bag": ".bag-label",
        }
        page.wait(f"return document.querySelector({result.get(view, '#view form label')!r})")
    else:
        page.wait_text(*SEEN[view])


def walk(page: Page, check: str = "[]") -> list[str]:
    """Open each view from the menu twice; return the faults by view."""
    wrong = []
    for _ in range(2):
        for view in VIEWS:
            page.click(f"nav .views:has(a[data-view='{view}']) > button")
            page.click(f"nav a[data-view='{view}']")
            page.wait(f"return document.getElementById('view').dataset.view === '{view}'")
            use(page, view)
            wrong += [f"{view}: {each}" for each in page.evaluate(UNREACHABLE) + page.evaluate(check)]
    return sorted(set(wrong))


@needs_chromium
@pytest.mark.timeout(1200)
def test_all_views_work_there_and_back_at_a_desk_and_on_a_phone(
    serve: Callable[..., Served],
    browse: Callable[..., Page],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    make_bag(tmp_path / "walk.bag", 3)
    monkeypatch.chdir(tmp_path)
    served = serve()
    furnish(served)
    with Board():
        page = browse(address(served, "topics"))
        page.wait_text("#state", "connected")
        assert sorted(VIEWS) == sorted({*SEEN, "plot", "panels", "layout"})
        assert walk(page) == []

        page.call(
            "Emulation.setDeviceMetricsOverride", width=360, height=740, deviceScaleFactor=1, mobile=False
        )
        page.click("#theme")
        assert page.evaluate("document.documentElement.dataset.theme") == "dark"
        page.click("#language")
        page.wait_text("#state", "verbunden")
        assert walk(page, LEFT_IN_ENGLISH) == []
    # browse() fails if the page has logged an error.
