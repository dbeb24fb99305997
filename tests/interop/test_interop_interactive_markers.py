"""Interactive markers in the 3D view, from minirospy's and Debian's servers: dragged, clicked, and chosen from menus."""

from __future__ import annotations

import contextlib
import json
import math
import os
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.web.access import Access
from tests.interop.browser import PATIENCE, Page
from tests.interop.conftest import REAL_PYTHON, start, stop
from tests.interop.test_interop_dashboard import address, browse, needs_chromium
from tests.interop.test_interop_dashboard_3d import Serve, drag, drawn, levels, look_down, mouse, status
from tests.waiting import wait_until
from tests.web.dashboard.conftest import Served, serve

__all__ = ["browse", "serve"]

SERVER = Path(__file__).parent / "marker_peer.py"
DISPLAY = "InteractiveMarkers /markers/update"
Browse = Callable[..., Page]


class Server:
    """The program marker_peer.py."""

    def __init__(self, program: subprocess.Popen[str]) -> None:
        self.program = program
        self.said: queue.Queue[dict[str, Any]] = queue.Queue()
        assert program.stdout
        assert program.stdout.readline() == "ready\n"
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.program.stdout
        for line in self.program.stdout:
            self.said.put(json.loads(line))

    def tell(self, command: str) -> None:
        assert self.program.stdin
        self.program.stdin.write(f"{command}\n")
        self.program.stdin.flush()

    def until(self, event: str) -> list[dict[str, Any]]:
        """Return the events up to this one, without those that keep a marker alive."""
        found: list[dict[str, Any]] = []
        while not found or found[-1]["event"] != event:
            said = self.said.get(timeout=PATIENCE)
            if said["event"] != "alive":
                found.append(said)
        return found


@pytest.fixture(params=["ours", "rospy"])
def served(request: pytest.FixtureRequest, serve: Serve) -> Iterator[tuple[Served, Server]]:
    """Serve a page, and run one stack's marker server."""
    page = serve(access=Access(read_token="read-token-00", write_token="write-token-0", requires_token=True))
    interpreter = {"ours": sys.executable, "rospy": REAL_PYTHON}[request.param]
    program = start([interpreter, str(SERVER)], os.environ["ROS_MASTER_URI"], request.param)
    yield page, Server(program)
    stop(program)


def opened(served: Served, browse: Browse, token: str = "write-token-0") -> tuple[Page, float]:
    """Open the view from above with all markers; return the page and the number of pixels per metre."""
    page = browse(address(served, f"3d?token={token}"))
    status(page, DISPLAY, "Markers: 5 interactive markers")
    status(page, DISPLAY, "/marker_server: OK")
    metre = look_down(page)
    drawn(page)
    return page, metre


@needs_chromium
def test_arrow_is_dragged_and_the_marker_follows(served: tuple[Served, Server], browse: Browse) -> None:
    page, metre = opened(served[0], browse)
    drag(page, (0.78 * metre, 0.02 * metre), (1.78 * metre, 0.5 * metre))
    events = served[1].until("up")
    assert [each["event"] for each in (*events[:2], *events[-2:])] == ["pose", "down", "pose", "up"]
    assert {each["control"] for each in events} == {"move_x"}
    assert {each["frame"] for each in events} == {"map"}
    assert len({each["client"] for each in events}) == 1
    assert events[0]["place"] == pytest.approx([0, 0, 0.2])
    assert events[0]["point"] == pytest.approx([0.78, 0, 0.2], abs=0.1)
    # The marker moves only along the axis.
    assert events[-1]["place"] == pytest.approx([1, 0, 0.2], abs=0.03)

    # The server has moved the marker, so a new page shows it where it was dropped, and it can be dragged back.
    page, metre = opened(served[0], browse)
    drag(page, (1.78 * metre, 0.02 * metre), (0.78 * metre, 0))
    assert served[1].until("up")[-1]["place"] == pytest.approx([0, 0, 0.2], abs=0.03)


@needs_chromium
def test_ring_turns_and_plane_slides(served: tuple[Served, Server], browse: Browse) -> None:
    page, metre = opened(served[0], browse)
    radius = 0.57 * metre
    slanted = radius * math.sqrt(0.5)
    drag(page, (slanted, -slanted), (-slanted, -slanted))
    event = served[1].until("up")[-1]
    assert event["control"] == "turn_z"
    assert event["place"] == pytest.approx([0, 0, 0.2])
    assert [abs(part) for part in event["turned"]] == pytest.approx([0, 0, 0.7071, 0.7071], abs=0.02)
    assert event["turned"][2] * event["turned"][3] > 0

    drag(page, (2 * metre, -2 * metre), (metre, -3 * metre))
    event = served[1].until("up")[-1]
    assert (event["marker"], event["control"]) == ("flat", "slide")
    assert event["place"] == pytest.approx([1, 3, 0], abs=0.03)

    # This control turns with the view; seen from above, its plane is the ground.
    drag(page, (2 * metre, 2 * metre), (3 * metre, 2 * metre))
    event = served[1].until("up")[-1]
    assert (event["marker"], event["control"]) == ("facing", "slide_view")
    assert event["place"] == pytest.approx([3, -2, 0], abs=0.03)


