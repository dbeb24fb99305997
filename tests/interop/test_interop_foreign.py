"""Third-party ROS 1 clients from npm, rosnodejs and @foxglove/ros1, with minirospy's master and nodes, in both directions.

The clients are installed once, into the user's cache folder.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Coroutine
from pathlib import Path
from typing import Any

import pytest
from actionlib_tutorials.msg import FibonacciAction, FibonacciGoal
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Int32
from std_srvs.srv import SetBool, SetBoolResponse

from minirospy import Node
from minirospy.base.times import Time
from minirospy.ros.actionlib.actionlib.aio import ActionClient, ActionServer
from tests.interop.conftest import PATIENCE

FOREIGN = Path(__file__).parent / "foreign"
MSGS = Path(__file__).parents[2] / "msgs"
SCAN = {"frame": "zażółć", "ranges": [0.5, 1.5, 2.5], "range_max": 40.5}


@pytest.fixture(scope="session")
def modules() -> Path:
    """Return the folder node_modules with both clients."""
    npm = shutil.which("npm")
    if not npm or not shutil.which("node"):
        pytest.skip(
            "npm's clients of ROS 1 are not tested: node and npm are not installed (apt-get install npm)"
        )
    digest = hashlib.sha256((FOREIGN / "package.json").read_bytes()).hexdigest()[:12]
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "minirospy-tests"
    place = cache / f"npm-{digest}"

    if not place.exists():
        cache.mkdir(parents=True, exist_ok=True)
        folder = Path(tempfile.mkdtemp(dir=cache))
        shutil.copy(FOREIGN / "package.json", folder)
        words = [npm, "install", "--no-audit", "--no-fund", "--no-package-lock", "--ignore-scripts"]
        subprocess.run(words, cwd=folder, check=True, capture_output=True, timeout=300)
        try:
            folder.rename(place)
        except OSError:  # another worker installed it first
            shutil.rmtree(folder)

    return place / "node_modules"


class Peer:
    """A program that runs under node, and the lines that it prints."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process
        self.said: dict[str, list[Any]] = {}

    @classmethod
    async def start(cls, modules: Path, script: str, **variables: str) -> Peer:
        """Start ``script`` from the folder foreign."""
        # Node looks for a module next to its script's real path, then in NODE_PATH.
        environ = {**os.environ, "NODE_PATH": str(modules), "ROS_PACKAGE_PATH": str(MSGS), **variables}
        environ.setdefault("CMAKE_PREFIX_PATH", str(MSGS))  # rosnodejs needs the variable, with any value
        process = await asyncio.create_subprocess_exec(
            "node",
            str(FOREIGN / script),
            env=environ,
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
        )
        return cls(process)

    async def line(self) -> str:
        """Return the next line."""
        assert self._process.stdout
        return (await asyncio.wait_for(self._process.stdout.readline(), PATIENCE)).decode().rstrip()

    async def says(self, what: str) -> Any:
        """Return the value that the program prints for the key ``what``, now or earlier."""
        while not self.said.get(what):
            line = await self.line()
            assert line, f"it ended without {what}: {self.said}"
            if line.startswith('{"what":'):
                event = json.loads(line)
                assert event["what"] != "error", event
                self.said.setdefault(event["what"], []).append(event["value"])
        return self.said[what].pop(0)

    async def end(self) -> None:
        """Stop the program."""
        assert self._process.stdin
        self._process.stdin.close()
        try:
            await asyncio.wait_for(self._process.wait(), 20)
        except asyncio.TimeoutError:
            self._process.kill()
            await self._process.wait()


def run(scene: Coroutine[Any, Any, None]) -> None:
    asyncio.run(asyncio.wait_for(scene, 2 * PATIENCE))


def scan() -> LaserScan:
    message = LaserScan(ranges=SCAN["ranges"], range_max=40.5)
    message.header.frame_id = SCAN["frame"]
    message.header.stamp = Time(1234567890, 987654321)
    return message


async def offer(node: Node) -> None:
    """Check that a third-party node can use minirospy's topics, services and parameters."""
    await (await node.advertise("/ours/scan", LaserScan, latch=True)).publish(scan())
    await node.set_param("/ours/param", {"list": [1, "two", 3.5], "flag": True})


async def check_scan(node: Node) -> None:
    """Check that the third-party node's scan arrives unchanged."""
    got = await node.wait_for_message("/foreign/scan", LaserScan, timeout=PATIENCE)
    assert (got.header.frame_id, list(got.ranges), got.range_max) == tuple(SCAN.values())
    assert got.header.stamp == Time(1234567890, 987654321)


