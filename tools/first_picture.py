"""`PYTHONPATH=. python tools/first_picture.py [FILE]`: record the README's moving picture, docs/pictures/first.webp.

Left a terminal that runs `roslaunch rpi_feros_bringup sick_zone.launch`, right the dashboard in chromium. A person walks
towards the scanner, and the LEDs turn from green to red. Everything is real: the programs, their output, the page. Needs
chromium, Pillow, and the fonts of the package fonts-dejavu-core.
"""

from __future__ import annotations

import argparse
import base64
import contextlib
import io
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

from minirospy.board.board import Board
from tests.conftest import free_port
from tests.interop.browser import PATIENCE, Page

ROOT = Path(__file__).parents[1]
LAUNCH = "roslaunch rpi_feros_bringup sick_zone.launch"
SECONDS = 8.0
RATE = 10  # frames per second
MAX_BYTES = 1_500_000  # the README is loaded over mobile networks, too

PANE = (600, 660)  # pixels of the terminal
PAGE = (920, 660)  # pixels of the page
SCALE = 0.68  # the picture is shrunk by this factor
LINE = 19  # pixels between two lines of the terminal
COLUMNS = 68  # characters in a line of the terminal
FONTS = Path("/usr/share/fonts/truetype/dejavu")
BACKGROUND, TEXT, PROMPT = (24, 26, 31), (222, 224, 228), (98, 209, 150)

WALK = ((1.0, None), (2.0, 0.62), (3.2, 0.5), (4.2, 0.36), (5.6, 0.16), (8.0, 0.16))
"""The person's distance in metres at these seconds, between which the person walks."""

LIT = "return document.querySelector('.lit[aria-label$=\"{} on\"]')?.getClientRects().length"
"""JavaScript that returns whether the page shows a lit LED of a color."""

_ESCAPE = re.compile(r"\x1b\][^\x07]*\x07|\x1b\[[0-9;?]*[a-zA-Z]|\r")


class Terminal:
    """The lines that a program has printed on its own terminal."""

    def __init__(self, line: str, environment: Mapping[str, str]) -> None:
        import pty

        self._line = line
        self._text = ""
        parent, child = pty.openpty()
        self.process = subprocess.Popen(
            line.split(), stdin=child, stdout=child, stderr=child, env=environment, start_new_session=True
        )
        os.close(child)
        self._parent = parent
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        with contextlib.suppress(OSError):  # Linux reports the end of a terminal as EIO
            while data := os.read(self._parent, 65536):
                self._text += data.decode(errors="replace")

    def has(self, text: str) -> bool:
        """Return whether the program has printed this text."""
        return text in self._text

    def find(self, pattern: str) -> str:
        """Return what a pattern matches in the output."""
        found = re.search(pattern, self._text)
        assert found, self._text
        return found[0]

    def lines(self) -> list[str]:
        printed = [line[:COLUMNS] for line in _ESCAPE.sub("", self._text).splitlines()]
        return [f"$ {self._line}", *printed]

    def close(self) -> None:
        self.process.terminate()
        self.process.wait(PATIENCE)
        os.close(self._parent)


def drawn(lines: list[str], size: tuple[int, int]) -> Image.Image:
    """Return the end of a terminal's text as a picture."""
    picture = Image.new("RGB", size, BACKGROUND)
    draw = ImageDraw.Draw(picture)
    font = ImageFont.truetype(FONTS / "DejaVuSansMono.ttf", 14)
    bold = ImageFont.truetype(FONTS / "DejaVuSansMono-Bold.ttf", 14)
    room = (size[1] - 20) // LINE
    # The command stays in the first line.
    shown = lines if len(lines) <= room else [lines[0], *lines[len(lines) - room + 1 :]]
    for row, line in enumerate(shown):
        is_typed = line.startswith("$ ")
        is_log = line.startswith("[INFO]")
        colour = PROMPT if is_typed or is_log else TEXT
        draw.text((12, 10 + row * LINE), line, colour, bold if is_typed or is_log else font)
    return picture


