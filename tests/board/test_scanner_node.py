"""The simulated scanner as a node: its messages, and the interfaces that move the person in front of it."""

from __future__ import annotations

import asyncio
import math
import subprocess
import sys
from collections.abc import Coroutine, Iterator
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Point
from minirospy_msgs.srv import MovePerson
from sensor_msgs.msg import LaserScan
from sick_safetyscanners.msg import OutputPathsMsg, RawMicroScanDataMsg

from minirospy import Node
from minirospy.board.board import Board
from minirospy.board.scanner import BEAMS
from minirospy.runtime.rpc.master_proxy import MasterProxy, SlaveProxy
from minirospy.runtime.transport.loop import new_event_loop
from tests.waiting import until

NODE = Path(__file__).parents[2] / "msgs" / "sick_safetyscanners" / "scripts" / "sick_safetyscanners_node"
SECONDS = 100.0
FREE, WARNING, PROTECTIVE = [True, True], [True, False], [False, False]


@pytest.fixture
def scanner(master: str) -> Iterator[subprocess.Popen[str]]:
    node = subprocess.Popen(
        [sys.executable, NODE, "__ns:=/sick_safetyscanners", "_intrusion_data:=false"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    yield node
    with Board() as board:
        board.move_person((0.5, 0.0))
        end(node, master)
        said, _ = node.communicate(timeout=30)
        assert "Traceback" not in said
        assert node.returncode == 0
        # The person is removed when the node closes.
        run(until_person_is(board, None))


def end(node: subprocess.Popen[str], master: str) -> None:
    """End the node by SIGTERM; on Windows by a request, because terminate() there kills it before its clean-up."""
    if sys.platform != "win32":
        node.terminate()
        return
    proxy = MasterProxy(master, "/test")
    slave = SlaveProxy(proxy.lookup_node("/sick_safetyscanners/sick_safetyscanners"), "/test")
    slave.shutdown("the test has ended")
    slave.close()
    proxy.close()


def run(main: Coroutine[Any, Any, None]) -> None:
    """Run ``main`` on a loop that can watch sockets on Windows, too."""
    loop = new_event_loop()
    try:
        loop.run_until_complete(asyncio.wait_for(main, SECONDS))
    finally:
        loop.close()


async def until_person_is(board: Board, wanted: object) -> None:
    """Wait until each board, which has its own connection, has the person at this position."""
    await until(lambda: board.person == wanted)


async def until_paths_are(node: Node, wanted: list[bool]) -> None:
    async for paths in node.subscribe("output_paths", OutputPathsMsg, queue_size=1):
        if list(paths.status[:2]) == wanted:
            return


def test_scan_follows_a_moved_person(scanner: subprocess.Popen[str]) -> None:
    async def main() -> None:
        with Board() as board:
            async with Node("test", namespace="sick_safetyscanners", rosout=False) as node:
                await until_paths_are(node, FREE)
                board.move_person((0.5, 0.0))
                await until_paths_are(node, WARNING)
                person = await node.advertise("person", Point)
                await person.wait_for_subscribers()
                await person.publish(Point(x=0.3))
                await until_paths_are(node, PROTECTIVE)
                await until_person_is(board, (0.3, 0.0))
                answer = await node.call("move_person", MovePerson, True, 2.0, -1.0)

                assert (answer.success, answer.message) == (True, "the person is at x 2.00 m, y -1.00 m")
                await until_paths_are(node, FREE)
                answer = await node.call("move_person", MovePerson, True, 50.0, 0.0)

                assert (answer.success, answer.message) == (
                    False,
                    "x and y are metres, within 40 m of the scanner",
                )
                await until_person_is(board, (2.0, -1.0))
                assert (await node.call("move_person", MovePerson, present=False)).success

                await until_person_is(board, None)
                await person.publish(Point(x=0.3))
                await until_paths_are(node, PROTECTIVE)
                await person.publish(Point(x=math.nan))
                await until_paths_are(node, FREE)

    run(main())


def test_raw_data_match_the_scan(scanner: subprocess.Popen[str]) -> None:
    async def main() -> None:
        with Board() as board:
            # This position is next to the reflector on the wall ahead.
            board.move_person((0.0, 0.3))
            async with Node("test", namespace="sick_safetyscanners", rosout=False) as node:
                await until_paths_are(node, PROTECTIVE)
                raw = await node.wait_for_message("raw_data", RawMicroScanDataMsg)
                scan = await node.wait_for_message("scan", LaserScan)

        values, points = raw.derived_values, raw.measurement_data.scan_points
        assert raw.measurement_data.number_of_beams == values.number_of_beams == len(points) == BEAMS
        assert math.radians(values.start_angle) == pytest.approx(scan.angle_min)
        assert values.scan_time == 30
        assert min(point.distance for point in points if point.valid) == pytest.approx(150, abs=25)
        assert min(scan.ranges) == pytest.approx(0.15, abs=0.025)
        assert [point.infinite for point in points] == [math.isinf(distance) for distance in scan.ranges]
        assert any(point.reflector for point in points)
        assert list(raw.general_system_state.safe_cut_off_path[:2]) == PROTECTIVE
        assert list(raw.application_data.outputs.evaluation_path_outputs_eval_out[:2]) == PROTECTIVE
        # A parameter has switched this data off.
        assert raw.intrusion_data.data == []

    run(main())
