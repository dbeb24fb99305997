"""The maps in cases.py have the same occupancies as in the real map_server (recorded.json)."""

from __future__ import annotations

import json
import math
import re
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.errors import MinirospyError, UsageError
from minirospy.base.installation import install_command
from minirospy.ros.map_server.grid import (
    MapError,
    Mode,
    pgm_of_grid,
    quaternion_of_yaw,
    read_settings,
    to_grid,
    yaml_of_map,
    yaw_of_quaternion,
)
from minirospy.ros.map_server.images import ImageError, read_image
from minirospy.ros.map_server.saver import SaverOptions, parse_options
from tests.ros.map_server.cases import FIELDS, GREYS, GRIDS, USUAL, Case, Grid, cases, write_images, write_map

RECORDED = json.loads((Path(__file__).parent / "recorded.json").read_text(encoding="utf-8"))
SAVED = json.loads((Path(__file__).parent / "saved.json").read_text(encoding="utf-8"))
# minirospy accepts these, but the real program rejects them: they have a comment after the size.
WIDER = {"usual: plain15.pgm", "raw: plain15.pgm"}
OWN_WORDS = {
    name: tag
    for names, tag in (
        (("negate is text", "negate is missing"), "a negate tag"),
        (("no occupied", "limit is text"), "an occupied_thresh tag"),
        (("no free",), "a free_thresh tag"),
        (("no resolution", "resolution is text", "nothing"), "a resolution tag"),
        (("no origin", "short origin", "origin is text", "origin is a number"), "an origin tag"),
    )
    for name in names
}
"""Cases in which the real program fails with `bad conversion`, and never prints its own message, which names the field."""


@pytest.fixture(scope="module")
def images(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("maps")
    write_images(folder)
    return folder


def ours(folder: Path, case: Case) -> object:
    text = write_map(folder, case).read_text(encoding="utf-8")
    try:
        settings = read_settings(text)
        pixels = read_image((folder / settings.image).read_bytes())
    except MinirospyError as error:
        return str(error)
    except OSError:
        return "Couldn't open"
    z, w = quaternion_of_yaw(settings.origin[2])
    (resolution,) = struct.unpack("<f", struct.pack("<f", settings.resolution))
    height, width, _ = pixels.values.shape
    return {
        "size": [width, height],
        "resolution": resolution,
        "origin": [*settings.origin[:2], z, w],
        "data": to_grid(pixels, settings).tolist(),
    }


@pytest.mark.parametrize("case", list(cases()), ids=lambda case: case.name)
def test_maps_are_those_of_the_real_program(images: Path, case: Case) -> None:
    found, real = ours(images, case), RECORDED[case.name]
    if case.name in WIDER:
        assert isinstance(found, dict)
    elif isinstance(real, dict):
        assert found == real
    elif case.name in OWN_WORDS:
        assert str(found).startswith(f"The map does not contain {OWN_WORDS[case.name]} or it is invalid")
    elif case.name == "not yaml":
        assert str(found).startswith("The map's file is not YAML in line 3: ")
    else:
        reason = real[0].partition('": ')[2] if "failed to open" in real[0] else real[0]
        assert str(found).startswith(reason.replace(" FOLDER/missing.pgm", ""))


def test_each_case_is_recorded() -> None:
    assert [case.name for case in cases()] == list(RECORDED)


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"P5 99999 99999 255\n", "99999 x 99999 pixels are more than a map can have"),
        (b"P2 2 2 255\n1 2 three 4", "not an image: "),
        (b"P2 2 2 255\n1 2 -3 4", "a value is not between 0 and 255"),
        (b"P2 2 2 255\n1 2 300 4", "a value is not between 0 and 255"),
        (b"P6 2 2 255\nabc", "file truncated: 3 of 12 bytes"),
        (b"P4 9 2\nabc", "file truncated: 3 of 4 bytes"),
        (b"\x89PNG\r\n\x1a\n\x00\x00", "Unsupported image format"),
    ],
)
def test_broken_images_are_one_line(data: bytes, text: str) -> None:
    with pytest.raises(ImageError) as caught:
        read_image(data)
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)


@given(
    st.binary(max_size=60),
    st.sampled_from((b"P1", b"P2", b"P3", b"P4", b"P5", b"P6", b"\x89PNG\r\n\x1a\n", b"GIF8")),
)
def test_any_bytes_are_an_image_or_one_error(rest: bytes, start: bytes) -> None:
    try:
        pixels = read_image(start + rest)
    except ImageError:
        return
    assert pixels.values.ndim == 3


