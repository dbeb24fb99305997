"""map_server and map_saver as nodes."""

from __future__ import annotations

import asyncio
import subprocess
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap, LoadMap

from minirospy import Node
from minirospy.runtime.rpc.master_proxy import MasterProxy
from tests.ros.map_server.cases import FIELDS, USUAL
from tests.ros.robot_state_publisher.conftest import SECONDS, Start, end

CELLS = [-1, 0, 100, 0]


@pytest.fixture
def map_file(tmp_path: Path) -> Path:
    (tmp_path / "a.pgm").write_bytes(b"P5 2 2 255\n" + bytes((0, 255, 200, 254)))
    path = tmp_path / "a.yaml"
    path.write_text(f"image: a.pgm\n{FIELDS}{USUAL}")
    return path


def run(body: Callable[[Node], Awaitable[None]]) -> None:
    async def main() -> None:
        async with Node("test", rosout=False) as node:
            await asyncio.wait_for(body(node), SECONDS)

    asyncio.run(main())


def refusal(process: subprocess.Popen[str]) -> str:
    output, errors = process.communicate(timeout=SECONDS)
    assert "Traceback" not in errors
    return output + errors


def test_late_subscriber_gets_the_map_and_services_answer(
    start: Start, map_file: Path, tmp_path: Path
) -> None:
    process = start("map_server", "map_server", str(map_file), "_frame_id:=floor")

    async def body(node: Node) -> None:
        async for data in node.subscribe("map_metadata", MapMetaData):
            assert (data.width, data.height, data.origin.position.y) == (2, 2, 2.0)
            break
        async for grid in node.subscribe("map", OccupancyGrid):
            assert list(grid.data) == CELLS
            assert grid.header.frame_id == "floor"
            assert grid.header.stamp == grid.info.map_load_time or grid.header.stamp > grid.info.map_load_time
            break
        await node.wait_for_service("change_map")
        answer = await node.call("static_map", GetMap)
        assert list(answer.map.data) == CELLS
        assert answer.map.header.frame_id == "floor"

        missing = await node.call("change_map", LoadMap, map_url=str(tmp_path / "none.yaml"))
        assert missing.result == 255
        (tmp_path / "b.pgm").write_bytes(b"P5 1 1 255\n\0")
        (tmp_path / "b.yaml").write_text(f"image: b.pgm\n{FIELDS}{USUAL}")
        changed = await node.call("change_map", LoadMap, map_url=str(tmp_path / "b.yaml"))
        assert (changed.result, list(changed.map.data)) == (0, [100])
        async for grid in node.subscribe("map", OccupancyGrid):
            assert list(grid.data) == [100]
            break
        assert list((await node.call("static_map", GetMap)).map.data) == [100]

    run(body)
    output, errors = end(process)
    assert 'Loading map from image "' in output
    assert "Read a 2 X 2 map @ 0.050 m/cell" in output
    assert f"Map_server could not open {tmp_path / 'none.yaml'}." in errors


def test_deprecated_words_give_image_and_resolution(start: Start, map_file: Path, master: str) -> None:
    process = start("map_server", "map_server", str(map_file.with_name("a.pgm")), "0.5", "_negate:=1")

    async def body(node: Node) -> None:
        async for grid in node.subscribe("map", OccupancyGrid):
            assert list(grid.data) == [100, 100, 0, 100]
            assert grid.info.resolution == 0.5
            break

    run(body)
    assert "Using deprecated map server interface." in end(process)[1]


def test_map_of_simulated_time_waits_for_the_clock(start: Start, map_file: Path, master: str) -> None:
    from rosgraph_msgs.msg import Clock

    proxy = MasterProxy(master, "/test")
    proxy.set_param("/use_sim_time", value=True)
    proxy.close()
    start("map_server", "map_server", str(map_file))

    async def body(node: Node) -> None:
        clock = node.advertise("clock", Clock, latch=True)
        message = Clock()
        message.clock.secs = 12
        await clock.publish(message)
        async for grid in node.subscribe("map", OccupancyGrid):
            assert grid.header.stamp.secs == 12
            break

    run(body)


def test_saved_map_is_served_again(start: Start, map_file: Path, tmp_path: Path) -> None:
    start("map_server", "map_server", str(map_file), "map:=floor")
    saver = start("map_server", "map_saver", "-f", str(tmp_path / "out"), "map:=floor")
    output, errors = saver.communicate(timeout=SECONDS)
    assert (saver.returncode, errors) == (0, "")
    assert "Received a 2 X 2 map @ 0.050 m/pix" in output
    saved = (tmp_path / "out.pgm").read_bytes()
    assert saved == b"P5\n# CREATOR: map_saver.cpp 0.050 m/pix\n2 2\n255\n" + bytes((0, 254, 205, 254))
    assert f"image: {tmp_path / 'out.pgm'}\n" in (tmp_path / "out.yaml").read_text()


@pytest.mark.parametrize(
    ("words", "text", "status"),
    [
        ([], "USAGE: map_server <map.yaml>", 255),
        (["none.yaml"], "Map_server could not open none.yaml. (No such file or directory)", 255),
        (["FOLDER/bad.yaml"], "The map does not contain a resolution tag or it is invalid.", 255),
        (["none.pgm", "0.1"], 'failed to open image file "none.pgm": Couldn\'t open none.pgm', 255),
        (["none.pgm", "fine"], "the resolution [fine] is not a number of metres per pixel", 255),
    ],
)
def test_map_that_cannot_be_served_is_one_line(
    start: Start, tmp_path: Path, words: list[str], text: str, status: int
) -> None:
    (tmp_path / "bad.yaml").write_bytes(b"image: a.pgm\nresolution: fine\n")
    process = start("map_server", "map_server", *(word.replace("FOLDER", str(tmp_path)) for word in words))
    assert text in refusal(process)
    assert process.returncode == status


@pytest.mark.parametrize(
    ("words", "text", "status"),
    [
        (["-h"], "map_saver [--occ <threshold_occupied>]", 0),
        (["what"], "map_saver [--occ <threshold_occupied>]", 1),
        (["--occ", "0"], "threshold_occupied must be between 1 and 100", 1),
        (["-f", "no/such/folder"], "Couldn't save map file to no/such/folder.pgm: No such file", 1),
    ],
)
def test_map_that_cannot_be_saved_is_one_line(
    start: Start, map_file: Path, words: list[str], text: str, status: int
) -> None:
    start("map_server", "map_server", str(map_file))
    process = start("map_server", "map_saver", *words)
    assert text in refusal(process)
    assert process.returncode == status
