"""The first view in Debian's chromium: without a master, with a master alone, with faults, with a large robot, on a phone."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any
from xmlrpc.client import ServerProxy

import pytest
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool, Float64

from minirospy.board.board import Board
from tests.conftest import free_port
from tests.interop.browser import PATIENCE, Page
from tests.interop.test_interop_dashboard import address, browse, needs_chromium, publisher, repeated, serve
from tests.web.dashboard.conftest import Served

__all__ = ["browse", "serve"]

ROW = "document.querySelector(\"tr[data-topic='{}']\")"
CHECKED = "return ['good', 'warning', 'problem'].includes(document.querySelector('.verdict')?.dataset.level)"
PHONE = {"width": 390, "height": 844}


@pytest.fixture
def programs() -> Iterator[list[subprocess.Popen[str]]]:
    """Return a list of processes that are stopped after the test."""
    started: list[subprocess.Popen[str]] = []
    yield started
    for each in started:
        each.terminate()
    for each in started:
        each.communicate(timeout=PATIENCE)


def subscribe(served: Served, name: str, topic: str, cls: type) -> Any:
    node = served.node(name)

    async def listen() -> Any:
        return await node.subscribe(topic, cls)

    return served.run(listen())


def register(caller: str, method: str, topic: str) -> None:
    with ServerProxy(os.environ["ROS_MASTER_URI"]) as master:
        answer = getattr(master, method)(caller, topic, "std_msgs/String", "http://127.0.0.1:1/")
    assert answer[0] == 1, answer


@needs_chromium
def test_faults_of_a_robot_are_shown_with_advice_and_links(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    publisher(served, "/scan", LaserScan)
    kept = [subscribe(served, "map", "/scan", LaserScan), subscribe(served, "motor", "/cmd_vell", Float64)]
    register("/dead", "registerPublisher", "/nothing")
    page = browse(address(served))
    assert page.wait("return document.getElementById('view').dataset.view") == "overview"
    page.wait_text(".verdict", "problem")
    page.wait("return document.querySelector(\"tr[data-node='/dead'].bad\")")
    assert page.evaluate("document.querySelector('tr[data-node]').dataset.node") == "/dead"
    page.wait_text(".findings .problem", "/dead: nothing listens at their port")
    page.wait_text(".findings .problem .advice code", "rosnode cleanup")
    assert "`" not in page.evaluate("document.querySelector('main').textContent")
    page.wait_text(".findings .warning", "nobody publishes /cmd_vell (/motor)")
    # No scan comes: after some reports the topic is silent.
    page.wait_text(".findings .warning", "/scan is silent")
    page.wait(f"return {ROW.format('/scan')}.dataset.state === 'silent'")
    assert page.evaluate(f"{ROW.format('/cmd_vell')}.dataset.state") == "unpublished"
    # It does not subscribe to a topic of the robot.
    assert served.dashboard
    assert set(served.dashboard.bridge.graph.topics) <= {"/rosout_agg"}
    page.click(".findings .problem a", "Show more")
    page.wait_text(".side h2", "/dead")
    page.evaluate("history.back()")
    page.click("tr[data-topic='/scan'] a")
    page.wait("return document.querySelector(\".row[data-topic='/scan'] [aria-expanded=true]\")")
    assert kept


@needs_chromium
def test_master_alone_is_well(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    page = browse(address(serve()))
    page.wait(CHECKED)
    page.wait_text(".overview", "Nothing is published yet")
    page.wait_text(".overview h2", "0 nodes")
    page.wait_text(".recent", "No line yet.")
    assert page.evaluate("document.querySelectorAll('.findings .problem').length") == 0


@needs_chromium
def test_page_before_the_master_says_how_to_start_one(
    programs: list[subprocess.Popen[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", f"http://localhost:{free_port()}")
    words = [sys.executable, "-m", "minirospy", "dashboard", "--no-browser", "--port", "0"]
    programs.append(subprocess.Popen(words, stdout=subprocess.PIPE, text=True))
    assert programs[0].stdout
    link = re.search(r"http\S+", programs[0].stdout.readline())
    assert link
    page = Page(link[0])
    try:
        page.wait_text(".verdict", "There is no ROS master yet.")
        page.wait_text(".findings", "start one with roscore")
        page.click("#language")
        page.wait_text(".findings", "mit roscore einen starten")
        page.click("#language")
        port = os.environ["ROS_MASTER_URI"].rpartition(":")[2]
        programs.append(
            subprocess.Popen([sys.executable, "-m", "minirospy", "master", "-p", port], text=True)
        )
        page.wait_text("#state", "connected")
        page.wait_text("tr[data-node] a", "/rosout")
        page.wait(CHECKED)
        # The master ends while the page is open.
        programs[1].terminate()
        programs[1].wait(PATIENCE)
        page.wait_text(".verdict", "The ROS master does not answer.")
    finally:
        page.close()


@needs_chromium
def test_large_robot_is_shown_without_subscriptions_on_a_phone_in_german(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    nodes = [served.node(f"node_{number:02d}") for number in range(40)]
    kept: list[Any] = []

    async def fill() -> None:
        for number in range(300):
            topic = f"/robot/part_{number % 6}/topic_{number:03d}"
            kept.append(await nodes[number % 40].advertise(topic, Float64))
            if number < 20:
                kept.append(await nodes[(number + 1) % 40].subscribe(topic, Float64))

    served.run(fill())
    for options in ({}, PHONE):
        page = browse(address(served), **options)
        page.wait_text("#state", "connected")
        page.evaluate("localStorage.setItem('language', 'de')")
        page.reload()
        page.wait_text(".overview h2", "40 Nodes")
        page.wait_text(".overview h2", "300 Topics")
        page.wait(CHECKED)
        page.wait_text(".more a", "260 weitere")
        assert page.evaluate("document.querySelectorAll('tr[data-topic]').length") == 40
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        if not options:  # all of it is on one screen
            assert page.evaluate(
                "document.querySelector('main').scrollHeight <= document.querySelector('main').clientHeight"
            )
    assert served.dashboard
    assert set(served.dashboard.bridge.graph.topics) <= {"/rosout_agg"}
    assert kept


@needs_chromium
def test_board_is_shown_and_its_button_pressed(
    serve: Callable[..., Served], browse: Callable[..., Page], monkeypatch: pytest.MonkeyPatch, tmp_path: Any
) -> None:
    monkeypatch.setenv("MINIROSPY_RUNTIME_DIR", str(tmp_path / "b"))
    served = serve()
    page = browse(address(served))
    page.wait(CHECKED)
    assert page.evaluate("document.querySelectorAll('.strip').length") == 0
    board = Board("mine")
    try:
        page.press(".strip button", "GPIO 11")
        page.wait("return document.querySelector(\".strip button[aria-pressed='true']\")")
        page.release(".strip button", "GPIO 11")
        page.wait("return !document.querySelector(\".strip button[aria-pressed='true']\")")
    finally:
        board.close()


@needs_chromium
def test_rate_of_a_topic_is_that_which_its_node_counts(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    sender = publisher(served, "/button_state", Bool)
    kept = subscribe(served, "led", "/button_state", Bool)
    page = browse(address(served))
    row = ROW.format("/button_state")
    # A rate is the difference between two reports, so the first messages must not come before a report has counted them.
    page.wait(f"return {row}?.dataset.state === 'quiet' && {row}.textContent.includes('0.0 Hz')")
    with repeated(served, sender, Bool(True)):
        page.wait(f"return {row}.dataset.state === 'flows'")
    page.wait(f"return {row}.dataset.state !== 'flows'")
    assert kept
