"""minirospy's maps with nodes of Debian's ROS: real rospy receives them, and map_saver saves a map published by real rospy."""

from __future__ import annotations

import sys
from pathlib import Path

from tests.interop.conftest import PATIENCE, REAL_PYTHON, start, stop

PROGRAMS = Path(__file__).parents[2] / "minirospy" / "ros" / "map_server" / "nodes"
READER = """
import sys
import rospy
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap, LoadMap

rospy.init_node("reader")
grid = rospy.wait_for_message("/map", OccupancyGrid, timeout=150)
print(list(grid.data), grid.info.width, grid.info.height, round(grid.info.resolution, 3), grid.header.frame_id)
print(rospy.wait_for_message("/map_metadata", MapMetaData, timeout=150) == grid.info)
rospy.wait_for_service("static_map", 150)
print(list(rospy.ServiceProxy("static_map", GetMap)().map.data))
change = rospy.ServiceProxy("change_map", LoadMap)
print(change("/no/such.yaml").result, change(sys.argv[1]).result)
"""
WRITER = """
import rospy
from nav_msgs.msg import OccupancyGrid

rospy.init_node("writer")
grid = OccupancyGrid(data=[0, 100, -1, 50])
grid.info.width, grid.info.height, grid.info.resolution = 4, 1, 0.25
grid.info.origin.orientation.w = 1
publisher = rospy.Publisher("/map", OccupancyGrid, queue_size=1, latch=True)
publisher.publish(grid)
rospy.spin()
"""


def test_real_nodes_get_the_map_of_our_server(real_master: str, tmp_path: Path) -> None:
    (tmp_path / "a.pgm").write_bytes(b"P5 2 2 255\n" + bytes((0, 255, 200, 254)))
    fields = "resolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    path = tmp_path / "a.yaml"
    path.write_text(f"image: a.pgm\n{fields}")
    server = start([sys.executable, str(PROGRAMS / "map_server"), str(path)], real_master, "ours")
    reader = start([REAL_PYTHON, "-c", READER, str(path)], real_master, "rospy")
    try:
        output, errors = reader.communicate(timeout=PATIENCE)
    finally:
        stop(reader)
        stop(server)
    assert output.splitlines() == [
        "[-1, 0, 100, 0] 2 2 0.1 map",
        "True",
        "[-1, 0, 100, 0]",
        "255 0",
    ], errors


def test_our_saver_gets_the_map_of_a_real_node(real_master: str, tmp_path: Path) -> None:
    writer = start([REAL_PYTHON, "-c", WRITER], real_master, "rospy")
    saver = start(
        [sys.executable, str(PROGRAMS / "map_saver"), "-f", str(tmp_path / "out")], real_master, "ours"
    )
    try:
        _, errors = saver.communicate(timeout=PATIENCE)
    finally:
        stop(saver)
        stop(writer)
    assert (saver.returncode, errors) == (0, "")
    image = (tmp_path / "out.pgm").read_bytes()
    assert image == b"P5\n# CREATOR: map_saver.cpp 0.250 m/pix\n4 1\n255\n" + bytes((254, 0, 205, 205))
