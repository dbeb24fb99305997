"""map_saver: saves a map from the topic `map` as NAME.pgm and NAME.yaml, byte-identical to those of ROS.

Usage: `map_saver [--occ THRESHOLD] [--free THRESHOLD] [-f NAME] [map:=TOPIC]`.
Source: http://wiki.ros.org/map_server#map_saver.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from nav_msgs.msg import OccupancyGrid

from minirospy import client as rospy
from minirospy.base.clock import SignalSafeEvent
from minirospy.base.errors import UsageError
from minirospy.ros.map_server.grid import MapError, pgm_of_grid, yaml_of_map, yaw_of_quaternion

__all__ = ["SaverOptions", "main", "parse_options", "save_map"]

_USAGE = """Usage: 
  map_saver -h
  map_saver [--occ <threshold_occupied>] [--free <threshold_free>] [-f <mapname>] [ROS remapping args]"""  # noqa: W291


class SaverOptions(NamedTuple):
    """The file name without suffix, the minimum occupancy of an occupied cell and the maximum occupancy of a free cell."""

    name: str = "map"
    occupied: int = 65
    free: int = 25


def parse_options(words: Sequence[str]) -> SaverOptions | None:
    """Return the options, or None for ``-h``. Raise UsageError (with ROS's message, if any) if they are invalid."""
    options = SaverOptions()
    rest = iter(words)
    for word in rest:
        if word == "-h":
            return None
        value = next(rest, None) if word in ("-f", "--occ", "--free") else None
        if value is None:
            raise UsageError("")
        if word == "-f":
            options = options._replace(name=value)
        elif word == "--occ":
            options = options._replace(occupied=_threshold(value, "threshold_occupied", 1))
        else:
            options = options._replace(free=_threshold(value, "threshold_free", 0))
    if options.occupied <= options.free:
        raise UsageError("threshold_free must be smaller than threshold_occupied")
    return options


def _threshold(text: str, name: str, least: int) -> int:
    # Like C's atoi, ignore characters after the digits; without digits, the value is 0.
    match = re.match(r"\s*[+-]?\d+", text)
    value = int(match[0]) if match else 0
    if not least <= value <= 100:
        raise UsageError(f"{name} must be between {least} and 100")
    return value


def main() -> int:
    """Save one map; return the exit status, which is 1 if saving fails."""
    try:
        options = parse_options(rospy.myargv()[1:])
    except UsageError as error:
        if not str(error):
            print(_USAGE)
            return 1
        # Print to stderr instead of logging: no node is running yet, and reporting this error must not require a master.
        print(f"map_saver: ERROR: {error}", file=sys.stderr)
        return 1
    if options is None:
        print(_USAGE)
        return 0
    try:
        rospy.init_node("map_saver")
        return _save_one(options)
    except rospy.ROSInterruptException:
        return 0


def _save_one(options: SaverOptions) -> int:
    received: list[OccupancyGrid] = []
    has_come = SignalSafeEvent()

    def receive(grid: OccupancyGrid) -> None:
        received.append(grid)
        has_come.set()

    rospy.on_shutdown(has_come.set)
    rospy.loginfo("Waiting for the map")
    subscriber = rospy.Subscriber("map", OccupancyGrid, receive, queue_size=1)
    has_come.wait()
    subscriber.unregister()
    if not received:
        return 0
    try:
        save_map(received[0], options)
    except MapError as error:
        rospy.logerr("%s", error)
        return 1
    rospy.loginfo("Done\n")
    return 0


def save_map(grid: OccupancyGrid, options: SaverOptions) -> None:
    """Write a map's two files. Raise MapError if the map is invalid or a file cannot be written."""
    info = grid.info
    rospy.loginfo("Received a %d X %d map @ %.3f m/pix", info.width, info.height, info.resolution)
    image = pgm_of_grid(grid.data, info.width, info.height, info.resolution, options.occupied, options.free)
    position, turn = info.origin.position, info.origin.orientation
    yaw = yaw_of_quaternion(turn.x, turn.y, turn.z, turn.w)
    image_name = f"{options.name}.pgm"
    text = yaml_of_map(image_name, info.resolution, (position.x, position.y, yaw))
    for name, data in ((image_name, image), (f"{options.name}.yaml", text.encode())):
        rospy.loginfo("Writing map occupancy data to %s", name)
        try:
            Path(name).write_bytes(data)
        except OSError as error:
            raise MapError(f"Couldn't save map file to {name}: {error.strerror}") from error
