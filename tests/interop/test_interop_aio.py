"""A node of the asyncio API with nodes of real rospy, with minirospy's master and with the real one."""

from __future__ import annotations

import asyncio
import os
import subprocess
from collections.abc import Iterator
from contextlib import suppress

import pytest
from std_msgs.msg import String
from std_srvs.srv import SetBool, SetBoolRequest, Trigger

from minirospy import Node
from minirospy.base.errors import ServiceException
from tests.interop.conftest import PATIENCE
from tests.waiting import until

PEER = """
import sys
import rospy
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger


def fail(request):
    raise ValueError("bad thing")


rospy.init_node("peer")
publisher = rospy.Publisher("/from_peer", String, queue_size=10)
subscriber = rospy.Subscriber("/to_peer", String, lambda message: publisher.publish("heard " + message.data))
services = [
    rospy.Service("/peer_flag", SetBool, lambda request: (request.data, "peer")),
    rospy.Service("/peer_fails", Trigger, fail),
]
print("ready", flush=True)
for line in sys.stdin:
    rospy.wait_for_service("/aio_flag", timeout=150)
    for persistent in (False, True):
        proxy = rospy.ServiceProxy("/aio_flag", SetBool, persistent=persistent)
        print(proxy(True).message, proxy(False).message, rospy.get_param("/aio/speed"), flush=True)
"""


@pytest.fixture
def peer(any_master: str) -> Iterator[subprocess.Popen[str]]:
    """Run the peer under real rospy until the test finishes."""
    environment = {**os.environ, "ROS_MASTER_URI": any_master}
    program = subprocess.Popen(
        ["/usr/bin/python3", "-c", PEER],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert program.stdout
    assert program.stdout.readline() == "ready\n"
    yield program
    # Close stdin, which makes the program exit.
    program.communicate(timeout=PATIENCE)


async def set_flag(request: SetBoolRequest) -> tuple[bool, str]:
    return request.data, f"flag={request.data}"


def test_aio_node_exchanges_topics_services_and_parameters(
    any_master: str, peer: subprocess.Popen[str]
) -> None:
    async def main() -> None:
        async with Node("aio", master_uri=any_master) as node:
            await node.set_param("~speed", 2.5)
            answers = await node.subscribe("/from_peer", String)
            publisher = await node.advertise("/to_peer", String)
            await publisher.wait_for_subscribers()
            await until(lambda: answers.num_connections == 1, PATIENCE)
            # rospy answers the handshake of a subscriber before it sends messages to it, so a first answer may be lost.
            words: set[str] = set()
            while "heard ready" not in words:
                await publisher.publish("ready")
                with suppress(TimeoutError):
                    words.add((await answers.next(0.1)).data)
            for word in ("one", "zażółć"):
                await publisher.publish(word)
                while (heard := (await answers.next()).data) == "heard ready":
                    pass
                assert heard == "heard " + word

            await node.wait_for_service("/peer_flag", PATIENCE)
            assert (await node.call("/peer_flag", SetBool, True)).message == "peer"
            proxy = node.service_proxy("/peer_flag", SetBool, persistent=True)
            assert [(await proxy(flag)).success for flag in (True, False, True)] == [True, False, True]
            proxy.close()
            with pytest.raises(ServiceException, match="error processing request: bad thing"):
                await node.call("/peer_fails", Trigger)

            await node.serve("/aio_flag", SetBool, set_flag)
            assert peer.stdin
            assert peer.stdout
            peer.stdin.write("call\n")
            peer.stdin.flush()
            for _ in range(2):
                line = await asyncio.to_thread(peer.stdout.readline)
                assert line == "flag=True flag=False 2.5\n"

    asyncio.run(asyncio.wait_for(main(), 2 * PATIENCE))
