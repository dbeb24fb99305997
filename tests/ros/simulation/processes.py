"""The node /gazebo and other programs as processes, and a client that calls its services."""

from __future__ import annotations

import asyncio
import subprocess
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from minirospy import Node
from minirospy.aio.topics import Subscription
from tests.ros.robot_state_publisher.conftest import SECONDS, Start, end

pytest.importorskip("mujoco", reason="mujoco-core is not installed: pip install minirospy[sim]")

Body = Callable[[Node], Awaitable[None]]

BOX = """<robot name="box">
  <link name="base_link">
    <inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
    <visual><geometry><box size="1 1 1"/></geometry></visual>
    <collision><geometry><box size="1 1 1"/></geometry></collision>
  </link>
</robot>"""


def run(body: Body) -> None:
    """Run a coroutine with a node."""

    async def main() -> None:
        async with Node("test", rosout=False) as node:
            await asyncio.wait_for(body(node), SECONDS)

    asyncio.run(main())


async def call(node: Node, service: str, kind: Any, *values: object) -> Any:
    """Call a service of /gazebo after waiting for it; return its response."""
    await node.wait_for_service(f"/gazebo/{service}", SECONDS)
    return await node.call(f"/gazebo/{service}", kind, *values)


async def until(node: Node, topic: str, kind: Any, is_right: Callable[[Any], bool]) -> Any:
    """Return the first message on a topic that meets a condition."""
    return await first_of(node.subscribe(topic, kind), is_right)


async def connected(node: Node, topic: str, kind: Any) -> Subscription[Any]:
    """Return a subscription that is connected, and that keeps all messages from now on."""
    messages: Subscription[Any] = node.subscribe(topic, kind, queue_size=100_000)
    await messages.wait_for_publishers(1, SECONDS)
    return messages


async def first_of(messages: Subscription[Any], is_right: Callable[[Any], bool]) -> Any:
    """Return the first of a subscription's further messages that meets a condition."""
    async for message in messages:
        if is_right(message):
            return message
    raise AssertionError


def start_world(start: Start, *words: str) -> subprocess.Popen[str]:
    """Start gzserver."""
    return start("gazebo_ros", "gzserver", *words, "__name:=gazebo")


def written(folder: Path, name: str, text: str) -> str:
    """Write a file; return its path."""
    file = folder / name
    file.write_text(text)
    return str(file)


__all__ = [
    "BOX",
    "Body",
    "Start",
    "call",
    "connected",
    "end",
    "first_of",
    "run",
    "start_world",
    "until",
    "written",
]