def distance_at(seconds: float) -> float | None:
    """Return the person's distance in metres at a time of the picture; None before the person comes."""
    for (start, near), (end, far) in pairwise(WALK):
        if start <= seconds <= end and near is not None and far is not None:
            return near + (far - near) * (seconds - start) / (end - start)
    return None


@contextlib.contextmanager
def running(home: Path) -> Iterator[tuple[Terminal, Page]]:
    """Yield the terminal with the launch file, and the page that shows the board."""
    os.environ["MINIROSPY_RUNTIME_DIR"] = str(home / "board")
    os.environ["MINIROSPY_BOARD"] = "workshop"
    environment = {
        **os.environ,
        "ROS_MASTER_URI": f"http://localhost:{free_port()}",
        "ROS_HOSTNAME": "localhost",
        "ROS_HOME": str(home),
        "MINIROSPY_LOCAL": "1",
        "PYTHONUNBUFFERED": "1",
        "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]),
    }
    with contextlib.ExitStack() as stack:
        terminal = Terminal(LAUNCH, environment)
        stack.callback(terminal.close)
        _wait(lambda: terminal.has("The zone is green."), "the nodes start")
        port = free_port()
        dashboard = Terminal(f"minirospy dashboard board --no-browser --port {port}", environment)
        stack.callback(dashboard.close)
        _wait(lambda: dashboard.has("token="), "the dashboard starts")
        page = Page(dashboard.find(r"http://127\.0\.0\.1:\S+token=[\w-]+"), width=PAGE[0], height=PAGE[1])
        stack.callback(page.close)
        page.wait_text("*", "connected")
        yield terminal, page


def _wait(condition: object, what: str) -> None:
    assert callable(condition)
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise SystemExit(f"first_picture.py: timeout: {what}")
        time.sleep(0.05)


def record(home: Path) -> list[Image.Image]:
    """Return the frames of the picture."""
    frames = []

    def add_frame(terminal: Terminal, page: Page) -> None:
        data = page.call("Page.captureScreenshot", format="png")["data"]
        frame = Image.new("RGB", (PANE[0] + PAGE[0], PANE[1]), "white")
        frame.paste(drawn(terminal.lines(), PANE))
        frame.paste(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB"), (PANE[0], 0))
        size = (round(frame.width * SCALE), round(frame.height * SCALE))
        frames.append(frame.resize(size, Image.Resampling.LANCZOS))

    with running(home) as (terminal, page), Board("workshop") as board:
        page.wait(LIT.format("green"))
        time.sleep(1)  # until the page shows the first scan
        begin = time.monotonic()
        while (passed := time.monotonic() - begin) < SECONDS:
            distance = distance_at(passed)
            board.move_person(None if distance is None else (distance, 0.0))
            add_frame(terminal, page)
            time.sleep(max(0.0, begin + len(frames) / RATE - time.monotonic()))
        # The last frame shows the end of the walk, even if the machine is too busy for the programs to keep up.
        board.move_person((WALK[-1][1], 0.0))
        page.wait(LIT.format("red"))
        add_frame(terminal, page)
    return frames


def write(frames: list[Image.Image], file: Path) -> None:
    """Write the frames as an animation of eight seconds that repeats."""
    file.parent.mkdir(exist_ok=True)
    duration = round(1000 * SECONDS / len(frames))
    frames[0].save(
        file, save_all=True, append_images=frames[1:], duration=duration, loop=0, quality=70, method=6
    )
    if file.stat().st_size > MAX_BYTES:
        raise SystemExit(f"first_picture.py: {file} has {file.stat().st_size} bytes, more than {MAX_BYTES}")


def main() -> int:
    """Record, and write the file."""
    parser = argparse.ArgumentParser(description="Record the README's moving picture.")
    parser.add_argument(
        "file",
        nargs="?",
        type=Path,
        default=ROOT / "docs" / "pictures" / "first.webp",
        help="the WebP to write",
    )
    file = parser.parse_args().file
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as home:
        frames = record(Path(home))
    write(frames, file)
    print(f"{file}: {len(frames)} frames, {file.stat().st_size:,} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
