"""Conversion between CameraInfo and the text of calibration files, in both formats. Pure.

Source: http://wiki.ros.org/camera_calibration_parsers (formats).
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence

from sensor_msgs.msg import CameraInfo

from minirospy.base.yaml_text import load

__all__ = ["CalibrationError", "ini_of", "parse_ini", "parse_yaml", "yaml_of"]

_MATRICES = (
    ("camera_matrix", "K", (3, 3)),
    ("distortion_coefficients", "D", None),
    ("rectification_matrix", "R", (3, 3)),
    ("projection_matrix", "P", (3, 4)),
)
"""(key, CameraInfo field, shape) of each matrix; a shape of None means any."""
_INI_COUNTS = {"width": 1, "height": 1, "camera matrix": 9, "rectification": 9, "projection": 12}
_INI_FIELDS = {"camera matrix": "K", "distortion": "D", "rectification": "R", "projection": "P"}
_MAX_DIGITS = 100  # maximum number of digits in the width or height, including leading zeros
_PLAIN = re.compile(r"[\w/][\w./-]*\Z", re.ASCII)


class CalibrationError(ValueError):
    """Raised if the text is not a calibration, or the format cannot store the calibration."""


def parse_yaml(text: str) -> tuple[str, CameraInfo]:
    """Return the camera's name and parameters. Raise CalibrationError if the text is not a calibration."""
    import yaml

    try:
        # Load all scalars as strings: a name may look like a number, and YAML 1.1 does not read 1e3 as a number.
        tree = load(text, yaml.BaseLoader)
    except yaml.YAMLError as error:
        raise CalibrationError(" ".join(str(error).split())) from error
    if not isinstance(tree, dict):
        raise CalibrationError("it is not a table of keys and values")

    info = CameraInfo(width=_pixels(tree.get("image_width")), height=_pixels(tree.get("image_height")))
    for key, field, shape in _MATRICES:
        setattr(info, field, _matrix(tree, key, shape))
    info.distortion_model = tree.get("distortion_model", "plumb_bob")
    name = tree.get("camera_name", "unknown")
    if not isinstance(name, str) or not isinstance(info.distortion_model, str):
        raise CalibrationError("camera_name and distortion_model are texts")
    return name, info


def yaml_of(name: str, info: CameraInfo) -> str:
    """Format a calibration as YAML, exactly like ROS."""
    lines = [f"image_width: {info.width}", f"image_height: {info.height}", f"camera_name: {_quoted(name)}"]

    def matrix(key: str, values: Sequence[float], rows: int) -> None:
        lines.extend([f"{key}:", f"  rows: {rows}", f"  cols: {len(values) // rows}"])
        lines.append(f"  data: [{', '.join(map(_number, values))}]")

    matrix("camera_matrix", info.K, 3)
    lines.append(f"distortion_model: {_quoted(info.distortion_model)}")
    matrix("distortion_coefficients", info.D, 1)
    matrix("rectification_matrix", info.R, 3)
    matrix("projection_matrix", info.P, 3)
    return "\n".join(lines)


def parse_ini(text: str) -> tuple[str, CameraInfo]:
    """Return the camera's name and parameters. Raise CalibrationError if the text is not a calibration."""
    name, found = "unknown", {}
    key = ""
    for line in (each.partition("#")[0].strip() for each in text.splitlines()):
        if line.startswith("[") and line.endswith("]"):
            name, key = (line[1:-1], "") if line != "[image]" else (name, "")
        elif line[:1].isalpha() and line.lower() not in ("inf", "nan"):
            key = line
            found[key] = ""
        elif key:
            found[key] += f" {line}"

    values = {key: _numbers(words.split()) for key, words in found.items()}
    for key, count in _INI_COUNTS.items():
        if len(values.get(key, ())) != count:
            raise CalibrationError(f"it has {len(values.get(key, ()))} numbers of {key!r}, not {count}")
    count = len(values.get("distortion", ()))
    if count not in (4, 5, 8):
        raise CalibrationError(f"it has {count} numbers of 'distortion', not 4, 5 or 8")

    info = CameraInfo(width=_pixels(found["width"]), height=_pixels(found["height"]))
    for key, field in _INI_FIELDS.items():
        setattr(info, field, values[key])
    info.distortion_model = {5: "plumb_bob", 8: "rational_polynomial"}.get(count, "")
    return name, info


def ini_of(name: str, info: CameraInfo) -> str:
    """Format a calibration as an .ini file, exactly like ROS.

    Raise CalibrationError if the model is not plumb_bob.
    """
    if info.distortion_model != "plumb_bob" or len(info.D) != 5:
        raise CalibrationError("an .ini file holds the distortion model plumb_bob with 5 numbers alone")

    def matrix(values: Sequence[float], columns: int) -> str:
        rows = [values[at : at + columns] for at in range(0, len(values), columns)]
        return "".join("".join(f"{each:.5f} " for each in row) + "\n" for row in rows)

    return (
        f"# Camera intrinsics\n\n[image]\n\nwidth\n{info.width}\n\nheight\n{info.height}\n\n[{name}]\n\n"
        f"camera matrix\n{matrix(info.K, 3)}\ndistortion\n{matrix(info.D, 5)}\n\n"
        f"rectification\n{matrix(info.R, 3)}\nprojection\n{matrix(info.P, 4)}"
    )


def _pixels(word: object) -> int:
    digits = word.strip() if isinstance(word, str) else ""
    # Check the number of digits first, because int() raises ValueError for more than 4300 digits.
    if not (digits.isdecimal() and len(digits) <= _MAX_DIGITS and int(digits) < 1 << 32):
        raise CalibrationError(f"a width or height is not a number of pixels: {word!r:.80}")
    return int(digits)


def _matrix(tree: dict[str, object], key: str, shape: tuple[int, int] | None) -> tuple[float, ...]:
    """Return a matrix's numbers. Raise CalibrationError if its shape is not ``shape`` (None: any shape is valid)."""
    found = tree.get(key)
    if not isinstance(found, dict):
        raise CalibrationError(f"{key} is missing")
    rows, columns, data = (found.get(word) for word in ("rows", "cols", "data"))
    if not isinstance(data, list):
        raise CalibrationError(f"{key} has no data")
    values = _numbers(data)
    sizes = _numbers([rows, columns])
    if len(values) != sizes[0] * sizes[1] or (shape and tuple(sizes) != shape):
        wanted = f"{shape[0]}x{shape[1]}" if shape else f"{rows}x{columns}"
        raise CalibrationError(f"{key} of {rows}x{columns} has {len(values)} numbers, not those of {wanted}")
    return values


def _numbers(words: Sequence[object]) -> tuple[float, ...]:
    try:
        return tuple(
            float(re.sub(r"^([-+]?)\.(inf|nan)$", r"\1\2", str(word), flags=re.IGNORECASE)) for word in words
        )
    except ValueError as error:
        raise CalibrationError(f"{error}") from error


def _number(value: float) -> str:
    """Format a number with all its digits, like yaml-cpp."""
    if math.isfinite(value):
        return f"{value:.17g}"
    return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"


def _quoted(text: str) -> str:
    return text if _PLAIN.match(text) else json.dumps(text, ensure_ascii=False)
