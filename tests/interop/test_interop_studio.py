"""Foxglove Studio in Debian's chromium, in its last open source version on npm. It shows the graph through the bridge."""

from __future__ import annotations

import asyncio
import functools
import itertools
import json
import math
import threading
from collections.abc import Callable, Iterator
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import quote

import numpy
import PIL.Image
import pytest
from geometry_msgs.msg import Point, TransformStamped
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Image
from std_msgs.msg import ColorRGBA, Float64, String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker

from minirospy.aio.topics import Subscription
from minirospy.core.idl.protocols import Message
from tests.interop.browser import CHROMIUM, PATIENCE, Page
from tests.interop.test_interop_foreign import FOREIGN, modules
from tests.waiting import wait_until
from tests.web.conftest import Running, run_bridge

__all__ = ["modules", "run_bridge"]

pytestmark = pytest.mark.skipif(not CHROMIUM, reason="chromium is not installed: make interop")

LAYOUT = {
    "configById": {
        "3D!1": {
            "followTf": "map",
            "topics": {"/marker": {"visible": True}, "/tf_static": {"visible": True}},
        },
        "ImageViewPanel!1": {"cameraTopic": "/camera"},
        "Plot!1": {"paths": [{"value": "/sine.data", "enabled": True, "timestampMethod": "receiveTime"}]},
        "RawMessages!1": {"topicPath": "/chatter"},
        "Parameters!1": {},
        "RosOut!1": {},
        "Publish!1": {
            "topicName": "/from_studio",
            "datatype": "std_msgs/String",
            "buttonText": "Send it",
            "value": '{"data": "from Studio"}',
        },
    },
    "layout": {
        "direction": "row",
        "first": {"direction": "column", "first": "3D!1", "second": "Plot!1"},
        "second": {
            "direction": "row",
            "first": {"direction": "column", "first": "ImageViewPanel!1", "second": "RawMessages!1"},
            "second": {
                "direction": "column",
                "first": "Parameters!1",
                "second": {"direction": "column", "first": "RosOut!1", "second": "Publish!1"},
            },
        },
    },
    "globalVariables": {},
    "userNodes": {},
    "playbackConfig": {"speed": 1},
}
GREEN, PINK, PLOTTED = (20, 220, 40), (240, 60, 170), (0x4E, 0x98, 0xE2)


class _Files(SimpleHTTPRequestHandler):
    def translate_path(self, path: str) -> str:
        if path.startswith("/?"):
            return str(FOREIGN / "studio.html")
        return super().translate_path(path)

    def log_message(self, format: str, *args: object) -> None:
        """Suppress the log."""


@pytest.fixture
def studio(modules: Path) -> Iterator[Callable[[str, str], Page]]:
    """Return a function that opens Studio with a data source and its address."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(_Files, directory=modules))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    pages: list[Page] = []

    def open_studio(source: str, address: str) -> Page:
        words = f"?ds={source}&ds.url={quote(address, safe='')}#{quote(json.dumps(LAYOUT))}"
        pages.append(Page(f"http://localhost:{server.server_address[1]}/{words}", width=1400, height=850))
        return pages[-1]

    try:
        yield open_studio
    finally:
        for page in pages:
            page.close()
        server.shutdown()
        server.server_close()


class Robot:
    """A node that publishes for the panels, and subscribes to what they publish."""

    def __init__(self, bridge: Running) -> None:
        self._bridge = bridge
        self._node = bridge.node("robot")
        self.heard = ""  # the string in the last message on /from_studio

    def start(self) -> None:
        self._bridge.run(self._start())

    async def _start(self) -> None:
        await self._node.set_param("/robot/speed", 1.75)
        await self._latch("/chatter", String("it works"))
        await self._latch("/rosout", Log(level=Log.WARN, name="/robot", msg="the battery is low"))

        image = Image(height=8, width=8, encoding="rgb8", step=24, data=bytes(PINK) * 64)
        image.header.frame_id = "camera"
        await self._latch("/camera", image)
        frame = TransformStamped(child_frame_id="camera")
        frame.header.frame_id = "map"
        frame.transform.rotation.w = 1
        await self._latch("/tf_static", TFMessage([frame]))

        marker = Marker(type=Marker.TRIANGLE_LIST, color=ColorRGBA(*(each / 255 for each in GREEN), 1))
        marker.header.frame_id = "map"
        marker.pose.orientation.w = marker.scale.x = marker.scale.y = marker.scale.z = 1
        marker.points = [Point(-3, -3, 0), Point(3, -3, 0), Point(0, 4, 0)]
        await self._latch("/marker", marker)

        subscription = self._node.subscribe("/from_studio", String)
        self._tasks = [asyncio.ensure_future(self._hear(subscription)), asyncio.ensure_future(self._wave())]

    async def _latch(self, topic: str, message: Message) -> None:
        publisher = await self._node.advertise(topic, type(message), latch=True)
        await publisher.publish(message)

    async def _hear(self, subscription: Subscription[String]) -> None:
        async for message in subscription:
            self.heard = message.data

    async def _wave(self) -> None:
        sine = await self._node.advertise("/sine", Float64)
        for step in itertools.count():
            await sine.publish(math.sin(step / 10))
            await asyncio.sleep(0.05)

    def stop(self) -> None:
        for task in self._tasks:
            self._bridge.call(task.cancel)


@pytest.fixture
def bridge(run_bridge: Callable[..., Running]) -> Running:
    """Return a bridge with the endpoints that the command starts by default."""
    return run_bridge(rosapi=True)


@pytest.fixture
def robot(bridge: Running) -> Iterator[Robot]:
    robot = Robot(bridge)
    robot.start()
    yield robot
    robot.stop()


def count(page: Page, tmp_path: Path, color: tuple[int, int, int]) -> int:
    """Return how many visible pixels have approximately this colour."""
    path = tmp_path / "seen.png"
    page.screenshot(path)
    with PIL.Image.open(path) as seen:
        pixels = numpy.asarray(seen.convert("RGB")).astype(int)
    return int((abs(pixels - color).max(axis=2) < 40).sum())


def look(page: Page, robot: Robot, tmp_path: Path) -> None:
    """Check each panel, and publish from one."""
    page.wait_text("*", "it works")
    page.wait_text("*", "the battery is low")
    wait_until(lambda: count(page, tmp_path, PINK) > 5000, PATIENCE)
    wait_until(lambda: count(page, tmp_path, GREEN) > 5000, PATIENCE)
    wait_until(lambda: count(page, tmp_path, PLOTTED) > 200, PATIENCE)
    page.click("button", "Send it")
    wait_until(lambda: robot.heard == "from Studio", PATIENCE)
    assert page.errors == []


def test_studio_shows_the_graph_by_the_foxglove_protocol(
    bridge: Running, robot: Robot, studio: Callable[[str, str], Page], tmp_path: Path
) -> None:
    page = studio("foxglove-websocket", f"ws://localhost:{bridge.port}")
    look(page, robot, tmp_path)
    page.wait_text("*", "/robot/speed")
    page.wait_text("*", "minirospy bridge")


def test_studio_shows_the_graph_by_rosbridge(
    bridge: Running, robot: Robot, studio: Callable[[str, str], Page], tmp_path: Path
) -> None:
    look(
        studio("rosbridge-websocket", f"ws://localhost:{bridge.bridge.listeners['rosbridge'].port}"),
        robot,
        tmp_path,
    )
