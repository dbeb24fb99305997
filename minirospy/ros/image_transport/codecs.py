"""Encodes and decodes images for the transports compressed and compressedDepth. Pure.

A CompressedImage's format names the original encoding: ``rgb8; jpeg compressed bgr8``. In compressedDepth, 12 bytes
precede the PNG: an enum, and the two floats that convert 32-bit depths to 16 bits: inverse = A / depth + B.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sensor_msgs.msg import CompressedImage, Image

from minirospy.core.images.compressed import Options, decode, encode
from minirospy.ros.cv_bridge.cv_bridge.core import CvBridge, CvBridgeError

if TYPE_CHECKING:
    from minirospy.core.images.encodings import Pixels

__all__ = [
    "CodecError",
    "Settings",
    "compressed",
    "compressed_depth",
    "uncompressed",
    "uncompressed_depth",
]

_COLORS = {f"{name}{bits}" for name in ("rgb", "bgr", "rgba", "bgra") for bits in (8, 16)}
_HEADER = struct.Struct("<iff")
_INVERSE_DEPTH = 0
_BRIDGE = CvBridge()


class CodecError(ValueError):
    """Raised if the transport does not support the image, or the data is not a valid image."""


@dataclass(frozen=True)
class Settings:
    """The transports' parameters, with ROS's defaults; ``png_level`` None selects the transport's default."""

    format: str = "jpeg"
    jpeg_quality: int = 80
    jpeg_progressive: bool = False
    jpeg_optimize: bool = False
    png_level: int | None = None
    depth_max: float = 10.0
    depth_quantization: float = 100.0


def compressed(image: Image, settings: Settings) -> CompressedImage:
    """Encode an image as JPEG or PNG.

    Raise CodecError if the settings select another format, or the image's encoding does not have 8 or 16 bits per channel.
    """
    kind = settings.format
    if kind not in ("jpeg", "png"):
        raise CodecError(f"Unknown compression type '{kind}', valid options are 'jpeg' and 'png'")
    depth, _ = _type_of(image.encoding)
    bits = {"uint8": 8, "int8": 8, "uint16": 16, "int16": 16}.get(depth)
    if bits is None:
        raise CodecError(
            f"{kind.upper()} compression requires an encoding of 8 or 16 bits: {image.encoding!r}"
        )

    target = (f"bgr{8 if kind == 'jpeg' else bits}") if image.encoding in _COLORS else ""
    pixels = _pixels(image, target or "passthrough")
    if kind == "jpeg" and bits == 16 and not target:
        # Like OpenCV, clip 16-bit values that JPEG cannot store.
        pixels = pixels.clip(0, 255).astype("uint8")
    options = Options(
        settings.jpeg_quality,
        settings.jpeg_progressive,
        settings.jpeg_optimize,
        9 if settings.png_level is None else settings.png_level,
    )
    made = CompressedImage(header=image.header, format=f"{image.encoding}; {kind} compressed {target}")
    made.data = _encoded(pixels, "jpg" if kind == "jpeg" else "png", options)
    return made


def uncompressed(message: CompressedImage) -> Image:
    """Decode a compressed image to the encoding that the message's ``format`` names.

    Raise CodecError if the data is not a valid image in that format.
    """
    pixels = _decoded(bytes(message.data))
    encoding, semicolon, rest = message.format.partition(";")
    channels = 1 if pixels.ndim == 2 else pixels.shape[2]
    if not semicolon:
        kinds = {1: "mono8", 3: "bgr8", 4: "bgra8"}
        encoding = kinds[channels] if pixels.dtype == "uint8" else f"16UC{channels}"
    elif encoding in _COLORS and channels in (3, 4):
        # OpenCV decodes to BGR. If the format lacks "bgr", the encoder has swapped red and blue.
        bits = "16" if pixels.dtype == "uint16" else "8"
        order = "bgr" if "compressed bgr" in rest else "rgb"
        pixels = _converted(pixels, order + ("a" if channels == 4 else "") + bits, encoding)
    elif channels != _type_of(encoding)[1] and encoding.startswith(("mono", "bayer")):
        pixels = _converted(pixels, "bgr8", "mono8")
    return _message(message, pixels, encoding)


