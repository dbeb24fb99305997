"""Bags in the dashboard, in Debian's chromium, operated as by a user."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from std_msgs.msg import String

from minirospy.ros.rosbag.recording.sources import Bags
from minirospy.web.dashboard.files import FOLDER
from tests.interop.browser import PATIENCE, Page
from tests.interop.test_interop_dashboard import (
    address,
    browse,
    needs_chromium,
    needs_node,
    publisher,
    repeated,
    start,
)
from tests.waiting import wait_until
from tests.web.dashboard.bags import make_bag
from tests.web.dashboard.conftest import Served, serve

__all__ = ["browse", "serve", "start"]

HOSTILE = "<img src=x onerror=\"document.title='broken'\">"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@needs_node
def test_time_axis_zooms_pans_and_labels() -> None:
    script = f"""
import {{ Axis, clockText, heights, roundStep, sizeText }} from {str((FOLDER / "js" / "timeline.js").as_uri())!r};
import assert from "node:assert/strict";
const axis = new Axis(100, 1000);
assert.equal(axis.x(50), 500);
assert.equal(axis.time(250), 25);
assert.equal(axis.time(-5), 0);
axis.zoom(0.5, 500);
assert.deepEqual([axis.start, axis.end, axis.x(50)], [25, 75, 500]);
axis.pan(-10000);
assert.deepEqual([axis.start, axis.end], [0, 50]);
axis.zoom(100, 0);
assert.deepEqual([axis.start, axis.end], [0, 100]);
axis.zoom(1e-12, 1000);
assert.ok(axis.span >= 9.9e-5 && axis.end <= 100.0001);
axis.fit();
assert.equal(axis.follow(50), false);
axis.zoom(0.1, 0);
assert.equal(axis.follow(50), true);
assert.ok(axis.start < 50 && axis.end > 50);
axis.fit();
assert.deepEqual(axis.ticks(100), {{ step: 10, times: [0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100] }});
assert.deepEqual([0.003, 0.7, 3, 11, 25, 31, 61, 4000, 90000].map(roundStep), [0.005, 1, 5, 20, 30, 60, 120, 7200, 172800]);
const texts = [clockText(0, 1), clockText(61.25, 0.01), clockText(3723.4, 0.1), clockText(59.99, 0.1)];
assert.deepEqual(texts, ["0:00", "1:01.25", "1:02:03.4", "1:00.0"]);
assert.deepEqual([sizeText(12), sizeText(1234), sizeText(5e6), sizeText(2.5e9)], ["12 B", "1.2 kB", "5.0 MB", "2.5 GB"]);
assert.deepEqual(heights([0, 1, 1]), [0, 1, 1]);
assert.equal(heights([0, 1, 1000])[1], 0.55);
assert.equal(new Axis(0, 10).x(0), 0);
"""
    done = subprocess.run(
        [shutil.which("node") or "", "--input-type=module", "-e", script],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stderr


@needs_chromium
def test_bag_is_played_moved_through_and_published(
    serve: Callable[..., Served], browse: Callable[..., Page], folder: Path
) -> None:
    make_bag(folder / "run.bag", 20, hostile=HOSTILE)
    served = serve()
    page = browse(address(served, "bag"))
    page.choose("select[aria-label='Bag']", "run.bag")
    page.wait_text(".card[data-topic='/chatter']", f"{HOSTILE}message 0")
    page.wait("return document.querySelector(\".card[data-topic='/camera'] canvas\").width === 40")
    page.wait_text(".now", "0:00.000 / 0:19.900")

    # Click on the timeline, then step by button and by key, forward and back.
    page.click("canvas.bag-rows")
    number = int(
        page.wait(
            "const card = document.querySelector(\".card[data-topic='/chatter']\");"
            "const found = card.textContent.match(/message (9\\d|10\\d)/); return found && found[1]"
        )
    )
    page.click("button[aria-label^='To the next message']")
    page.wait_text(".card[data-topic='/chatter']", f"message {number + 1}")
    page.evaluate("document.querySelector('canvas.bag-rows').focus()")
    for key, text in (
        ("ArrowRight", f"message {number + 2}"),
        ("ArrowLeft", f"message {number + 1}"),
        ("End", "message 199"),
        ("Home", "message 0"),
    ):
        page.call("Input.dispatchKeyEvent", type="keyDown", key=key)
        page.wait_text(".card[data-topic='/chatter']", f"{HOSTILE}{text}")
    # Keys still step after a click on a button.
    page.click("button[aria-label^='To the next message']")
    page.wait_text(".card[data-topic='/chatter']", f"{HOSTILE}message 1")
    page.evaluate("document.querySelector('button[aria-label^=\"To the next message\"]').focus()")
    page.call("Input.dispatchKeyEvent", type="keyDown", key="ArrowRight")
    page.wait_text(".card[data-topic='/chatter']", f"{HOSTILE}message 2")

    # Play first without publishing, then with it.
    page.evaluate(
        "const s = document.querySelector('input[aria-label=Speed]'); s.value = '1'; s.dispatchEvent(new Event('change'))"
    )
    page.wait_text(".speed", "10")
    page.click("button.play")
    page.wait_text(".now", "0:19.900 / 0:19.900")
    # With loop checked, playback restarts at the end.
    page.evaluate(
        "[...document.querySelectorAll('label')].find(each => each.textContent === 'loop').querySelector('input').click()"
    )
    for half in (r"0:1\d", r"0:0\d", r"0:1\d"):
        page.wait(f"return /^{half}\\./.test(document.querySelector('.now').textContent)")
    page.click("button.play")
    assert (
        page.evaluate(
            "fetch('/').then(() => document.querySelector('.publish-switch').classList.contains('on'))"
        )
        is False
    )
    page.click(".publish-switch input")
    page.wait("return document.querySelector('.publish-switch.on')")
    page.click("button.play")
    page.open(address(served, "topics"))
    page.wait_text("#state", "connected")
    assert page.evaluate("document.title") == "Topics · minirospy"


@needs_chromium
def test_topics_are_recorded_and_the_recording_is_opened(
    serve: Callable[..., Served], browse: Callable[..., Page], folder: Path
) -> None:
    served = serve()
    talking = publisher(served, "/robot/words", String)
    publisher(served, "/robot/silent", String)
    with repeated(served, talking, String("hello")):
        page = browse(address(served, "bag"))
        page.click("button", "Record …")
        page.wait_text("[data-topic='/robot/words'] .num", " Hz")
        page.click("[data-topic='/robot/words'] input")
        page.type("input[aria-label='Name of the recording']", "walk")
        page.click(".recorder button", "Record")
        page.wait("return /walk\\.bag · \\d+:\\d\\d/.test(document.querySelector('.recording').textContent)")
        page.wait_text(".recording", " kB")
        # The page's own subscription shows the rate; the recorder is another node.
        wait_until(
            lambda: any(name.startswith("/record_") for name in talking.subscribers),
            PATIENCE,
            "the recorder does not subscribe",
        )
        served.run(talking.publish(String("hello")))
        page.click(".recording button", "Stop")
        page.wait_text(".recording", "saved")
    page.choose("select[aria-label='Bag']", "walk.bag")
    page.wait_text(".card[data-topic='/robot/words']", "hello")
    with Bags([str(folder / "walk.bag")]) as bags:
        assert {each.topic for each in bags.readers[0].connections.values()} == {"/robot/words"}
    assert os.listdir(folder) == ["walk.bag"]
    # The bag replaces the form, whose name is now in use.
    page.wait("return !document.querySelector('.recorder').checkVisibility()")
    page.click("button", "Record …")
    page.type("input[aria-label='Name of the recording']", "walk")
    page.click(".recorder button", "Record")
    page.wait_text("p.error", "walk.bag exists already")


@needs_chromium
def test_bag_that_is_broken_is_named(
    serve: Callable[..., Served], browse: Callable[..., Page], folder: Path
) -> None:
    (folder / "broken.bag").write_bytes(b"no bag")
    page = browse(address(serve(), "bag?file=broken.bag"))
    page.wait_text("p.error", "broken.bag")
