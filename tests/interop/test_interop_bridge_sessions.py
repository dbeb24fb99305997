"""Complete sessions of the JavaScript clients of Foxglove and rosbridge, including a restart of the bridge."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

from actionlib_tutorials.msg import FibonacciAction, FibonacciGoal
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import Image
from std_msgs.msg import String
from std_srvs.srv import SetBool
from tf2_msgs.msg import TFMessage

from minirospy import Node
from minirospy.ros.actionlib.actionlib.aio import ActionClient, ActionServer
from tests.interop.conftest import PATIENCE
from tests.interop.gate import Gate, serving
from tests.interop.test_interop_foreign import Peer, modules
from tests.waiting import until

__all__ = ["modules"]

DATA = bytes(range(256)) * 3600
DIGEST = hashlib.sha1(DATA).hexdigest()
SECONDS = 500  # timeout of a scene, longer than the sum of its waits


def transform(child: str, node: Node) -> TFMessage:
    found = TransformStamped(child_frame_id=child)
    found.header.frame_id, found.header.stamp = "world", node.now()
    found.transform.translation.x = 1.5
    found.transform.rotation.w = 1.0
    return TFMessage([found])


@contextlib.asynccontextmanager
async def robot() -> AsyncIterator[Node]:
    """Run a node with latched topics, tf, services and an action."""

    async def execute(goal: Any) -> dict[str, Any]:
        # The client may not be connected to all of the topics yet.
        await server._feedback.wait_for_subscribers()
        await server._result.wait_for_subscribers()
        await goal.publish_feedback(sequence=[9])
        return {"sequence": list(range(goal.request.order))}

    def refuse(_: Any) -> Any:
        raise ValueError("not today")

    async def move() -> None:
        moving = await node.advertise("/tf", TFMessage)
        while True:
            await moving.publish(transform("wheel", node))
            await asyncio.sleep(0.1)

    async with Node("robot", rosout=False) as node:
        image = Image(height=480, width=640, encoding="rgb8", step=1920, data=DATA)
        for topic, message in (
            ("/latched", String("hello")),
            ("/image", image),
            ("/tf_static", transform("camera", node)),
        ):
            await (await node.advertise(topic, type(message), latch=True)).publish(message)
        await node.serve("/set", SetBool, lambda request: (request.data, "from minirospy"))
        await node.serve("/refuse", SetBool, refuse)
        server: Any = ActionServer(node, "/fibonacci", FibonacciAction, execute)
        await server
        moving = asyncio.ensure_future(move())
        try:
            yield node
        finally:
            moving.cancel()
            await asyncio.gather(moving, return_exceptions=True)
            await server.close()


async def call(node: Node, name: str) -> str:
    """Return a service's response once it is registered. A client that offers a service is not notified of the registration."""
    await node.wait_for_service(name, PATIENCE)
    return str((await node.call(name, SetBool, True)).message)


def run(scene: Any) -> None:
    asyncio.run(asyncio.wait_for(scene, SECONDS))


def test_session_of_the_apps_survives_a_restart_of_the_bridge(master: str, modules: Path) -> None:
    async def scene() -> None:
        async with Gate() as gate, robot() as node:
            async with serving(gate, "foxglove") as bridge:
                url = f"ws://127.0.0.1:{gate.port}"
                peer = await Peer.start(modules, "foxglove_ws_session.js", BRIDGE_URL=url)
                try:
                    assert await peer.says("image") == [640, "rgb8", DIGEST]
                    assert await peer.says("tf_static") == ["camera"]
                    assert await peer.says("tf") == ["wheel"]
                    assert await peer.says("action") == [[9], [0, 1, 2, 3]]
                    await peer.says("watching")
                    await until(lambda: "/" in bridge.node._node.parameters, SECONDS)
                    await node.set_param("/speed", 2.5)
                    assert await peer.says("changed") == [{"name": "/speed", "value": 2.5, "type": "float64"}]
                    await node.delete_param("/speed")
                    assert await peer.says("changed") == [{"name": "/speed"}]
                    await node.set_param("/speed", "slow")
                    assert await peer.says("changed") == [{"name": "/speed", "value": "slow"}]
                except BaseException:
                    await peer.end()
                    raise
            try:
                async with serving(gate, "foxglove"):
                    assert await peer.says("again") == [True, 640]
            finally:
                await peer.end()

    run(scene())


def test_session_of_roslib_js_survives_a_restart_of_the_bridge(master: str, modules: Path) -> None:
    async def scene() -> None:
        options = {"rosapi": True, "transforms": True}
        async with Gate() as gate, robot() as node:
            copies = await node.subscribe("/image_copy", Image)
            async with serving(gate, "rosbridge", **options):
                url = f"ws://127.0.0.1:{gate.port}"
                peer = await Peer.start(modules, "roslib_session.mjs", BRIDGE_URL=url)
                try:
                    assert await peer.says("image") == [640, DIGEST]
                    assert await peer.says("cbor") == DIGEST
                    assert bytes((await copies.next(PATIENCE)).data) == DATA
                    assert await peer.says("service") == {"success": True, "message": "from minirospy"}
                    assert "not today" in await peer.says("refusal")
                    assert await peer.says("parameter") == {"speed": 2.5, "list": [1, "two"]}
                    assert await peer.says("action") == [[9], [0, 1, 2, 3], 3]
                    assert await peer.says("tf") == [1.5, 1]
                    await peer.says("ready")
                    assert await call(node, "/ours") == "from roslib.js"
                    assert await call(node, "/ours_later") == "later"
                    client: Any = ActionClient(node, "/js_fibonacci", FibonacciAction)
                    async with client:
                        await client.wait_for_server(PATIENCE)
                        assert list((await client.send(FibonacciGoal(order=3))).sequence) == [0, 1, 2]
                    assert await peer.says("latched") == "hello"
                except BaseException:
                    await peer.end()
                    raise
            try:
                async with serving(gate, "rosbridge", **options):
                    again = {"success": False, "message": "from minirospy"}
                    assert await peer.says("again") == ["hello", again]
                    await peer.says("offered")
                    assert await call(node, "/ours") == "again"
            finally:
                await peer.end()

    run(scene())
