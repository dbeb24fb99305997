"""Write recorded.json, the results of the real map_server and map_saver: `python make_recorded.py map_server map_saver`.

Both programs are from ROS's navigation (1.17.3), which Debian does not have; they are built from source, with Debian's
libraries. A master must run at ROS_MASTER_URI.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import rospy
from cases import GRIDS, Grid, cases, write_images, write_map
from nav_msgs.msg import OccupancyGrid

OUT = Path(__file__).with_name("recorded.json")
SAVED = Path(__file__).with_name("saved.json")


def published(program: str, folder: Path, case: object) -> object:
    """Return the map that the program publishes, or the last lines of its output."""
    process = subprocess.Popen(
        [program, str(write_map(folder, case)), "__name:=map_server"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        for _ in range(100):
            try:
                grid = rospy.wait_for_message("map", OccupancyGrid, timeout=0.2)
                break
            except rospy.ROSException:
                if process.poll() is not None:
                    text = re.sub(r"\033\[\d*m|\[\d+\.\d+\]: |\[ *([A-Z]+)\] ", r"", process.stdout.read())
                    return text.replace(str(folder), "FOLDER").splitlines()
        info = grid.info
        pose = info.origin
        place = [pose.position.x, pose.position.y, pose.orientation.z, pose.orientation.w]
        return {
            "size": [info.width, info.height],
            "resolution": info.resolution,
            "origin": place,
            "data": list(grid.data),
        }
    finally:
        process.terminate()
        process.wait()


def saved(program: str, folder: Path, grid: Grid) -> object:
    """Return the two files that the program saves for a grid."""
    message = OccupancyGrid(data=list(grid.data))
    info = message.info
    info.width, info.height, info.resolution = grid.width, grid.height, grid.resolution
    info.origin.position.x, info.origin.position.y = grid.position
    turn = info.origin.orientation
    turn.x, turn.y, turn.z, turn.w = grid.orientation
    publisher = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
    publisher.publish(message)
    try:
        subprocess.run([program, *grid.options, "-f", "saved"], cwd=folder, check=True, timeout=30)
    finally:
        publisher.unregister()
    image = (folder / "saved.pgm").read_bytes()
    return {"pgm": image.decode("latin-1"), "yaml": (folder / "saved.yaml").read_text()}


def main(server: str, saver: str) -> None:
    """Write recorded.json and saved.json."""
    rospy.init_node("recorder", disable_signals=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_images(folder)
        found = {case.name: published(server, folder, case) for case in cases()}
        images = {grid.name: saved(saver, folder, grid) for grid in GRIDS}
    for path, records in ((OUT, found), (SAVED, images)):
        lines = [f"{json.dumps(name)}: {json.dumps(each)}" for name, each in records.items()]
        path.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:3])
