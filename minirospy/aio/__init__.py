"""The asyncio-native API: nodes that run in the program's own event loop, without a thread.

::

    async with Node("listener") as node:
        async for scan in node.subscribe("/scan", LaserScan):
            await node.publish("/nearest", Float32(min(scan.ranges)))

A program may have any number of nodes. They use the same objects as the rospy API
(``minirospy.runtime``). Examples: docs/asyncio.md.
"""

from __future__ import annotations

from minirospy.aio.node import Node
from minirospy.aio.services import Service, ServiceClass, ServiceProxy
from minirospy.aio.time import Rate
from minirospy.aio.topics import Publisher, Subscription

__all__ = ["Node", "Publisher", "Rate", "Service", "ServiceClass", "ServiceProxy", "Subscription"]
