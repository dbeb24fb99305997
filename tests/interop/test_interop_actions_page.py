"""The view Actions in Debian's chromium, with action servers by minirospy and by Debian's actionlib."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from minirospy.web.access import Access
from tests.interop.browser import Page
from tests.interop.conftest import REAL_PYTHON, start, stop
from tests.interop.test_interop_dashboard import address, browse, needs_chromium, serve
from tests.web.dashboard.conftest import Served

__all__ = ["browse", "serve"]

SERVER = Path(__file__).parent / "actions_page_peer.py"
FIND = "tr[data-goal] "


@pytest.fixture(params=["ours", "rospy"])
def counter(request: pytest.FixtureRequest, serve: Callable[..., Served]) -> Iterator[Served]:
    """Serve a page, and run one stack's action server /count, which takes one step per line on stdin."""
    import sys

    served = serve()
    program = start(
        [{"ours": sys.executable, "rospy": REAL_PYTHON}[request.param], str(SERVER)],
        os.environ["ROS_MASTER_URI"],
        request.param,
    )
    assert program.stdout
    assert program.stdout.readline() == "ready\n"
    served.program = program  # type: ignore[attr-defined]
    yield served
    stop(program)


def go_on(served: Served) -> None:
    """Let the server take one step."""
    program: subprocess.Popen[str] = served.program  # type: ignore[attr-defined]
    assert program.stdin
    program.stdin.write("\n")
    program.stdin.flush()


@needs_chromium
def test_goal_is_sent_watched_and_finished(counter: Served, browse: Callable[..., Page]) -> None:
    page = browse(address(counter, "actions"))
    page.choose("select[aria-label=Action]", "/count")
    page.wait_text(".bar", "actionlib/TestAction")
    page.type("input[name=goal]", "many")
    page.click("button", "Send goal")
    page.wait_text("p.error", 'goal: "many" is not a whole number')
    page.type("input[name=goal]", "2")
    page.click("button", "Send goal")
    page.wait_text("[aria-label='Chosen goal'] .badge", "Active")
    page.wait_text("[aria-label=Feedback]", "feedback: 0")
    page.wait_text(FIND + ".badge", "Active")
    go_on(counter)
    page.wait_text("[aria-label=Feedback]", "feedback: 1")
    go_on(counter)
    page.wait_text("[aria-label='Chosen goal'] .badge", "Succeeded")
    page.wait_text("[aria-label=Result]", "result: 200")
    page.wait_text(FIND, "well <done>")
    assert "action=%2Fcount" in page.evaluate("location.hash")


@needs_chromium
def test_goals_are_cancelled_one_or_all(counter: Served, browse: Callable[..., Page]) -> None:
    page = browse(address(counter, "actions?action=/count"))
    page.wait_text(".form", "int32")
    for number in (1, 2):
        page.type("input[name=goal]", "9")
        page.click("button", "Send goal")
        page.wait(f"return document.querySelectorAll('tr[data-goal]').length === {number}")
        page.wait_text(FIND + ".badge", "Active")
        page.click(*((FIND + "button.small", "cancel") if number == 1 else ("button", "Cancel all goals")))
        page.wait(
            "return [...document.querySelectorAll('tr[data-goal] .badge')].every(e => e.textContent === 'Preempted')"
        )
        page.wait_text("[aria-label=Result]", "result: 0")


@needs_chromium
def test_goals_of_other_clients_are_shown(counter: Served, browse: Callable[..., Page]) -> None:
    from actionlib.msg import TestActionGoal, TestGoal
    from actionlib_msgs.msg import GoalID

    page = browse(address(counter, "actions?action=/count"))
    node = counter.node("client")
    hostile = "<img src=x onerror=alert(1)>"

    async def send() -> None:
        publisher = node.advertise("/count/goal", TestActionGoal, latch=True)
        await publisher.publish(TestActionGoal(goal_id=GoalID(id=hostile), goal=TestGoal(1)))

    counter.run(send())
    page.click(FIND + "button.link", hostile)
    page.wait_text("[aria-label='Chosen goal'] .badge", "Active")
    go_on(counter)
    page.wait_text("[aria-label=Result]", "result: 100")
    assert page.evaluate("document.querySelectorAll('main img').length") == 0


@needs_chromium
def test_reader_sends_no_goal(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    from actionlib.msg import TestActionFeedback
    from actionlib_msgs.msg import GoalStatusArray

    served = serve(
        access=Access(read_token="read-token-00", write_token="write-token-0", requires_token=True)
    )
    node = served.node("server")

    async def advertise() -> None:
        node.advertise("/count/feedback", TestActionFeedback)
        await node.advertise("/count/status", GoalStatusArray, latch=True).publish()

    served.run(advertise())
    page = browse(address(served, "actions?action=/count&token=read-token-00"))
    page.wait_text("form", "read-only")
    page.wait_text("[aria-label=Goals]", "None yet.")
    assert not page.evaluate("document.querySelector('.bar button[type=submit]')?.getClientRects().length")
