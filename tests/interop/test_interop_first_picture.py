"""The README's moving picture can be recorded again, and shows what the README says."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.interop.browser import CHROMIUM, PATIENCE

ROOT = Path(__file__).parents[2]
PICTURE = ROOT / "docs" / "pictures" / "first.webp"
FONT = Path("/usr/share/fonts/truetype/dejavu/DejaVuSansMono.ttf")

Image = pytest.importorskip("PIL.Image")


def seconds_and_colours(file: Path) -> tuple[float, list[str]]:
    """Return an animation's duration, and the brightest LED colour of its first and last frame."""
    picture = Image.open(file)
    duration, colours = 0.0, []
    for number in range(picture.n_frames):
        picture.seek(number)
        frame = picture.convert("RGB")
        duration += picture.info["duration"] / 1000
        if number in (0, picture.n_frames - 1):
            board = frame.crop((frame.width * 2 // 5, 0, frame.width * 3 // 4, frame.height))
            r, g, b = np.moveaxis(np.asarray(board), 2, 0)
            lit = {
                "green": int(((g > 200) & (r < 120) & (b < 160)).sum()),
                "red": int(((r > 220) & (g < 120) & (b < 120)).sum()),
            }
            colours.append(max(lit, key=lit.__getitem__))
    return duration, colours


def test_picture_of_the_readme_lasts_eight_seconds_and_turns_red() -> None:
    duration, colours = seconds_and_colours(PICTURE)
    assert duration == pytest.approx(8, abs=0.5)
    assert colours == ["green", "red"]
    assert PICTURE.stat().st_size < 1_500_000
    assert PICTURE.relative_to(ROOT).as_posix() in (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.mark.skipif(not CHROMIUM, reason="chromium is not installed: make interop")
@pytest.mark.skipif(not FONT.exists(), reason="fonts-dejavu-core is not installed")
def test_picture_is_recorded(tmp_path: Path) -> None:
    file = tmp_path / "first.webp"
    done = subprocess.run(
        [sys.executable, str(ROOT / "tools" / "first_picture.py"), str(file)],
        capture_output=True,
        text=True,
        timeout=2.5 * PATIENCE,
        check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 0, done.stderr
    assert seconds_and_colours(file)[1] == ["green", "red"]
