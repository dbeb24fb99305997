"""Driving in Debian's chromium: the robot stops if the browser is killed or its tab crashes or hangs; the gamepad as /joy."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from sensor_msgs.msg import Joy

from tests.interop.browser import Page
from tests.interop.page_modules import needs_node, run_script
from tests.interop.test_interop_dashboard import address, browse, is_zero, needs_chromium, press
from tests.web.dashboard.conftest import Served, serve
from tests.web.dashboard.test_drive_endpoint import listen

__all__ = ["browse", "serve"]

PAD = {
    "connected": True,
    "id": "Pad 7",
    "mapping": "standard",
    "axes": [0.02, -1, 0.5, 0],
    "buttons": [{"pressed": False, "value": 0} for _ in range(17)],
}


@needs_node
def test_gamepad_has_the_order_and_signs_of_joy_node() -> None:
    pad = json.loads(json.dumps(PAD))
    for index in (0, 9, 12, 15):  # A, start, up, right
        pad["buttons"][index]["pressed"] = True
    pad["buttons"][7]["value"] = 1  # right trigger
    found = run_script("joyOf", "js/joy.js", f"return joyOf({json.dumps(pad)})")
    assert found == {
        "axes": [0, 1, 1, -0.5, 0, -1, -1, 1],
        "buttons": [1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0],
    }
    pad |= {"mapping": "", "axes": [0.3, -2]}
    assert run_script("joyOf", "js/joy.js", f"return joyOf({json.dumps(pad)}).axes") == [-0.3, 1]


def hold_forward(served: Served, browse: Callable[..., Page]) -> tuple[Page, Callable[..., Any]]:
    """Return a page on which the robot drives forward, and a function that waits for messages."""
    until = listen(served)
    page = browse(address(served, "teleop"))
    page.wait_text("#state", "connected")
    page.wait_text("p[role=status]", "stopped")
    # The browser repeats a key that is held down, but the view tracks held keys itself.
    press(page, "rawKeyDown", "ArrowUp")
    until(lambda twist: twist.linear.x == 0.5)
    return page, until


@pytest.fixture
def mortal() -> Iterator[Callable[[str], Page]]:
    """Return a function that opens a page whose browser is killed at the end."""
    opened: list[Page] = []

    def browsing(url: str) -> Page:
        opened.append(Page(url, own_browser=True))
        return opened[-1]

    yield browsing
    for page in opened:
        page.kill()


@needs_chromium
def test_robot_stops_when_the_browser_is_killed(
    serve: Callable[..., Served], mortal: Callable[[str], Page]
) -> None:
    page, until = hold_forward(serve(), mortal)
    for each in page.processes():
        each.kill()
    until(is_zero)


@needs_chromium
def test_robot_stops_when_the_tab_crashes(
    serve: Callable[..., Served], mortal: Callable[[str], Page]
) -> None:
    page, until = hold_forward(serve(), mortal)
    page.start("", "Page.crash")
    until(is_zero)


@needs_chromium
def test_robot_stops_while_the_page_hangs(
    serve: Callable[..., Served], mortal: Callable[[str], Page]
) -> None:
    page, until = hold_forward(serve(), mortal)
    page.start("for (;;);")
    until(is_zero)


@needs_chromium
def test_gamepad_is_published_as_joy(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    served = serve()
    until = listen(served, "/joy", Joy)
    page = browse(address(served, "teleop"))
    page.wait_text("#state", "connected")
    page.evaluate(f"window.pad = {json.dumps(PAD)}; navigator.getGamepads = () => [null, window.pad]")
    page.wait_text(".teleop", "Gamepad: Pad 7")
    page.click("label", "publish the gamepad as /joy")
    page.wait("return location.hash.includes('joy=%2Fjoy')")
    until(lambda joy: list(joy.axes) == [0, 1, 1, -0.5, 0, 1, 0, 0])
    page.evaluate("pad.buttons[0].pressed = true")
    until(lambda joy: joy.buttons[0] == 1)
    # The pending values are published when the view is closed.
    page.evaluate("location.hash = '#/topics'")
    until(lambda joy: not any(joy.axes) and not any(joy.buttons))