@given(st.text(max_size=80))
def test_any_text_is_a_map_or_one_error(text: str) -> None:
    try:
        read_settings(text)
    except MapError:
        pass


def test_image_without_pillow_names_what_to_install(images: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "PIL", None)
    with pytest.raises(ImageError, match=re.escape(install_command("minirospy[images]"))):
        read_image((images / "grey.png").read_bytes())
    assert read_image((images / "grey.pgm").read_bytes()).values.size == 16


def test_numbers_are_read_as_the_real_program_reads_them() -> None:
    lines = FIELDS.replace("0.05", "1e-2") + USUAL.replace("negate: 0", "negate: 0x1")
    settings = read_settings(f"image: a.pgm\n{lines}")
    assert (settings.resolution, settings.negate, settings.mode) == (0.01, True, Mode.TRINARY)


def test_saved_image_is_read_again_as_it_was() -> None:
    cells = [-1, 0, 100, 25, 26, 64, 65, -128, 127, 1, 99, 50]
    data = pgm_of_grid(cells, 4, 3, 0.05, 65, 25)
    assert data.startswith(b"P5\n# CREATOR: map_saver.cpp 0.050 m/pix\n4 3\n255\n")
    settings = read_settings(yaml_of_map("m.pgm", 0.05, (1.5, -2, 0.25)))
    assert settings.origin == (1.5, -2, 0.25)
    again = to_grid(read_image(data), settings).tolist()
    assert again == [-1, 0, 100, 0, -1, -1, 100, -1, 100, 0, 100, -1]


@pytest.mark.parametrize("grid", GRIDS, ids=lambda grid: grid.name)
def test_saved_files_are_byte_by_byte_those_of_the_real_program(grid: Grid) -> None:
    options = parse_options(grid.options)
    assert options
    (resolution,) = struct.unpack("<f", struct.pack("<f", grid.resolution))
    real = SAVED[grid.name]
    image = pgm_of_grid(grid.data, grid.width, grid.height, resolution, options.occupied, options.free)
    assert image.decode("latin-1") == real["pgm"]
    yaw = yaw_of_quaternion(*grid.orientation)
    # This is the only difference: the real program's output for 0, 0, 0, 0 cannot be parsed.
    expected = real["yaml"].replace("-nan", "0.000000")
    assert yaml_of_map("saved.pgm", resolution, (*grid.position, yaw)) == expected


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["--occ", "0"], "threshold_occupied must be between 1 and 100"),
        (["--occ", "many"], "threshold_occupied must be between 1 and 100"),
        (["--free", "101"], "threshold_free must be between 0 and 100"),
        (["--occ", "25"], "threshold_free must be smaller than threshold_occupied"),
        (["-f"], ""),
        (["--wrong"], ""),
        (["name"], ""),
    ],
)
def test_wrong_options_of_the_saver_are_refused(words: list[str], text: str) -> None:
    with pytest.raises(UsageError) as caught:
        parse_options(words)
    assert str(caught.value) == text


def test_options_of_the_saver() -> None:
    assert parse_options(["--occ", "70x", "-f", "a b", "--free", " 3"]) == SaverOptions("a b", 70, 3)
    assert parse_options(["--occ", "70", "-h"]) is None


def test_grid_that_lacks_cells_is_refused() -> None:
    with pytest.raises(MapError, match="the map has 3 cells, where 2 x 2 are 4"):
        pgm_of_grid([0, 0, 0], 2, 2, 0.05, 65, 25)


@pytest.mark.parametrize("yaw", [0.0, 0.5, -3.0, math.pi / 2])
def test_yaw_survives_the_quaternion(yaw: float) -> None:
    z, w = quaternion_of_yaw(yaw)
    assert yaw_of_quaternion(0, 0, z, w) == pytest.approx(yaw, abs=1e-6)


def test_yaw_of_odd_quaternions() -> None:
    assert yaw_of_quaternion(0, 0, 0, 0) == 0
    half = math.sqrt(0.5)
    assert yaw_of_quaternion(0, half, 0, half) == pytest.approx(0, abs=1e-6)


def test_large_image_is_converted_within_memory() -> None:
    side = 1000
    pixels = read_image(b"P5 %d %d 255\n" % (side, side) + bytes(GREYS) * (side * side // 16))
    settings = read_settings(f"image: a\n{FIELDS}{USUAL}")
    grid = to_grid(pixels, settings)
    assert grid.dtype == np.int8
    assert len(grid) == side * side