async def check_beats(node: Node, peer: Peer) -> None:
    """Check that minirospy's messages arrive complete and in order."""
    beats = await node.advertise("/ours/beat", Int32, queue_size=0)
    await beats.wait_for_subscribers(timeout=PATIENCE)
    for number in range(100):
        await beats.publish(number)
    assert [await peer.says("beat") for _ in range(100)] == list(range(100))


async def set_flag(request: Any) -> Any:
    if not request.data:
        raise ValueError("not today")
    return SetBoolResponse(True, "from minirospy")


def test_rosnodejs_exchanges_messages_and_calls(master: str, modules: Path) -> None:
    async def scene() -> None:
        async with Node("ours") as node:
            await offer(node)
            await node.serve("/ours/flag", SetBool, set_flag)

            async def execute(goal: Any) -> dict[str, Any]:
                return {"sequence": [1] * goal.request.order}

            async with ActionServer(node, "/ours/fibonacci", FibonacciAction, execute):
                peer = await Peer.start(modules, "rosnodejs_peer.js")
                try:
                    await peer.says("ready")
                    await check_scan(node)
                    await check_beats(node, peer)
                    got = await peer.says("scan")
                    assert got == {**SCAN, "stamp": {"secs": 1234567890, "nsecs": 987654321}}
                    assert await peer.says("flag") == {"success": True, "message": "from minirospy"}
                    assert "not today" in await peer.says("refused")
                    assert await peer.says("param") == {"list": [1, "two", 3.5], "flag": True}
                    assert await peer.says("has") == [True, False]
                    assert await node.get_param("/foreign/param") == {"list": [1, "two", 3.5], "flag": True}
                    response = await node.call("/foreign/flag", SetBool, data=True)
                    assert (response.success, response.message) == (True, "from rosnodejs: zażółć")
                    proxy = node.service_proxy("/foreign/flag", SetBool, persistent=True)
                    assert [(await proxy(flag)).success for flag in (True, False, True)] == [
                        True,
                        False,
                        True,
                    ]
                    proxy.close()
                    async with ActionClient(node, "/foreign/fibonacci", FibonacciAction) as action:
                        goal = action.send(FibonacciGoal(4))
                        feedback = []
                        async for each in goal:
                            feedback.append(list(each.sequence))
                            await node.set_param("/foreign/heard", True)
                        assert feedback == [[0]]
                        assert list((await goal).sequence) == [7] * 4
                    assert await peer.says("fibonacci") == [1, 1, 1]
                    await peer.says("done")
                    assert not await node.has_param("/ours/param")
                finally:
                    await peer.end()

    run(scene())


def test_foxglove_client_exchanges_messages_and_calls(master: str, modules: Path) -> None:
    async def scene() -> None:
        async with Node("ours") as node:
            await offer(node)
            texts = {"FULL_TEXT": LaserScan._full_text, "MD5SUM": LaserScan._md5sum}
            peer = await Peer.start(modules, "foxglove_peer.js", **texts)
            try:
                await peer.says("ready")
                await check_scan(node)
                await check_beats(node, peer)
                assert await peer.says("scan") == {**SCAN, "stamp": {"sec": 1234567890, "nsec": 987654321}}
                assert await peer.says("header") == {"type": LaserScan._type, "md5sum": LaserScan._md5sum}
                assert await peer.says("param") == {"list": [1, "two", 3.5], "flag": True}
                assert await peer.says("publishers") == ["/ours"]
                assert await node.get_param("/foreign/param") == {"list": [1, "two", 3.5], "flag": True}
                await node.set_param("/ours/param/flag", False)
                assert await peer.says("paramUpdate") == {"key": "/ours/param/flag", "value": False}
            finally:
                await peer.end()

    run(scene())


def test_our_nodes_use_the_master_of_foxglove(modules: Path) -> None:
    async def scene() -> None:
        master = await Peer.start(modules, "foxglove_master.js")

        try:
            uri = await master.line()

            async with Node("ours", master_uri=uri) as node, Node("others", master_uri=uri) as others:
                await offer(node)
                got = await others.wait_for_message("/ours/scan", LaserScan, timeout=PATIENCE)
                assert list(got.ranges) == SCAN["ranges"]
                await node.serve("/ours/flag", SetBool, set_flag)
                assert (await others.call("/ours/flag", SetBool, data=True)).success
                assert await others.get_param("/ours/param/list") == [1, "two", 3.5]
                # The client has no getPid, which rospy's init_node calls to check the master.
                words = [
                    sys.executable,
                    "-c",
                    "import rospy; rospy.init_node('x'); print(rospy.get_param_names())",
                ]
                process = await asyncio.create_subprocess_exec(
                    *words, env={**os.environ, "ROS_MASTER_URI": uri}, stdout=asyncio.subprocess.PIPE
                )
                assert b"/ours/param/list" in (await process.communicate())[0]
        finally:
            await master.end()

    run(scene())
