"""Draws the turtles' world live in a terminal, with characters."""

from __future__ import annotations

import math
import shutil
import threading
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np

from minirospy.base.clock import SignalSafeEvent
from minirospy.base.escape import escaped, own_output
from minirospy.ros.turtlesim.canvas import PIXELS, Canvas, Color
from minirospy.ros.turtlesim.world import SIZE, Pose, World

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderResult

__all__ = ["Picture", "Screen"]

_PERIOD_SECONDS = 0.1
_LINES_BESIDE = 4  # number of terminal lines reserved for the log and the picture's border

_ROWS = range(8, 41)
"""Allowed picture heights in terminal rows: fewer show too little, more take too much CPU time."""

_ARROWS, _ASCII_ARROWS = "→↗↑↖←↙↓↘", ">/^\\</v\\"
_STYLES = ("bright_green", "bright_yellow", "bright_red", "bright_cyan", "bright_magenta", "bright_white")

_DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
"""The bits of a Braille character's dots: four rows of two dots each."""


class Picture:
    """A rich renderable that draws a world: pen lines as dots, turtles as arrows, and each turtle's pose below."""

    def __init__(self, world: World) -> None:
        self._canvas = world.canvas
        self._poses = {name: world.pose(name) for name in world.names}

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        from rich import box
        from rich.console import Group
        from rich.panel import Panel
        from rich.text import Text

        is_ascii = options.ascii_only
        height = options.height or console.height
        rows = min((options.max_width - 4) // 2, height - _LINES_BESIDE - len(self._poses))
        rows = min(max(rows, _ROWS[0]), _ROWS[-1])
        characters, colors = cells(self._canvas, rows, is_ascii=is_ascii)
        paper = _rgb(self._canvas.background)
        turtles = self._turtles(rows, is_ascii=is_ascii)
        lines = []
        for row in range(rows):
            line = Text()
            for column in range(2 * rows):
                if turtle := turtles.get((row, column)):
                    line.append(turtle[0], f"bold {turtle[1]} on {paper}")
                else:
                    line.append(characters[row][column], f"{_rgb(colors[row][column])} on {paper}")
            lines.append(line)
        below = [
            Text(f"{escaped(name)}: x={pose.x:.2f} y={pose.y:.2f} theta={pose.theta:.2f}", _style(index))
            for index, (name, pose) in enumerate(self._poses.items())
        ]
        yield Panel(
            Group(*lines, *below),
            title="TurtleSim",
            box=box.ASCII if is_ascii else box.ROUNDED,
            expand=False,
        )

    def _turtles(self, rows: int, *, is_ascii: bool) -> dict[tuple[int, int], tuple[str, str]]:
        """Return the arrow and style of each turtle, keyed by (row, column). If a cell has several turtles, show the last one."""
        arrows = _ASCII_ARROWS if is_ascii else _ARROWS
        found = {}
        for index, pose in enumerate(self._poses.values()):
            row = _cell((SIZE - pose.y) / SIZE, rows)
            column = _cell(pose.x / SIZE, 2 * rows)
            found[row, column] = arrows[_eighth(pose)], _style(index)
        return found


def cells(canvas: Canvas, rows: int, *, is_ascii: bool = False) -> tuple[list[str], list[list[Color]]]:
    """Return the canvas as ``rows`` lines of 2 * ``rows`` characters, and the mean colour of the pen lines in each character."""
    dots = _blocks(canvas.marks, 4 * rows, 4 * rows) > 0
    # A Braille character has four rows of two dots each.
    dots = dots.reshape(rows, 4, 2 * rows, 2)
    codes = (dots * _DOTS[None, :, None, :]).sum(axis=(1, 3))
    marked = "*" if is_ascii else ""
    characters = [
        "".join((marked or chr(0x2800 + code)) if code else " " for code in line) for line in codes.tolist()
    ]
    counts = np.maximum(_blocks(canvas.marks, rows, 2 * rows), 1)
    parts = [
        _blocks(np.where(canvas.marks, canvas.pixels[:, :, part], 0), rows, 2 * rows) // counts
        for part in range(3)
    ]
    means = np.stack(parts, axis=-1).tolist()
    return characters, [[Color(*mean) for mean in line] for line in means]


def _blocks(
    values: np.ndarray[tuple[int, ...], np.dtype[np.generic]], rows: int, columns: int
) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    """Divide the canvas into ``rows`` times ``columns`` blocks; return the sum of ``values`` in each block."""
    starts = [-(-np.arange(count) * PIXELS // count) for count in (rows, columns)]
    sums = np.add.reduceat(values.astype(np.int64), starts[0], axis=0)
    return np.add.reduceat(sums, starts[1], axis=1)


def _cell(part: float, count: int) -> int:
    return min(max(int(part * count), 0), count - 1)


def _eighth(pose: Pose) -> int:
    return round(pose.theta / (math.pi / 4)) % 8


def _style(index: int) -> str:
    return _STYLES[index % len(_STYLES)]


def _rgb(color: Color) -> str:
    return f"rgb({color.r},{color.g},{color.b})"


class Screen:
    """Draws a world below the log lines, at most ten times per second and only after changes. A context manager.

    A separate thread draws, so that a stopped (Ctrl-S) or slow terminal does not stop the turtles.
    """

    def __init__(self, world: World, lock: threading.Lock) -> None:
        self._world, self._lock = world, lock
        self._ended = SignalSafeEvent()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Screen:
        from rich.console import Console
        from rich.live import Live

        console = Console(file=own_output())
        if console.is_dumb_terminal:
            # A dumb terminal cannot move the cursor up, so draw nothing.
            self._ended.set()
        self._live = Live(console=console, auto_refresh=False)
        if not self._ended.is_set():
            self._live.start()
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._thread.join(timeout=1.0)
        self._live.stop()

    def _run(self) -> None:
        shown: object = None
        while not self._ended.is_set():
            with self._lock:
                picture = Picture(self._world)
                state = self._state()
            if state != shown:
                shown = state
                self._live.update(picture, refresh=True)
            self._ended.wait(_PERIOD_SECONDS)

    def _state(self) -> object:
        """Return the values that the picture depends on."""
        world = self._world
        poses = [(name, world.pose(name)) for name in world.names]
        return world.canvas.version, poses, shutil.get_terminal_size()
