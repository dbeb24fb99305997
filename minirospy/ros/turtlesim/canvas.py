"""The turtles' canvas: draws pen strokes, and returns pixel colours. Pure."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["PIXELS", "Canvas", "Color"]

PIXELS = 500  # width and height of the canvas, in pixels


class Color(NamedTuple):
    """Red, green and blue, from 0 to 255."""

    r: int
    g: int
    b: int


class Canvas:
    """The turtles' canvas. The point (x, y) is the centre of a pixel; y increases downwards."""

    def __init__(self, background: Color) -> None:
        self.pixels: NDArray[np.uint8] = np.empty((PIXELS, PIXELS, 3), np.uint8)
        """The colours, indexed by row and column."""
        self.marks: NDArray[np.bool_] = np.empty((PIXELS, PIXELS), np.bool_)
        """True for each pixel that a pen has drawn on, indexed by row and column."""
        self.background = background
        self.version = 0  # incremented on each change
        self.fill(background)

    def fill(self, background: Color) -> None:
        """Fill the canvas, removing all lines."""
        self.background = background
        self.pixels[:] = background
        self.marks[:] = False
        self.version += 1

    def stroke(
        self, start: tuple[float, float], end: tuple[float, float], color: Color, width: float
    ) -> None:
        """Draw a straight line, clipped to the canvas. Its square ends extend ``width`` / 2 beyond the end points."""
        (x0, y0), (x1, y1) = start, end
        length = math.hypot(x1 - x0, y1 - y0)
        along_x, along_y = ((x1 - x0) / length, (y1 - y0) / length) if length else (1.0, 0.0)
        half = width / 2
        # A corner of the line is at most sqrt(2) * half away from its end point.
        rows = _range(min(y0, y1) - 2 * half, max(y0, y1) + 2 * half)
        columns = _range(min(x0, x1) - 2 * half, max(x0, x1) + 2 * half)
        if not len(rows) or not len(columns):
            return

        y = np.arange(rows.start, rows.stop)[:, None] - y0
        x = np.arange(columns.start, columns.stop)[None, :] - x0
        along = x * along_x + y * along_y
        across = np.abs(y * along_x - x * along_y)
        covered = (along >= -half) & (along <= length + half) & (across <= half)
        area = slice(rows.start, rows.stop), slice(columns.start, columns.stop)
        self.pixels[area][covered] = color
        self.marks[area][covered] = True
        self.version += 1

    def color_at(self, x: float, y: float) -> Color:
        """Return the colour of the pixel nearest to a point."""
        column, row = (min(max(math.floor(value + 0.5), 0), PIXELS - 1) for value in (x, y))
        r, g, b = (int(value) for value in self.pixels[row, column])
        return Color(r, g, b)


def _range(first: float, last: float) -> range:
    """Return the pixel coordinates from ``first`` to ``last`` that are on the canvas."""
    return range(
        max(math.ceil(max(first, -1.0)), 0), min(math.floor(min(last, PIXELS + 1.0)), PIXELS - 1) + 1
    )
