"""crop_map: remove the unknown cells around a map. `crop_map MAP.yaml [CROPPED.yaml]`; writes to the current folder.

Source: http://wiki.ros.org/map_server. The origin is moved to the new lower left corner.
"""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray

from minirospy.base.errors import MinirospyError
from minirospy.base.yaml_text import load, one_line
from minirospy.ros.map_server.grid import UNKNOWN_GREY, MapError, read_settings
from minirospy.ros.map_server.images import read_image

__all__ = ["crop", "main"]


def crop(
    image: NDArray[np.uint8], resolution: float, origin: tuple[float, float, float]
) -> tuple[NDArray[np.uint8], tuple[float, float, float]]:
    """Crop an image (rows from the top) to the smallest part with all known cells; return that part and its origin.

    Raise MapError if there are no known cells.
    """
    rows, columns = np.nonzero(image != UNKNOWN_GREY)
    if not len(rows):
        raise MapError("every cell of the map is unknown: nothing is left of it")
    top, bottom, left, right = rows.min(), rows.max(), columns.min(), columns.max()
    x, y, yaw = origin
    dx, dy = left * resolution, (image.shape[0] - bottom - 1) * resolution
    moved = (x + dx * math.cos(yaw) - dy * math.sin(yaw), y + dx * math.sin(yaw) + dy * math.cos(yaw), yaw)
    return image[top : bottom + 1, left : right + 1], (float(moved[0]), float(moved[1]), yaw)


def main() -> int:
    """Run the program; return its exit status."""
    words = sys.argv[1:]
    if len(words) not in (1, 2):
        print(f"Usage: {sys.argv[0]} map.yaml [cropped.yaml]", file=sys.stderr)
        return 1
    name = words[1].removesuffix(".yaml") if len(words) == 2 else "cropped"
    try:
        _crop_file(words[0], name)
    except (MinirospyError, OSError, ValueError) as error:
        print(f"crop_map: ERROR: {words[0]}: {error}", file=sys.stderr)
        return 1
    return 0


def _crop_file(path: str, name: str) -> None:
    text = Path(path).read_text(encoding="utf-8")
    settings = read_settings(text)
    pixels = read_image(Path(os.path.join(os.path.dirname(path), settings.image)).read_bytes()).values
    if pixels.shape[2] != 1:
        raise MapError(f"{settings.image} has colors: crop_map reads images of greys")
    image, origin = crop(pixels[..., 0], settings.resolution, settings.origin)
    height, width = image.shape
    Path(f"{name}.pgm").write_bytes(b"P5\n%d %d\n255\n" % (width, height) + image.tobytes())
    try:
        fields = {**load(text, yaml.SafeLoader), "image": f"{name}.pgm", "origin": list(origin)}
    except yaml.YAMLError as error:
        raise MapError(f"The map's file is not YAML: {one_line(error)}") from error
    Path(f"{name}.yaml").write_text(yaml.dump(fields), encoding="utf-8")