def compressed_depth(image: Image, settings: Settings) -> CompressedImage:
    """Encode a depth image as PNG: 16-bit depths as they are, floats as inverse depths. Depths beyond the maximum become 0.

    Raise CodecError if the image has another encoding.
    """
    import numpy as np

    depth, channels = _type_of(image.encoding)
    if channels != 1 or depth not in ("float32", "int32", "uint16", "int16"):
        raise CodecError(
            "Compression requires single-channel 32bit-floating point or 16bit raw depth images "
            f"(input format is: {image.encoding})"
        )
    pixels = _pixels(image, "passthrough")
    a = b = 0.0
    if depth == "float32":
        a = settings.depth_quantization * (settings.depth_quantization + 1.0)
        b = 1.0 - a / settings.depth_max
        with np.errstate(all="ignore"):
            inverse = np.clip(np.nan_to_num(np.float32(a) / pixels + np.float32(b)), 0, 65535)
            # NaN and depths beyond the maximum become 0.
            pixels = np.where(pixels < settings.depth_max, inverse, 0).astype(np.uint16)
    elif depth == "int32":
        raise CodecError(f"depths are 32 bit floats or 16 bit integers, not {image.encoding}")
    else:
        depths = pixels.astype(np.uint16)
        pixels = np.where(depths > min(65535, settings.depth_max * 1000), 0, depths).astype(np.uint16)

    made = CompressedImage(header=image.header, format=f"{image.encoding}; compressedDepth png")
    level = 1 if settings.png_level is None else settings.png_level
    made.data = _HEADER.pack(_INVERSE_DEPTH, a, b) + _encoded(pixels, "png", Options(level=level))
    return made


def uncompressed_depth(message: CompressedImage) -> Image:
    """Decode a compressed depth image; missing depths become 0 or NaN.

    Raise CodecError if the data is not a valid depth image.
    """
    import numpy as np

    encoding, _, rest = message.format.partition(";")
    if "compressedDepth" not in rest or "rvl" in rest:
        raise CodecError(f"[{message.format}] is not a depth image as PNG: its format has 'compressedDepth'")
    if len(message.data) <= _HEADER.size:
        raise CodecError(f"{len(message.data)} bytes are not a depth image: it starts with {_HEADER.size}")
    _, a, b = _HEADER.unpack_from(message.data)
    pixels = _decoded(bytes(message.data[_HEADER.size :]))
    if pixels.ndim != 2:
        raise CodecError(f"a depth image has one channel, not {pixels.shape[2]}")
    if _type_of(encoding)[0] == "float32":
        with np.errstate(all="ignore"):
            depths = np.float32(a) / (pixels.astype(np.float32) - np.float32(b))
        pixels = np.where(pixels == 0, np.float32("nan"), depths).astype(np.float32)
    return _message(message, pixels, encoding)


def _type_of(encoding: str) -> tuple[str, int]:
    try:
        return _BRIDGE.encoding_to_dtype_with_channels(encoding)
    except CvBridgeError as error:
        raise CodecError(str(error)) from error


def _pixels(image: Image, encoding: str) -> Pixels:
    try:
        pixels = _BRIDGE.imgmsg_to_cv2(image, encoding)
    except CvBridgeError as error:
        raise CodecError(str(error)) from error
    if not pixels.size:
        raise CodecError(f"the image is empty: {image.width}x{image.height}")
    return pixels


def _converted(pixels: Pixels, source: str, target: str) -> Pixels:
    try:
        return _BRIDGE.imgmsg_to_cv2(_BRIDGE.cv2_to_imgmsg(pixels, source), target)
    except CvBridgeError as error:
        raise CodecError(str(error)) from error


def _encoded(pixels: Pixels, kind: str, options: Options) -> bytes:
    try:
        return encode(pixels, kind, options)
    except ValueError as error:
        raise CodecError(str(error)) from error


def _decoded(data: bytes) -> Pixels:
    try:
        return decode(data)
    except ValueError as error:
        raise CodecError(str(error)) from error


def _message(source: CompressedImage, pixels: Pixels, encoding: str) -> Image:
    try:
        return _BRIDGE.cv2_to_imgmsg(pixels, encoding, header=source.header)
    except CvBridgeError as error:
        raise CodecError(f"{error} (format [{source.format}])") from error
