"""Maps of many kinds. recorded.json has the messages that the real map_server publishes for them (see make_recorded.py)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from PIL import Image

GREYS = bytes((0, 50, 51, 89, 90, 100, 127, 128, 204, 205, 206, 254, 255, 1, 200, 30))
COLOURS = bytes(value for grey in GREYS for value in (grey, 255 - grey, (grey * 7) % 256))
FIELDS = "resolution: 0.05\norigin: [-1.5, 2.0, 0.5]\n"
USUAL = "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"


class Case(NamedTuple):
    """A map, given by the lines of its YAML file after `image:`, and the image's file."""

    name: str
    image: str
    lines: str


def write_images(folder: Path) -> None:
    """Write the images, each 4 by 4 pixels, or 8 by 2 for one bit per pixel."""
    (folder / "grey.pgm").write_bytes(b"P5\n# by hand\n4 4\n255\n" + GREYS)
    (folder / "few.pgm").write_bytes(b"P5 4 4 100\n" + bytes(value % 101 for value in GREYS))
    (folder / "plain.pgm").write_bytes(
        b"P2\n4 4\n255\n" + b" ".join(b"%d" % value for value in GREYS) + b"\n"
    )
    (folder / "plain15.pgm").write_bytes(b"P2\n4 4 # so\n15\n" + b"\n".join(b"%d" % (v % 16) for v in GREYS))
    (folder / "deep.pgm").write_bytes(
        b"P5\n4 4\n65535\n" + bytes(value for grey in GREYS for value in (grey, 3))
    )
    (folder / "zero.pgm").write_bytes(b"P5\n4 4\n0\n" + GREYS)
    (folder / "short.pgm").write_bytes(b"P5\n4 4\n255\n" + GREYS[:9])
    (folder / "shortplain.pgm").write_bytes(b"P2\n4 4\n255\n1 2 3\n")
    (folder / "empty.pgm").write_bytes(b"")
    (folder / "wrong.pgm").write_bytes(b"P5\nx 4\n255\n" + GREYS)
    (folder / "narrow.pgm").write_bytes(b"P5\n0 4\n255\n")
    (folder / "text.pgm").write_bytes(b"not an image at all\n")
    (folder / "colour.ppm").write_bytes(b"P6\n4 4\n255\n" + COLOURS)
    (folder / "bits.pbm").write_bytes(b"P4\n8 2\n" + bytes((0b10110010, 0b00001111)))
    (folder / "plain.pbm").write_bytes(b"P1\n8 2\n1 0 1 1 0 0 1 0 0 0 0 0 1 1 1 1\n")

    colours = Image.frombytes("RGB", (4, 4), COLOURS)
    grey = Image.frombytes("L", (4, 4), GREYS)
    alpha = Image.frombytes("L", (4, 4), bytes(reversed(GREYS)))
    palette = Image.frombytes("P", (4, 4), bytes(range(16)))
    palette.putpalette(COLOURS)
    grey.save(folder / "grey.png")
    colours.save(folder / "colour.png")
    Image.merge("LA", (grey, alpha)).save(folder / "alpha.png")
    Image.merge("RGBA", (*colours.split(), alpha)).save(folder / "rgba.png")
    palette.save(folder / "palette.png")
    grey.convert("1", dither=Image.Dither.NONE).save(folder / "bits.png")
    palette.save(folder / "clear.png", transparency=3)
    Image.frombytes("I;16", (4, 4), bytes(value for v in GREYS for value in (7, v))).save(folder / "deep.png")
    grey.save(folder / "grey.bmp")
    colours.save(folder / "colour.bmp")
    palette.save(folder / "palette.gif")
    colours.save(folder / "colour.tga")
    grey.save(folder / "grey.tif")


