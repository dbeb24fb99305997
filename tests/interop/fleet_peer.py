"""A robot or a control room in a network namespace, with a master, nodes and a gateway.

Prints its observations, one JSON object per line.
"""

from __future__ import annotations

import asyncio
import json
import sys

from geometry_msgs.msg import TwistStamped
from sensor_msgs.msg import Image

from minirospy import Node
from minirospy.fleet.gateway import Gateway, GatewayOptions
from minirospy.fleet.network import NetworkOptions
from minirospy.runtime.master.master import Master

IMAGE = bytes(300_000)


async def robot(node: Node) -> None:
    """Publish more images than the link can carry, and five velocities per second."""
    images = await node.advertise("/image", Image, queue_size=1)
    velocities = await node.advertise("/velocity", TwistStamped)
    while True:
        for _ in range(4):
            await images.publish(Image(data=IMAGE))
            await asyncio.sleep(0.05)
        await velocities.publish(TwistStamped())


async def room(node: Node, counts: dict[str, int]) -> None:
    """Count the messages that arrive."""

    async def read(topic: str, cls: type) -> None:
        async for _ in node.subscribe(topic, cls, queue_size=1000):
            counts[topic] = counts.get(topic, 0) + 1

    await asyncio.gather(read("/robot1/image", Image), read("/robot1/velocity", TwistStamped))


async def main() -> None:
    role, endpoint = sys.argv[1:]
    is_robot = role == "robot"
    master = Master()
    await master.start()
    uri = f"http://localhost:{master.port}"
    network = NetworkOptions(connect=(endpoint,)) if is_robot else NetworkOptions(listen=(endpoint,))
    async with (
        Node("gateway", rosout=False, master_uri=uri) as own,
        Node(role, rosout=False, master_uri=uri) as node,
    ):
        gateway = Gateway(
            own, GatewayOptions("robot1" if is_robot else "", imports=not is_robot, network=network)
        )
        await gateway.start()
        counts: dict[str, int] = {}
        node._spawn(robot(node) if is_robot else room(node, counts))
        ended = asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
        while not ended.done():
            print(json.dumps({"counts": counts, "status": gateway.status()}), flush=True)
            await asyncio.wait([ended], timeout=0.2)
        await gateway.close()
    await master.close()


if __name__ == "__main__":
    asyncio.run(main())
