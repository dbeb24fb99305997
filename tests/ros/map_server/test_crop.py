"""crop_map: crops a map to its known cells."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from minirospy.workspace.packages import Packages

IMAGE = bytes(
    (205, 205, 205, 205, 205, 254, 0, 205, 205, 205, 254, 205, 205, 205, 205, 205, 205, 205, 205, 205)
)
FIELDS = "resolution: 0.1\norigin: [1.0, 2.0, 0.5]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
REAL = """free_thresh: 0.196
image: cropped.pgm
negate: 0
occupied_thresh: 0.65
origin:
- 0.9918731484681967
- 2.2234590662384948
- 0.5
resolution: 0.1
"""


def crop(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [*Packages().find_executable("map_server", "crop_map"), *words]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60, check=False)


def test_cropped_map_is_that_of_the_real_program(tmp_path: Path) -> None:
    (tmp_path / "a.pgm").write_bytes(b"P5 4 5 255\n" + IMAGE)
    (tmp_path / "a.yaml").write_text(f"image: a.pgm\n{FIELDS}")
    assert crop(tmp_path, "a.yaml").returncode == 0
    assert (tmp_path / "cropped.pgm").read_bytes() == b"P5\n2 2\n255\n" + bytes((254, 0, 205, 254))
    # The real crop_map has written this from the same files.
    assert (tmp_path / "cropped.yaml").read_text() == REAL
    assert crop(tmp_path, "a.yaml", "b.yaml").returncode == 0
    assert (tmp_path / "b.pgm").is_file()


@pytest.mark.parametrize(
    ("image", "words", "text"),
    [
        (b"P5 2 1 255\n\xcd\xcd", ["a.yaml"], "every cell of the map is unknown"),
        (b"P6 1 1 255\n\xcd\xcd\xcd", ["a.yaml"], "has colors"),
        (b"P5 1 1", ["a.yaml"], "file truncated"),
        (b"P5 1 1 255\n1", ["b.yaml"], "No such file"),
        (b"P5 1 1 255\n1", [], "Usage: "),
    ],
)
def test_map_that_cannot_be_cropped_is_one_line(
    tmp_path: Path, image: bytes, words: list[str], text: str
) -> None:
    (tmp_path / "a.pgm").write_bytes(image)
    (tmp_path / "a.yaml").write_text(f"image: a.pgm\n{FIELDS}")
    done = crop(tmp_path, *words)
    assert done.returncode == 1
    assert text in done.stderr
    assert len(done.stderr.splitlines()) == 1
