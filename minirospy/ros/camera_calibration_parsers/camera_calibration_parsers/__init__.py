"""camera_calibration_parsers: reads and writes camera calibrations in .yaml and .ini files.

Source: http://wiki.ros.org/camera_calibration_parsers.
"""

from __future__ import annotations

from pathlib import Path

from sensor_msgs.msg import CameraInfo

from minirospy import client as rospy
from minirospy.ros.camera_calibration_parsers.camera_calibration_parsers.texts import (
    CalibrationError,
    ini_of,
    parse_ini,
    parse_yaml,
    yaml_of,
)

__all__ = ["CameraInfo", "readCalibration", "writeCalibration"]

_PARSERS = {".yaml": parse_yaml, ".yml": parse_yaml, ".ini": parse_ini}
_WRITERS = {".yaml": yaml_of, ".yml": yaml_of, ".ini": ini_of}


def readCalibration(file_name: str) -> tuple[str, CameraInfo] | None:
    """Return the camera's name and parameters from a .yaml, .yml or .ini file.

    If the file is missing or invalid, log the reason and return None. Also return None for any other extension.
    """
    parse = _PARSERS.get(Path(file_name).suffix)
    if parse is None:
        return None
    try:
        text = Path(file_name).read_text(encoding="utf-8")
    except (OSError, ValueError):
        rospy.loginfo("Unable to open camera calibration file [%s]", file_name)
        return None
    try:
        return parse(text)
    except CalibrationError as error:
        rospy.logerr("Failed to parse camera calibration from file [%s]: %s", file_name, error)
        return None


def writeCalibration(file_name: str, camera_name: str, cinfo: CameraInfo) -> bool:
    """Write a calibration in ROS's .yaml, .yml or .ini format, creating missing folders. ROS has this function only in C++.

    If the file cannot be written, or the extension is unknown, log the reason and return False.
    """
    write = _WRITERS.get(Path(file_name).suffix)
    if write is None:
        rospy.logerr("A camera calibration is a .yaml, .yml or .ini file, not [%s]", file_name)
        return False
    try:
        text = write(camera_name, cinfo)
        Path(file_name).parent.mkdir(parents=True, exist_ok=True)
        Path(file_name).write_text(text, encoding="utf-8")
    except (CalibrationError, OSError) as error:
        rospy.logerr("Failed to save camera calibration to file [%s]: %s", file_name, error)
        return False
    return True
