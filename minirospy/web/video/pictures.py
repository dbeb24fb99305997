"""Convert image messages to JPEG and PNG. Pure; uses OpenCV, simplejpeg or Pillow, whichever is installed."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from minirospy.base.errors import BridgeError
from minirospy.core.images.colors import debayered, eight_bits, yuv_to_bgr
from minirospy.core.images.compressed import Options, decode, encode, opencv
from minirospy.core.images.encodings import converted
from minirospy.core.images.sizes import size_of
from minirospy.core.images.view import pixels
from minirospy.web.video.options import Picture

if TYPE_CHECKING:
    from minirospy.core.images.encodings import Pixels

__all__ = ["COMPRESSED", "IMAGE", "MAX_PIXELS", "encoded", "work_of"]

IMAGE = "sensor_msgs/Image"
COMPRESSED = "sensor_msgs/CompressedImage"

_FASTEST_PNG = 1
MAX_PIXELS = 16_000_000  # maximum number of pixels in a compressed or an enlarged image
_LENGTH = struct.Struct("<I")
_DEPTH_HEADER = struct.Struct(
    "<iff"
)  # header of compressedDepth: an enum, and two floats for converting inverse depths to depths
_ALIASES = {"uyvy": "yuv422"}  # ROS 2's names for ROS 1 encodings
_YUYV = ("yuv422_yuy2", "yuyv")
# cv_bridge interprets numbers in three or four channels as colours, in OpenCV's order
_AS_COLORS = {"8UC4": "bgr8", "16UC3": "bgr16", "16UC4": "bgr16"}
_STAMPED = 12  # bytes of a header before the length of its frame_id: seq and stamp
# Number of bytes in which to search for the image's size, which may follow other data, such as a preview.
_HEAD_BYTES = 100_000
# number of rows of a numeric image to scale per step: the 64-bit numbers used take eight times the image's memory
_ROWS = 256
_MAGIC = {b"\xff\xd8\xff": "image/jpeg", b"\x89PN": "image/png", b"RIF": "image/webp"}


def encoded(type_: str, body: bytes, picture: Picture) -> tuple[bytes, str]:
    """Encode the image in a serialized message; return the file's bytes and content type.

    Raise BridgeError if it cannot be converted.
    """
    from sensor_msgs.msg import CompressedImage, Image

    try:
        if type_ == COMPRESSED:
            message = CompressedImage()
            message.deserialize(body)
            data = bytes(message.data)
            if _is_as_wanted(data, picture):
                return data, _content_type(data)
            image = _decompressed(data, message.format)
        elif type_ == IMAGE:
            raw = Image()
            raw.deserialize(body)
            encoding = _ALIASES.get(raw.encoding, raw.encoding)
            raw.encoding = "8UC2" if encoding in _YUYV else encoding
            image = _colors(pixels(raw), encoding)
        else:
            raise BridgeError(f"messages of [{type_}] are not images: {IMAGE} and {COMPRESSED} are")
        image = _transformed(image, picture)
        return _file(image, picture), f"image/{picture.format or 'jpeg'}"
    except BridgeError:
        raise
    except Exception as error:  # image libraries raise many types of exceptions for invalid data
        why: object = error
        if isinstance(error, ImportError) or isinstance(error.__cause__, ImportError):
            # Clients receive this text, so omit the install command, which contains the interpreter's path.
            why = "it needs OpenCV or Pillow: install minirospy[images] on the server"
        raise BridgeError(f"the image cannot be shown: {why}") from error


def _content_type(data: bytes) -> str:
    return _MAGIC.get(data[:3], "")


def _is_as_wanted(data: bytes, picture: Picture) -> bool:
    """Return whether a compressed image can be sent to the client without changes."""
    is_plain = not (picture.is_inverted or picture.width or picture.height) and picture.quality == 95
    found = _content_type(data)
    if found == "image/png" and data[24:25] == b"\x10" and picture.format:
        return False  # browsers show only the upper 8 of 16 bits per channel
    return bool(found) and is_plain and picture.format in ("", found.removeprefix("image/"))


def _decompressed(data: bytes, format_: str) -> Pixels:
    """Decode a compressed image to 8-bit gray or BGR. ``format_`` is the message's field, such as ``16UC1; png compressed``.

    Raise ValueError if it is not an image.
    """
    encoding, _, rest = format_.partition(";")
    if "compressedDepth" in rest:
        return _scaled(_depths(data, encoding))
    image = decode(data, MAX_PIXELS)
    if image.dtype != "uint16":
        return image
    if image.ndim == 2:
        return (
            _colors(image, encoding) if encoding == "mono16" or encoding[:6] == "bayer_" else _scaled(image)
        )
    return eight_bits(image)


def _depths(data: bytes, encoding: str) -> Pixels:
    """Return the depths in a compressed depth image, in metres if ``encoding`` is 32FC1, otherwise in millimetres.

    Raise ValueError if it is not a compressed depth image.
    """
    import numpy as np

    if len(data) <= _DEPTH_HEADER.size:
        raise ValueError(f"{len(data)} bytes are not a compressed depth image")
    _, a, b = _DEPTH_HEADER.unpack_from(data)
    image = decode(data[_DEPTH_HEADER.size :], MAX_PIXELS)
    if image.ndim != 2:
        raise ValueError(f"a depth image has one channel, not {image.shape[2]}")
    if encoding != "32FC1":
        return image
    with np.errstate(all="ignore"):
        return np.where(image == 0, np.nan, a / (image - b)).astype(np.float32)


def _colors(image: Pixels, encoding: str) -> Pixels:
    """Convert an image to 8-bit gray or BGR. Scale a numeric image to its largest value."""
    if encoding in ("mono8", "bgr8", "8UC1", "8UC3"):
        return image
    if encoding in _AS_COLORS:
        image, encoding = image[..., :3], _AS_COLORS[encoding]
    if encoding in _YUYV or encoding == "yuv422":
        return _of_yuv(image, encoding)
    if encoding.startswith("bayer"):
        found = _of_bayer(image, encoding[6:10])
        return eight_bits(found) if encoding.endswith("16") else found
    if encoding.startswith(("32F", "64F", "16S", "32S", "16U", "8S", "8U")):
        return _scaled(image[..., 0] if image.ndim == 3 else image)
    return converted(image, encoding, "mono8" if encoding == "mono16" else "bgr8")


def _scaled(image: Pixels) -> Pixels:
    """Convert a numeric image to gray. The largest value becomes white; negative and non-finite values become black."""
    import numpy as np

    def values(start: int) -> Pixels:
        found = image[start : start + _ROWS].astype(np.float64)
        return np.nan_to_num(found, nan=0.0, posinf=0.0, neginf=0.0)

    starts = range(0, len(image), _ROWS)
    largest = max((float(values(start).max(initial=0.0)) for start in starts), default=0.0)
    factor = 255 / largest if largest > 0 else 0
    found = np.empty(image.shape, np.uint8)
    for start in starts:
        found[start : start + _ROWS] = (np.clip(values(start), 0, None) * factor).astype(np.uint8)
    return found


def work_of(type_: str, body: bytes | memoryview) -> int:
    """Estimate the number of pixels in a serialized image: MAX_PIXELS if its size is not found, 0 if it is invalid."""
    if type_ != COMPRESSED:
        return len(body) // 3
    try:
        (frame_id,) = _LENGTH.unpack_from(body, _STAMPED)
        (format_,) = _LENGTH.unpack_from(body, _STAMPED + 4 + frame_id)
    except struct.error:
        return 0
    start = _STAMPED + 4 + frame_id + 4 + format_ + 4
    size = size_of(bytes(body[start : start + _HEAD_BYTES]))
    return min(size[0] * size[1], MAX_PIXELS) if size else MAX_PIXELS


def _of_yuv(image: Pixels, encoding: str) -> Pixels:
    cv2 = opencv()
    if cv2 is None:
        return yuv_to_bgr(image, has_luma_first=encoding in _YUYV)
    code = cv2.COLOR_YUV2BGR_YUY2 if encoding in _YUYV else cv2.COLOR_YUV2BGR_UYVY
    return cv2.cvtColor(image, code)  # type: ignore[no-any-return]


def _of_bayer(image: Pixels, pattern: str) -> Pixels:
    cv2 = opencv()
    if cv2 is None or min(image.shape) < 3:
        return debayered(image, pattern)
    # OpenCV names Bayer patterns by the pixels in the second row and column.
    name = {"rggb": "BG", "bggr": "RG", "gbrg": "GR", "grbg": "GB"}[pattern]
    return cv2.cvtColor(image, getattr(cv2, f"COLOR_Bayer{name}2BGR"))  # type: ignore[no-any-return]


def _transformed(image: Pixels, picture: Picture) -> Pixels:
    """Return the image scaled to the requested size and, if requested, rotated by 180 degrees."""
    if picture.is_inverted:
        image = image[::-1, ::-1]
    height, width = image.shape[:2]
    wanted = (picture.width or width, picture.height or height)
    if wanted[0] * wanted[1] > max(MAX_PIXELS, width * height):
        raise BridgeError(
            f"an image of {wanted[0]}x{wanted[1]} pixels is too large: {MAX_PIXELS} are allowed"
        )
    return image if wanted == (width, height) else _resized(image, wanted)


def _resized(image: Pixels, size: tuple[int, int]) -> Pixels:
    import numpy as np

    cv2 = opencv()
    if cv2:
        return cv2.resize(np.ascontiguousarray(image), size)  # type: ignore[no-any-return]
    from PIL import Image

    found = Image.fromarray(np.ascontiguousarray(image)).resize(size, Image.Resampling.BILINEAR)
    return np.asarray(found)


def _file(image: Pixels, picture: Picture) -> bytes:
    import numpy as np

    if picture.format == "png":
        return encode(image, "png", Options(level=_FASTEST_PNG))
    try:
        import simplejpeg  # type: ignore[import-not-found]
    except ImportError:
        return encode(image, "jpg", Options(quality=picture.quality))
    colors = np.ascontiguousarray(image if image.ndim == 3 else image[..., None])
    space = {1: "GRAY", 3: "BGR", 4: "BGRA"}[colors.shape[2]]
    data: bytes = simplejpeg.encode_jpeg(colors, picture.quality, space, "420")
    return data
