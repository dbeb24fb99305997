"""The bridge with roslibpy and roslib.js, rosbridge's clients in Python and JavaScript.

roslibpy needs twisted and autobahn, so it is installed once into a separate environment in the user's cache folder.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import pytest
from actionlib_tutorials.msg import FibonacciAction, FibonacciActionResult, FibonacciGoal
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import Image, LaserScan
from std_msgs.msg import String
from std_srvs.srv import SetBool
from tf2_msgs.msg import TFMessage

from minirospy import Node
from minirospy.base.errors import ServiceException
from minirospy.ros.actionlib.actionlib.aio import ActionClient, ActionServer
from minirospy.web.bridge import Bridge, BridgeOptions
from tests.interop.conftest import PATIENCE
from tests.interop.gate import Gate, serving
from tests.interop.test_interop_foreign import modules

__all__ = ["modules"]

PEER = Path(__file__).parent / "roslibpy_peer.py"
ROSLIB = Path(__file__).parent / "foreign" / "roslib_peer.mjs"
RELEASE = "roslibpy==2.1.0"
DATA = bytes(range(256)) * 3600


@pytest.fixture(scope="session")
def roslibpy_python() -> str:
    """Return the Python of an environment with roslibpy."""
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "minirospy-tests"
    place = cache / f"{RELEASE.replace('==', '-')}-{sys.version_info.major}{sys.version_info.minor}"
    python = place / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    if not python.exists():
        cache.mkdir(parents=True, exist_ok=True)
        # Other workers may do this at the same time: each creates its own environment, and the first to finish moves
        # it into place.
        made = Path(tempfile.mkdtemp(dir=cache))
        subprocess.run([sys.executable, "-m", "venv", made], check=True, timeout=120)
        inner = made / python.relative_to(place)
        words = [inner, "-m", "pip", "install", "-q", RELEASE]
        done = subprocess.run(words, check=False, capture_output=True, text=True, timeout=300)
        if done.returncode:
            shutil.rmtree(made)
            pytest.skip(f"{RELEASE} cannot be installed: {done.stderr[-300:]}")
        try:
            made.rename(place)
        except OSError:
            shutil.rmtree(made)
    return str(python)


async def serve(node: Node) -> list[Any]:
    """Offer the topics, services and actions that the peer uses."""

    async def execute(goal: Any) -> dict[str, Any]:
        # The bridge may not be connected to the result yet.
        await results.wait_for_subscribers(timeout=PATIENCE)
        return {"sequence": list(range(goal.request.order))}

    latched = await node.advertise("/latched", String, latch=True)
    await latched.publish(String("hello"))
    images = await node.advertise("/image", Image, latch=True)
    await images.publish(Image(height=480, width=640, encoding="rgb8", step=1920, data=DATA))
    static = await node.advertise("/tf_static", TFMessage, latch=True)
    transform = TransformStamped(child_frame_id="camera")
    transform.header.frame_id = "world"
    transform.transform.translation.x = 1.5
    transform.transform.rotation.w = 1.0
    await static.publish(TFMessage([transform]))
    service = await node.serve("/set", SetBool, lambda request: (request.data, "from minirospy"))
    action: Any = ActionServer(node, "/fibonacci", FibonacciAction, execute)
    await action
    results = await node.advertise("/fibonacci/result", FibonacciActionResult)
    return [latched, images, static, service, action]


def test_roslibpy_uses_all_that_the_bridge_offers(master: str, roslibpy_python: str) -> None:
    async def run() -> tuple[dict[str, Any], list[Any]]:
        options = {"rosapi": True, "transforms": True}
        async with Gate() as gate, Node("peer", rosout=False) as node:
            offers = await serve(node)
            published = node.subscribe("/from_roslibpy", String)
            copies = node.subscribe("/image_copy", Image)
            client: Any = ActionClient(node, "/py_fibonacci", FibonacciAction)
            async with contextlib.AsyncExitStack() as stack:
                async with serving(gate, "rosbridge", **options):
                    peer = await asyncio.create_subprocess_exec(
                        roslibpy_python,
                        str(PEER),
                        str(gate.port),
                        stdin=asyncio.subprocess.PIPE,
                        stdout=asyncio.subprocess.PIPE,
                        stderr=asyncio.subprocess.PIPE,
                    )
                    stack.push_async_callback(end, peer)
                    found = await line_of(peer)
                    text, copy = await published.next(PATIENCE), await copies.next(PATIENCE)
                    await node.wait_for_service("/ours", PATIENCE)
                    response = await node.call("/ours", SetBool, True)
                    async with client:
                        await client.wait_for_server(PATIENCE)
                        result = await client.send(FibonacciGoal(order=3))

                async with serving(gate, "rosbridge", **options):
                    again = await line_of(peer)
                    answer = None
                    while answer is None:
                        # roslibpy offers its services again only a second after it has lost its connection.
                        with contextlib.suppress(ServiceException):
                            answer = await node.call("/ours", SetBool, False)
            await offers[-1].close()
            ours = [text.data, bytes(copy.data) == DATA, response.success, response.message]
            return found, [*ours, list(result.sequence), again, answer.success]

    found, ours = asyncio.run(run())
    assert found == {
        "latched": {"data": "hello"},
        "image": [640, len(DATA)],
        "service": {"success": True, "message": "from minirospy"},
        "parameter": 1.5,
        "topics": True,
        "type": "std_msgs/String",
        "time": True,
        "details": ["data"],
        "nodes": True,
        "action": [0, 1, 2],
        "tf": 1.5,
    }
    assert ours == [
        *("hello", True, True, "from roslibpy", [0, 1, 2]),
        [{"data": "hello"}, {"success": False, "message": "from minirospy"}],
        False,
    ]


async def line_of(peer: asyncio.subprocess.Process) -> Any:
    """Return the next JSON line that a program prints."""
    assert peer.stdout
    assert peer.stderr
    line = await asyncio.wait_for(peer.stdout.readline(), PATIENCE)
    if not line:
        raise AssertionError((await peer.stderr.read()).decode())
    return json.loads(line)


async def end(peer: asyncio.subprocess.Process) -> None:
    """Stop a program."""
    peer.kill()
    await peer.communicate()


def test_roslib_js_reads_every_compression(master: str, modules: Path) -> None:
    async def run() -> dict[str, Any]:
        async with Node("peer", rosout=False) as node, Node("bridge", rosout=False) as inner:
            scans = await node.advertise("/latched_scan", LaserScan, latch=True)
            await scans.publish(LaserScan(ranges=[1.5, 2.5]))
            options = BridgeOptions(foxglove_port=None, rosbridge_port=0, diagnostics=False, rosapi=True)
            bridge = Bridge(inner, options)
            await bridge.start()
            peer = await asyncio.create_subprocess_exec(
                *("node", str(ROSLIB), str(bridge.listeners["rosbridge"].port)),
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.PIPE,
                env={**os.environ, "NODE_PATH": str(modules)},
            )
            try:
                output, errors = await asyncio.wait_for(peer.communicate(), PATIENCE)
            finally:
                if peer.returncode is None:
                    peer.kill()
                    await peer.wait()
                await bridge.close()
            assert output, errors.decode()
            found: dict[str, Any] = json.loads(output)
            return found

    assert asyncio.run(run()) == {
        "none": [1.5, 2.5],
        "png": [1.5, 2.5],
        "cbor": [1.5, 2.5],
        "cbor-raw": ["secs", "nsecs", "bytes"],
        "topics": True,
        "parameter": 2.5,
    }
