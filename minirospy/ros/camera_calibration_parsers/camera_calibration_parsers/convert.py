"""convert: convert a calibration file to the other format, like ROS's program of that name."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from minirospy import client as rospy
from minirospy.ros.camera_calibration_parsers.camera_calibration_parsers import (
    readCalibration,
    writeCalibration,
)

__all__ = ["main"]

_USAGE = "Usage: convert input.yml output.ini\n       convert input.ini output.yml"


def main(words: Sequence[str]) -> int:
    """Run the program; return its exit status."""
    words = rospy.myargv(["", *words])[1:]
    if len(words) != 2:
        print(_USAGE)
        return 0 if not words else 1
    source, target = words
    found = readCalibration(source)
    if found is None:
        print(f"Failed to load camera model from file {source}", file=sys.stderr)
        return 255
    if not writeCalibration(target, *found):
        print(f"Failed to save camera model to file {target}", file=sys.stderr)
        return 255
    print(f"Saved {target}")
    return 0
