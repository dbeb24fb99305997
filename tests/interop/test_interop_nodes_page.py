"""The view Nodes in Debian's chromium, with nodes of minirospy, rospy and roscpp."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Callable
from xmlrpc.client import ServerProxy

from std_msgs.msg import String

from minirospy.web.access import Access
from tests.interop.browser import Page
from tests.interop.conftest import cpp_peer, peer
from tests.interop.test_interop_dashboard import HOSTILE, address, browse, needs_chromium, serve
from tests.web.dashboard.conftest import Served

__all__ = ["browse", "cpp_peer", "peer", "serve"]

ROW = "tr[data-node='{}'] "


@needs_chromium
def test_nodes_of_each_kind_are_shown_pinged_and_killed(
    serve: Callable[..., Served],
    peer: Callable[[str, str, str], subprocess.Popen[str]],
    browse: Callable[..., Page],
) -> None:
    served = serve()
    uri = os.environ["ROS_MASTER_URI"]
    programs = [peer("rospy", "talk", uri), peer("roscpp", "serve", uri)]
    served.node("mine")
    page = browse(address(served, "nodes"))
    page.wait_text(ROW.format("/mine") + "td:nth-child(3)", str(os.getpid()))
    page.click(ROW.format("/mine") + "button")
    page.wait_text(".side h2", "/mine")
    page.wait_text(".side", "/rosout rosgraph_msgs/Log")
    page.click(".side button", "Ping")
    page.wait_text(".side [role=status]", "answered in")
    assert "node=%2Fmine" in page.evaluate("location.hash")

    for program in programs:
        name = page.wait(
            "const row = [...document.querySelectorAll('tr[data-node]')]"
            f".find(e => e.children[2].textContent === '{program.pid}');"
            "return row?.dataset.node"
        )
        page.click(ROW.format(name) + "button")
        page.wait_text(".side h2", name)
        page.click(".side button", "Kill")
        page.wait_text(".question", f"Shut down {name}?")
        page.click(".question button", "Keep")
        page.wait("return document.querySelector('.question').hidden")
        page.click(".side button", "Kill")
        page.click(".question button", "Kill")
        page.wait_text(".note", f"{name} was requested to shut down")
        # The node has unregistered, but its program runs until stdin is closed.
        page.wait(f'return !document.querySelector("{ROW.format(name)}")')


@needs_chromium
def test_nodes_are_sorted_by_cost(
    serve: Callable[..., Served],
    peer: Callable[[str, str, str], subprocess.Popen[str]],
    browse: Callable[..., Page],
) -> None:
    served = serve()
    program = peer("rospy", "talk", os.environ["ROS_MASTER_URI"])
    served.node("mine")
    with ServerProxy(os.environ["ROS_MASTER_URI"]) as master:
        master.registerPublisher("/a_dead_one", "/nothing", "std_msgs/String", "http://127.0.0.1:1/")
    page = browse(address(served, "nodes?sort=memory"))
    pids = [os.getpid(), program.pid]
    # CPU usage is measured between two reports.
    page.wait(
        "const rows = [...document.querySelectorAll('tr[data-node]')];"
        f"return {pids}.every(pid => rows.some(({{children: c}}) => c[2].textContent === String(pid)"
        " && /^[0-9.]+ %$/.test(c[3].textContent) && /^[0-9.]+ MB$/.test(c[4].textContent)))"
    )
    for column, title in ((4, "Memory"), (3, "CPU")):
        page.click("th button", title)
        page.wait(f"return document.querySelector('th:nth-child({column + 1})').ariaSort === 'descending'")
        values = page.evaluate(
            f"[...document.querySelectorAll('tr[data-node]')].map(e => parseFloat(e.children[{column}].textContent) || 0)"
        )
        assert values == sorted(values, reverse=True)
        assert values[-1] == 0, "what is not known of a node that does not answer is last"
        assert f"sort={title.lower()}" in page.evaluate("location.hash")
    page.click("th button", "Node")
    page.wait("return document.querySelector('tr[data-node]').dataset.node === '/a_dead_one'")


@needs_chromium
def test_dead_nodes_are_marked_and_cleaned_up(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    with ServerProxy(os.environ["ROS_MASTER_URI"]) as master:
        for name in ("/dead", "/" + HOSTILE):
            answer = master.registerPublisher(name, "/nothing", "std_msgs/String", "http://127.0.0.1:1/")
            assert answer[0] == 1, answer  # type: ignore[index]
    page = browse(address(served, "nodes?node=/dead"))
    page.wait_text(ROW.format("/dead"), "no answer")
    page.wait_text(".side .error", "nothing listens at their port")
    page.wait_text(".side .error", "rosnode cleanup")
    page.wait_text(".bar", "2 without an answer")
    page.type("input[type=search]", "dead")
    page.wait("return document.querySelectorAll('tr[data-node]:not([hidden])').length === 1")
    page.click("button", "Clean up")
    page.wait_text(".question", "Remove /")
    page.click(".question button", "Clean up")
    page.wait_text(".note", "Removed: /dead.")
    page.type("input[type=search]", "")
    page.wait(f'return !document.querySelector("{ROW.format("/dead")}")')
    # The master has no address for an illegal name, so the row stays as plain text, as with rosnode cleanup.
    page.wait_text("tr.dead td", HOSTILE)
    assert page.evaluate("document.querySelectorAll('main img, main script').length") == 0
    assert page.evaluate("document.title") == "Nodes · minirospy"


@needs_chromium
def test_reader_looks_and_kills_nothing(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    served = serve(
        access=Access(read_token="read-token-00", write_token="write-token-0", requires_token=True)
    )
    served.node("mine")
    page = browse(address(served, "nodes?node=/mine&token=read-token-00"))
    page.wait_text(".side", "read-only")
    assert page.evaluate(
        "[...document.querySelectorAll('.side button')].find(e => e.textContent.startsWith('Kill')).disabled"
    )
    page.click(".side button", "Ping")
    page.wait_text(".side [role=status]", "answered in")


@needs_chromium
def test_button_that_is_pressed_stays_until_its_click(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    node = served.node("mine")

    async def advertise() -> None:
        await node.advertise("/news", String)

    page = browse(address(served, "nodes?node=/mine"))
    page.wait_text(".side", "/rosout rosgraph_msgs/Log")
    page.wait("document.querySelector('.side button').dataset.test = 'mine'; return true")
    page.press(".side button", "Ping")
    served.run(advertise())
    page.wait_text(ROW.format("/mine"), "2 out")
    assert page.evaluate("document.querySelector('.side button').dataset.test") == "mine"
    page.release(".side button", "Ping")
    page.wait_text(".side [role=status]", "answered in")
    page.wait_text(".side", "/news std_msgs/String")


@needs_chromium
def test_suspended_node_is_named_as_such(
    serve: Callable[..., Served],
    peer: Callable[[str, str, str], subprocess.Popen[str]],
    browse: Callable[..., Page],
) -> None:
    served = serve()
    program = peer("ours", "talk", os.environ["ROS_MASTER_URI"])
    page = browse(address(served, "nodes"))
    row = f"[...document.querySelectorAll('tr[data-node]')].find(e => e.children[2].textContent === '{program.pid}')"
    name = page.wait(f"return {row}?.dataset.node")
    program.send_signal(signal.SIGSTOP)
    try:
        page.wait_text(ROW.format(name), "no answer")
    finally:
        program.send_signal(signal.SIGCONT)
    page.wait_text(ROW.format(name), "ms")
