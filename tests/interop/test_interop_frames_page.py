"""The view Frames in Debian's chromium: the tree of /tf and /tf_static with rates, ages and faults."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from tests.interop.browser import Page
from tests.interop.test_interop_dashboard import (
    HOSTILE,
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

BOX = "[data-frame='{}'] "


@needs_node
def test_angles_are_those_of_tf() -> None:
    from tf.transformations import euler_from_quaternion, quaternion_from_euler

    angles = [(0.1, -0.2, 3.0), (-3, 1.5, 0.5), (0, math.pi / 4, 0)]
    names = ("x", "y", "z", "w")
    quaternions = [tuple(map(float, quaternion_from_euler(*each))) for each in angles]
    found = page_functions(
        *(("frames", "eulerOf", [dict(zip(names, each, strict=True))]) for each in quaternions)
    )
    for quaternion, euler in zip(quaternions, found, strict=True):
        assert euler == pytest.approx(euler_from_quaternion(quaternion))


def transforms(*pairs: tuple[str, str]) -> Any:
    message = TFMessage()
    for parent, child in pairs:
        each = TransformStamped(child_frame_id=child)
        each.header.frame_id = parent
        each.transform.translation.x = 1.25
        each.transform.rotation.z = each.transform.rotation.w = math.sqrt(0.5)
        message.transforms.append(each)
    return message


def again(served: Served) -> Any:
    """Return a publisher of /tf that belongs to another node."""
    node = served.node("another")

    async def advertise() -> Any:
        return node.advertise("/tf", TFMessage)

    return served.run(advertise())


@needs_chromium
def test_frames_are_a_tree_with_rates_and_faults(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    page = browse(address(served, "tf"))
    page.wait_text(".empty", "Nothing has come on /tf or /tf_static.")
    static = publisher(served, "/tf_static", TFMessage, latch=True)
    served.run(static.publish(transforms(("base_link", "laser"), ("base_link", HOSTILE))))
    moving = publisher(served, "/tf", TFMessage)
    with repeated(served, moving, transforms(("odom", "base_link"))):
        page.wait_text(BOX.format("laser"), "static")
        page.wait_text(BOX.format("base_link"), "Hz")
        page.wait_text("[role=status]", "4 frames, root odom")
        page.click(BOX.format("base_link") + "text")
        page.wait_text(".side", "1.25, 0, 0")
        page.wait_text(".side", "0, 0, 90 °")
        page.wait_text(".side", "/talker_tf")
        assert "frame=base_link" in page.evaluate("location.hash")
        page.type("input[type=search]", "LASER")
        page.wait("return document.querySelectorAll('.frame-box.near').length === 1")
        # A second node publishes a different parent.
        with repeated(served, again(served), transforms(("map", "base_link"))):
            page.wait_text(".side .error", "It has 2 parents, map and odom")
        page.wait("return !document.querySelector('.side .error')")
    page.wait_text(".side .error", "No transform for")
    page.wait("return document.querySelector('.frame-box.bad')")
    page.wait_text("[role=status]", "1 with a problem")
    assert page.evaluate("document.querySelectorAll('main img').length") == 0
    page.click("button", "Forget")
    page.wait_text("[role=status]", "3 frames, root base_link")


@needs_chromium
def test_frames_that_are_their_own_ancestors_are_named(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    static = publisher(served, "/tf_static", TFMessage, latch=True)
    served.run(static.publish(transforms(("a", "b"), ("b", "a"))))
    page = browse(address(served, "tf?frame=a"))
    page.wait_text(".side .error", "It is its own ancestor")


@needs_chromium
def test_frames_of_any_name_leave_the_tree_readable(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    static = publisher(served, "/tf_static", TFMessage, latch=True)
    long = "a" + "x" * 3000 + "_end"
    strange = ("__proto__", "constructor", "", long)
    served.run(static.publish(transforms(*(("map", each) for each in strange), ("__proto__", "child"))))
    page = browse(address(served, "tf"))
    page.wait_text("[role=status]", "6 frames, root map")
    names = "[...document.querySelectorAll('.frame-box')].map(e => e.dataset.frame)"
    assert set(page.evaluate(names)) == {"map", "child", *strange}
    # The middle of a long name is elided; other names are not shrunk.
    assert page.wait_text(BOX.format(long) + "text", "…").endswith("_end")
    assert (
        page.evaluate("document.querySelector('[data-frame=map] rect').getBoundingClientRect().height") > 15
    )
    page.click(BOX.format("__proto__"))
    page.wait_text(".side", "child")
    assert page.evaluate("document.querySelectorAll('.edge.near').length") == 1


@needs_node
def test_long_names_in_drawings_keep_their_ends() -> None:
    names = ["/robot/cmd_vel", "/" + "n" * 60, "/a" + "b" * 100_000 + "_end", "\U0001f600" * 61]
    found = page_functions(*(("drawing", "brief", [name]) for name in names))
    assert found[0] == names[0]
    assert [len(each) for each in found[1:3]] == [60, 60]
    assert found[2].startswith("/abb")
    assert found[2].endswith("bb_end")
    assert found[3] == "\U0001f600" * 30 + "…" + "\U0001f600" * 29


@needs_node
def test_loop_of_a_box_starts_and_ends_at_its_side() -> None:
    box = {"x": 50, "y": 30, "width": 80, "height": 40}
    calls = [("drawing", "loopOf", [box, label]) for label in ({"x": 120, "y": 30}, {"x": 50, "y": 80})]
    assert page_functions(*calls) == [
        "M90.0 21.0C130.0 12.0 130.0 48.0 90.0 39.0",
        "M41.0 50.0C32.0 90.0 68.0 90.0 59.0 50.0",
    ]