@needs_chromium
def test_button_is_clicked_and_menu_entry_chosen(served: tuple[Served, Server], browse: Browse) -> None:
    page, metre = opened(served[0], browse)
    drag(page, (-2 * metre, 2 * metre), (-2 * metre, 2 * metre))
    assert [each["event"] for each in served[1].until("up")] == ["pose", "down", "click", "pose", "up"]

    drag(page, (-2 * metre, -2 * metre), (-2 * metre, -2 * metre))
    page.wait_text(".marker-menu button", "First")
    assert [each["event"] for each in served[1].until("up")] == ["pose", "down", "pose", "up"]
    page.click(".marker-menu button", "More")
    page.wait_text(".submenu button", "☐Checked")
    assert page.evaluate(
        "[...document.querySelectorAll('.marker-menu button')].find(e => e.textContent.includes('Program')).disabled"
    )
    page.click(".submenu button", "Checked")
    (event,) = served[1].until("menu")
    assert (event["marker"], event["control"], event["entry"]) == ("listed", "", 3)
    assert event["point"] == pytest.approx([-2, 2, 0.2], abs=0.1)

    # The server has set the check box, so it is checked in a new page.
    page, metre = opened(served[0], browse)
    drag(page, (-2 * metre, -2 * metre), (-2 * metre, -2 * metre))
    page.click(".marker-menu button", "More")
    page.wait_text(".submenu button", "☑Checked")
    page.call("Input.dispatchKeyEvent", type="keyDown", key="Escape")
    page.wait("return document.querySelector('.marker-menu').hidden")


@needs_chromium
def test_markers_follow_their_server(served: tuple[Served, Server], browse: Browse) -> None:
    page, metre = opened(served[0], browse)
    served[1].tell("erase listed")
    status(page, DISPLAY, "Markers: 4 interactive markers")
    served[1].tell("move flat 0.5 3")
    served[1].tell("lose")
    # The five markers include the one in the lost update.
    status(page, DISPLAY, "Markers: 5 interactive markers")
    status(page, DISPLAY, "/marker_server: OK")
    drag(page, (0.5 * metre, -3 * metre), (1.5 * metre, -3 * metre))
    event = served[1].until("up")[-1]
    assert (event["marker"], event["place"]) == ("flat", pytest.approx([1.5, 3, 0], abs=0.03))

    served[1].tell("many")
    status(page, DISPLAY, "Marker many: 201 controls, more than 200")
    status(page, DISPLAY, "Marker nowhere: Marker contains invalid floats!")
    assert levels(page)[DISPLAY] == "error"
    stop(served[1].program)
    status(page, DISPLAY, "General: Server is offline. Resetting.")


@needs_chromium
def test_texts_of_markers_never_become_html(served: tuple[Served, Server], browse: Browse) -> None:
    page, metre = opened(served[0], browse)
    hostile = "<img src=x"
    page.wait_text(".label", hostile)
    drag(page, (-2 * metre, -2 * metre), (-2 * metre, -2 * metre))
    page.click(".marker-menu button", "More")
    page.wait_text(".submenu button", hostile)
    page.call("Input.dispatchKeyEvent", type="keyDown", key="Escape")
    mouse(page, "mouseMoved", -2 * metre, 2 * metre)
    page.wait_text("[role=status]", hostile)
    assert not page.evaluate("document.querySelectorAll('img').length")
    assert page.evaluate("document.title") != "taken"


@needs_chromium
def test_feedback_is_published_no_longer_than_the_view_is_open(
    served: tuple[Served, Server], browse: Browse
) -> None:
    def is_published() -> bool:
        publishers = master.call("getSystemState")[0]
        return "/markers/feedback" in [topic for topic, _ in publishers]

    page, _ = opened(served[0], browse)
    with contextlib.closing(MasterProxy(os.environ["ROS_MASTER_URI"], "/test")) as master:
        wait_until(is_published)
        page.evaluate("location.hash = '#/topics'")
        wait_until(lambda: not is_published())


@needs_chromium
def test_markers_of_a_read_only_page_cannot_be_dragged(served: tuple[Served, Server], browse: Browse) -> None:
    page, metre = opened(served[0], browse, "read-token-00")
    drag(page, (0.78 * metre, 0.02 * metre), (1.78 * metre, 0))
    page.wait_text("[role=status]", "This token is read-only.")
    drag(page, (-2 * metre, 2 * metre), (-2 * metre, 2 * metre))
    # The server accepts the first event, which is from another page.
    writer, metre = opened(served[0], browse)
    drag(writer, (-2 * metre, 2 * metre), (-2 * metre, 2 * metre))
    assert [each["event"] for each in served[1].until("up")] == ["pose", "down", "click", "pose", "up"]


@needs_chromium
def test_finger_drags_and_its_long_press_opens_the_menu(
    served: tuple[Served, Server], browse: Browse
) -> None:
    page, metre = opened(served[0], browse)
    left, top = page.evaluate(
        "(() => { const r = document.querySelector('canvas.stage').getBoundingClientRect();"
        "return [r.x + r.width / 2, r.y + r.height / 2] })()"
    )

    def touch(kind: str, *points: tuple[float, float]) -> None:
        page.call(
            "Input.dispatchTouchEvent",
            type=kind,
            touchPoints=[{"x": left + x * metre, "y": top + y * metre} for x, y in points],
        )

    touch("touchStart", (0.78, 0.02))
    touch("touchMove", (1.2, 0))
    touch("touchMove", (1.78, 0))
    touch("touchEnd")
    events = served[1].until("up")
    assert events[-1]["place"] == pytest.approx([1, 0, 0.2], abs=0.05)
    touch("touchStart", (-2, -2))
    page.wait_text(".marker-menu button", "First")
    touch("touchEnd")
