"""map_server: publishes a map's files on /map and /map_metadata (latched), and offers services static_map and change_map.

Usage: `map_server MAP.yaml`, or, deprecated, `map_server IMAGE RESOLUTION` with ~negate, ~occupied_thresh and ~free_thresh.
Parameter: ~frame_id (map). Source: http://wiki.ros.org/map_server.
"""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from pathlib import Path

from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import (
    GetMap,
    GetMapRequest,
    GetMapResponse,
    LoadMap,
    LoadMapRequest,
    LoadMapResponse,
)

from minirospy import client as rospy
from minirospy.ros.map_server.grid import (
    FREE_THRESHOLD,
    OCCUPIED_THRESHOLD,
    MapError,
    MapSettings,
    Mode,
    quaternion_of_yaw,
    read_settings,
    to_grid,
)
from minirospy.ros.map_server.images import ImageError, read_image

__all__ = ["MapServer", "load_map", "main"]

_USAGE = """
USAGE: map_server <map.yaml>
  map.yaml: map description file
DEPRECATED USAGE: map_server <map> <resolution>
  map: image file to load
  resolution: map resolution [meters/pixel]"""
_FAILED = 255
_CLOCK_SECONDS = 0.05


def main() -> int:
    """Run the node until it shuts down; return the exit status, which is 255 if there is no map."""
    words = rospy.myargv()[1:]
    try:
        rospy.init_node("map_server", anonymous=True)
        if len(words) not in (1, 2):
            rospy.logerr("%s", _USAGE)
            return _FAILED
        server = MapServer(_settings(words))
        rospy.spin()
        del server
    except MapError as error:
        rospy.logerr("%s", error)
        return _FAILED
    except rospy.ROSInterruptException:
        pass
    return 0


def _settings(words: Sequence[str]) -> MapSettings:
    if len(words) == 1:
        return settings_of_file(words[0])
    rospy.logwarn("Using deprecated map server interface. Please switch to new interface.")
    try:
        resolution = float(words[1])
    except ValueError:
        raise MapError(f"the resolution [{words[1]}] is not a number of metres per pixel") from None
    return MapSettings(
        words[0],
        resolution,
        (0.0, 0.0, 0.0),
        bool(rospy.get_param("~negate", 0)),
        _number("~occupied_thresh", OCCUPIED_THRESHOLD),
        _number("~free_thresh", FREE_THRESHOLD),
        Mode.TRINARY,
    )


def _number(name: str, default: float) -> float:
    value = rospy.get_param(name, default)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else default


def settings_of_file(name: str) -> MapSettings:
    """Return the settings in a YAML file, with the image's path relative to the current folder.

    Raise MapError if the file cannot be read or is invalid.
    """
    try:
        text = Path(name).read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise MapError(f"Map_server could not open {name}. ({why})") from error
    settings = read_settings(text)
    return settings._replace(image=os.path.join(os.path.dirname(name), settings.image))


def load_map(settings: MapSettings) -> OccupancyGrid:
    """Return a map whose frame and times are not set. Raise MapError if the map cannot be loaded."""
    rospy.loginfo('Loading map from image "%s"', settings.image)
    try:
        pixels = read_image(Path(settings.image).read_bytes())
    except (ImageError, OSError, ValueError) as error:
        why = f"Couldn't open {settings.image}" if isinstance(error, OSError) else error
        if isinstance(error, OSError) and error.strerror:
            why = f"{why}: {error.strerror}"
        raise MapError(f'failed to open image file "{settings.image}": {why}') from error

    grid = OccupancyGrid()
    info = grid.info
    info.height, info.width = pixels.values.shape[:2]
    info.resolution = settings.resolution
    x, y, yaw = settings.origin
    info.origin.position.x, info.origin.position.y = x, y
    info.origin.orientation.z, info.origin.orientation.w = quaternion_of_yaw(yaw)
    # Serialize the message directly from the array, without creating a list of numbers.
    grid.data = to_grid(pixels, settings)  # type: ignore[assignment]
    return grid


class MapServer:
    """Serves a map on two latched topics and through two services. ``__init__`` raises MapError if the map cannot be loaded."""

    def __init__(self, settings: MapSettings) -> None:
        self._frame_id = str(rospy.get_param("~frame_id", "map"))
        self._metadata = rospy.Publisher("map_metadata", MapMetaData, queue_size=1, latch=True)
        self._map = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
        self._grid = OccupancyGrid()
        self._show(settings)
        self._services = [
            rospy.Service("static_map", GetMap, self._get),
            rospy.Service("change_map", LoadMap, self._change),
        ]

    def _show(self, settings: MapSettings) -> None:
        grid = load_map(settings)
        # In simulated time, wait for the first clock message; otherwise, the map's timestamp would be zero.
        while not rospy.Time.now() and not rospy.is_shutdown():
            time.sleep(_CLOCK_SECONDS)
        grid.info.map_load_time = rospy.Time.now()
        grid.header.frame_id = self._frame_id
        grid.header.stamp = rospy.Time.now()
        info = grid.info
        rospy.loginfo("Read a %d X %d map @ %.3f m/cell", info.width, info.height, info.resolution)
        self._grid = grid
        self._metadata.publish(info)
        self._map.publish(grid)

    def _get(self, _request: GetMapRequest) -> GetMapResponse:
        rospy.loginfo("Sending map")
        return GetMapResponse(self._grid)

    def _change(self, request: LoadMapRequest) -> LoadMapResponse:
        try:
            self._show(settings_of_file(request.map_url))
        except MapError as error:
            rospy.logerr("%s", error)
            return LoadMapResponse(result=LoadMapResponse.RESULT_UNDEFINED_FAILURE)
        rospy.loginfo("Changed map to %s", request.map_url)
        return LoadMapResponse(self._grid, LoadMapResponse.RESULT_SUCCESS)