IMAGES = (
    *(
        "few.pgm",
        "plain.pgm",
        "plain15.pgm",
        "deep.pgm",
        "zero.pgm",
        "short.pgm",
        "shortplain.pgm",
        "empty.pgm",
    ),
    *("wrong.pgm", "narrow.pgm", "text.pgm", "colour.ppm", "bits.pbm", "plain.pbm"),
    *("grey.png", "alpha.png", "palette.png", "bits.png", "clear.png", "deep.png"),
    *("grey.bmp", "colour.bmp", "palette.gif", "colour.tga", "grey.tif", "missing.pgm"),
)
SETTINGS = {
    "usual": USUAL,
    "trinary": USUAL + "mode: trinary\n",
    "scale": USUAL + "mode: scale\n",
    "raw": USUAL + "mode: raw\n",
    "negated": USUAL.replace("negate: 0", "negate: 1"),
    "negated scale": USUAL.replace("negate: 0", "negate: 1") + "mode: scale\n",
    "negated raw": USUAL.replace("negate: 0", "negate: 1") + "mode: raw\n",
    "other limits": "negate: 0\noccupied_thresh: 0.5\nfree_thresh: 0.5\nmode: scale\n",
    "crossed limits": "negate: 0\noccupied_thresh: 0.2\nfree_thresh: 0.8\n",
}
FAULTS = {
    "negate is text": USUAL.replace("negate: 0", "negate: false"),
    "negate is missing": USUAL.replace("negate: 0\n", ""),
    "no occupied": "negate: 0\nfree_thresh: 0.196\n",
    "no free": "negate: 0\noccupied_thresh: 0.65\n",
    "limit is text": USUAL.replace("0.65", "much"),
    "mode is unknown": USUAL + "mode: many\n",
    "mode is a list": USUAL + "mode: [1]\n",
    "no resolution": "origin: [0, 0, 0]\n" + USUAL,
    "resolution is text": "resolution: fine\norigin: [0, 0, 0]\n" + USUAL,
    "no origin": "resolution: 0.05\n" + USUAL,
    "short origin": "resolution: 0.05\norigin: [1, 2]\n" + USUAL,
    "origin is text": "resolution: 0.05\norigin: [a, b, c]\n" + USUAL,
    "origin is a number": "resolution: 0.05\norigin: 5\n" + USUAL,
    "nothing": "",
    "not yaml": "negate: [\n",
}


def cases() -> Iterator[Case]:
    """Yield every case."""
    for name, lines in SETTINGS.items():
        for image in ("grey.pgm", "rgba.png", "colour.png"):
            yield Case(f"{name}: {image}", image, FIELDS + lines)
    for image in IMAGES:
        yield Case(f"usual: {image}", image, FIELDS + USUAL)
        yield Case(f"raw: {image}", image, FIELDS + USUAL + "mode: raw\n")
    for name, lines in FAULTS.items():
        has_fields = name in ("not yaml", "nothing") or "resolution" in lines or "origin" in lines
        yield Case(name, "grey.pgm", lines if has_fields else FIELDS + lines)
    yield Case("empty image", "", FIELDS + USUAL)


def write_map(folder: Path, case: Case) -> Path:
    """Write a case's YAML file; return its path."""
    path = folder / "map.yaml"
    image = "" if case.name == "nothing" else f"image: {case.image or chr(34) * 2}\n"
    path.write_text(image + case.lines, encoding="utf-8")
    return path


class Grid(NamedTuple):
    """The map that map_saver receives, and its options."""

    name: str
    data: tuple[int, ...]
    width: int
    height: int
    resolution: float
    position: tuple[float, float]
    orientation: tuple[float, float, float, float]
    options: tuple[str, ...] = ()


ALL = tuple(range(-128, 128))
HALF = 0.7071067811865476
GRIDS = (
    Grid("all cells", ALL, 16, 16, 0.05, (-1.25, 3.5), (0, 0, 0, 1)),
    Grid("wide", ALL, 64, 4, 0.123456, (0, 0), (0, 0, 0.24740396440029144, 0.9689124226570129)),
    Grid("limits", ALL, 16, 16, 1.0, (1e7, -1e-7), (0, 0, HALF, HALF), ("--occ", "50", "--free", "49")),
    Grid("loose limits", ALL, 16, 16, 0.025, (0, 0), (0, 0, 1, 0), ("--occ", "100", "--free", "0")),
    Grid("tilted", (0,), 1, 1, 0.05, (0, 0), (0.1, 0.2, 0.3, 0.927)),
    Grid("not of length 1", (100,), 1, 1, 0.05, (0, 0), (0, 0, 2, 2)),
    Grid("upright", (100,), 1, 1, 0.05, (0, 0), (0, HALF, 0, HALF)),
    Grid("no rotation", (100,), 1, 1, 0.05, (0, 0), (0, 0, 0, 0)),
    Grid("empty", (), 0, 0, 0, (0, 0), (0, 0, 0, 1)),
)
