"""Converts a map's YAML file and pixels to an occupancy grid, and a grid to PGM and YAML. Pure.

Source: http://wiki.ros.org/map_server. Row 0 is at the top of an image, but at the bottom of a grid.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import Enum
from typing import Any, NamedTuple

import numpy as np
import yaml
from numpy.typing import NDArray

from minirospy.base.errors import MinirospyError
from minirospy.base.yaml_text import load
from minirospy.ros.map_server.images import Pixels

__all__ = [
    "FREE_GREY",
    "FREE_THRESHOLD",
    "OCCUPIED_GREY",
    "OCCUPIED_THRESHOLD",
    "UNKNOWN_GREY",
    "MapError",
    "MapSettings",
    "Mode",
    "pgm_of_grid",
    "quaternion_of_yaw",
    "read_settings",
    "to_grid",
    "yaml_of_map",
    "yaw_of_quaternion",
]

OCCUPIED_THRESHOLD, FREE_THRESHOLD = 0.65, 0.196
FREE_GREY, OCCUPIED_GREY, UNKNOWN_GREY = 254, 0, 205  # gray levels in map_saver's images


class MapError(MinirospyError):
    """Raised if a map's YAML file or a grid is invalid. The message is one line with the reason."""


class Mode(Enum):
    """The rule that converts gray levels to occupancy."""

    TRINARY = "trinary"
    SCALE = "scale"
    RAW = "raw"


class MapSettings(NamedTuple):
    """A map's YAML fields: resolution in m/pixel; origin: x, y (m) and yaw (rad) of the lower left corner; thresholds."""

    image: str
    resolution: float
    origin: tuple[float, float, float]
    negate: bool
    occupied: float
    free: float
    mode: Mode


def read_settings(text: str) -> MapSettings:
    """Return the settings in a map's YAML file. If they are invalid, raise MapError with the message that ROS prints."""
    try:
        # Load all scalars as strings: yaml-cpp, unlike YAML 1.1, reads `1e-3` as a number and rejects `false`.
        found = load(text, yaml.BaseLoader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f" in line {mark.line + 1}" if mark else ""
        raise MapError(
            f"The map's file is not YAML{place}: {' '.join(str(getattr(error, 'problem', None) or error).split())}"
        ) from error
    fields: dict[str, Any] = found if isinstance(found, dict) else {}

    resolution = _number(fields, "resolution", "a")
    try:
        negate = int(fields["negate"], 0)
    except (KeyError, TypeError, ValueError):
        raise MapError("The map does not contain a negate tag or it is invalid: it is 0 or 1.") from None
    occupied = _number(fields, "occupied_thresh", "an")
    free = _number(fields, "free_thresh", "a")

    mode = fields.get("mode", "trinary")
    if isinstance(mode, str) and mode not in {each.value for each in Mode}:
        raise MapError(f'Invalid mode tag "{mode}".')
    origin = fields.get("origin")
    try:
        x, y, yaw = (_finite(each) for each in origin[:3])  # type: ignore[index]
    except (TypeError, ValueError, KeyError):
        raise MapError(
            "The map does not contain an origin tag or it is invalid: it is [x, y, yaw]."
        ) from None
    image = fields.get("image")
    if not isinstance(image, str):
        raise MapError("The map does not contain an image tag or it is invalid.")
    if not image:
        raise MapError("The image tag cannot be an empty string.")
    return MapSettings(
        image,
        resolution,
        (x, y, yaw),
        negate != 0,
        occupied,
        free,
        Mode(mode) if isinstance(mode, str) else Mode.TRINARY,
    )


def _number(fields: dict[str, str], name: str, article: str) -> float:
    try:
        return _finite(fields[name])
    except (KeyError, TypeError, ValueError):
        raise MapError(f"The map does not contain {article} {name} tag or it is invalid.") from None


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number) or "_" in text:
        raise ValueError(text)
    return number


def to_grid(pixels: Pixels, settings: MapSettings) -> NDArray[np.int8]:
    """Convert an image to occupancy values from 0 to 100 (-1: unknown), row by row from the bottom.

    In mode raw, return the grey levels.
    """
    values, has_alpha = pixels
    channels = values.shape[2]
    # In trinary mode, the alpha channel counts as another color, as in ROS.
    averaged = channels - 1 if has_alpha and settings.mode is not Mode.TRINARY else channels
    grey = values[..., :averaged].sum(axis=2, dtype=np.float64) / averaged
    if settings.negate:
        grey = 255 - grey
    if settings.mode is Mode.RAW:
        return np.ascontiguousarray(grey[::-1]).astype(np.uint8).ravel().view(np.int8)

    darkness = (255 - grey) / 255.0
    if settings.mode is Mode.SCALE:
        span = settings.occupied - settings.free
        ratio = (darkness - settings.free) / span if span else np.zeros_like(darkness)
        between = 1 + 98 * np.clip(ratio, 0, 1)
        if channels > 1:
            between[values[..., -1] < 1] = -1
    else:
        between = np.full_like(darkness, -1)
    free = darkness < settings.free
    grid = np.where(darkness > settings.occupied, 100, np.where(free, 0, between))
    return grid[::-1].astype(np.int8).ravel()


def quaternion_of_yaw(yaw: float) -> tuple[float, float]:
    """Return z and w of the quaternion for a rotation about z, in 32-bit floats as in ROS."""
    half = np.float32(yaw) * np.float32(0.5)
    return float(np.sin(half)), float(np.cos(half))


def yaw_of_quaternion(x: float, y: float, z: float, w: float) -> float:
    """Return a quaternion's yaw in radians. Like tf2's getEulerYPR, return 0 if the pitch is +/-90 degrees.

    Also return 0 for the unset quaternion 0, 0, 0, 0. The real program writes `-nan`, which no map_server can read.
    """
    square = x * x + y * y + z * z + w * w
    if not square:
        return 0.0
    scale = 2.0 / square
    cell = scale * (x * z - w * y)
    if abs(cell) >= 1:
        return 0.0
    return math.atan2(scale * (x * y + w * z), 1.0 - scale * (y * y + z * z))


def pgm_of_grid(
    data: Sequence[int], width: int, height: int, resolution: float, occupied: int, free: int
) -> bytes:
    """Convert a grid to a PGM image. Cells up to ``free`` count as free, cells from ``occupied`` as occupied.

    Raise MapError if the grid is invalid.
    """
    cells = np.asarray(data, np.int8)
    if len(cells) != width * height:
        raise MapError(f"the map has {len(cells)} cells, where {width} x {height} are {width * height}")
    rows = cells.reshape(height, width)[::-1]
    image = np.full(rows.shape, UNKNOWN_GREY, np.uint8)
    image[rows >= occupied] = OCCUPIED_GREY
    image[(rows >= 0) & (rows <= free)] = FREE_GREY
    header = f"P5\n# CREATOR: map_saver.cpp {resolution:.3f} m/pix\n{width} {height}\n255\n"
    return header.encode("ascii") + image.tobytes()


def yaml_of_map(image: str, resolution: float, origin: tuple[float, float, float]) -> str:
    """Return the text of the YAML file for a map that map_saver saves."""
    x, y, yaw = origin
    return (
        f"image: {image}\nresolution: {resolution:f}\norigin: [{x:f}, {y:f}, {yaw:f}]\nnegate: 0\n"
        f"occupied_thresh: {OCCUPIED_THRESHOLD}\nfree_thresh: {FREE_THRESHOLD}\n\n"
    )
