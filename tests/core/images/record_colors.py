"""Record how OpenCV converts images of each encoding to 8-bit BGR: `/usr/bin/python3 tests/core/images/record_colors.py`."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import cv2  # type: ignore[import-not-found]
import numpy as np

RECORDED = Path(__file__).with_name("colors.json")
# OpenCV names a Bayer pattern by the pixels in its second row and column.
BAYER = {"rggb": "BG", "bggr": "RG", "gbrg": "GR", "grbg": "GB"}
YUV = {"yuv422": "UYVY", "uyvy": "UYVY", "yuv422_yuy2": "YUY2", "yuyv": "YUY2"}


def eight(image: Any) -> Any:
    """Return the 8-bit image as cv_bridge makes it."""
    return (
        np.clip(np.rint(image * (255 / 65535)), 0, 255).astype(np.uint8) if image.dtype == "uint16" else image
    )


def main() -> None:
    """Write the file."""
    rng = np.random.default_rng(7)
    found: dict[str, Any] = {}

    def keep(name: str, data: Any, bgr: Any) -> None:
        found[name] = {"data": data.tolist(), "bgr": eight(bgr).tolist()}

    for pattern, code in BAYER.items():
        for bits in (8, 16):
            data = rng.integers(0, 2**bits, (6, 8), dtype=f"uint{bits}")
            keep(f"bayer_{pattern}{bits}", data, cv2.cvtColor(data, getattr(cv2, f"COLOR_Bayer{code}2BGR")))
    for name, code in YUV.items():
        data = rng.integers(0, 256, (4, 8, 2), dtype=np.uint8)
        data[0], data[1, :4] = 0, 255
        keep(name, data, cv2.cvtColor(data, getattr(cv2, f"COLOR_YUV2BGR_{code}")))
    for name, order in (
        *(("8UC3", "bgr"), ("8UC4", "bgra"), ("bgra8", "bgra"), ("rgba8", "rgba"), ("bgr16", "bgr")),
        *(("16UC3", "bgr"), ("16UC4", "bgra"), ("rgb16", "rgb"), ("rgba16", "rgba")),
    ):
        bits = 16 if "16" in name else 8
        data = rng.integers(0, 2**bits, (3, 5, len(order)), dtype=f"uint{bits}")
        keep(name, data, data[..., [order.index(each) for each in "bgr"]])

    gray = rng.integers(0, 65536, (5, 7), dtype=np.uint16)
    steps = (np.cumsum(np.ones((5, 7, 3)), axis=1) * (777, 3000, 8000)).astype(np.uint16)
    noise = rng.integers(0, 65536, (5, 7, 3), dtype=np.uint16)
    files = {
        name: {"file": base64.b64encode(cv2.imencode(".png", image)[1]).decode(), "values": image.tolist()}
        for name, image in (("gray", gray), ("bgr steps", steps), ("bgr noise", noise))
    }
    RECORDED.write_text(json.dumps({"encodings": found, "png": files}) + "\n", encoding="utf-8")


main()
