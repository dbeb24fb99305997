"""Convert image messages to JPEG and PNG. Pure; uses OpenCV, simplejpeg or Pillow, whichever is installed."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from minirospy.base.errors import BridgeError
from minirospy.core.images.compressed import Options, decode, encode, opencv
from minirospy.core.images.encodings import converted, is_converted_by_opencv
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
_STAMPED = 12  # bytes of a header's seq and stamp, before the length of its frame_id
# Number of leading bytes of a file in which to search for the image's size; other data, such as a preview, may precede it.
_HEAD_BYTES = 100_000
# number of rows of a numeric image to scale per step; as 64-bit numbers they take eight times the memory
_ROWS = 256
_MAGIC = {b"\xff\xd8\xff": "image/jpeg", b"\x89PN": "image/png", b"RIF": "image/webp"}


def encoded(type_: str, body: bytes, picture: Picture) -> tuple[bytes, str]:
    """Encode a serialized message's image as a file; return the file and its content type.

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
            image = decode(data, MAX_PIXELS)
        elif type_ == IMAGE:
            raw = Image()
            raw.deserialize(body)
            image = _colors(pixels(raw), raw.encoding)
        else:
            raise BridgeError(f"messages of [{type_}] are not images: {IMAGE} and {COMPRESSED} are")
        image = _changed(image, picture)
        return _file(image, picture), f"image/{picture.format or 'jpeg'}"
    except BridgeError:
        raise
    except Exception as error:  # image libraries raise many types of exceptions for invalid data
        why: object = error
        if isinstance(error, ImportError) or isinstance(error.__cause__, ImportError):
            # Clients receive this text, so do not include the install command, which contains the interpreter's path.
            why = "it needs OpenCV or Pillow: install minirospy[images] on the server"
        raise BridgeError(f"the image cannot be shown: {why}") from error


def _content_type(data: bytes) -> str:
    return _MAGIC.get(data[:3], "")


def _is_as_wanted(data: bytes, picture: Picture) -> bool:
    """Return whether a compressed image can be sent to the client unchanged."""
    is_plain = not (picture.is_inverted or picture.width or picture.height) and picture.quality == 95
    found = _content_type(data)
    return bool(found) and is_plain and picture.format in ("", found.removeprefix("image/"))


def _colors(image: Pixels, encoding: str) -> Pixels:
    """Return an image as 8-bit gray or BGR; a numeric image is scaled to its largest value."""

    if encoding in ("mono8", "bgr8", "8UC1", "8UC3"):
        return image
    if encoding.startswith(("32F", "64F", "16S", "32S")) or encoding in ("16UC1", "8S", "8SC1"):
        return _scaled(image[..., 0] if image.ndim == 3 else image)
    if encoding.startswith("bayer") and opencv() is None:
        return _debayered(image, encoding)
    if encoding in ("mono16",):
        return converted(image, encoding, "mono8")
    if is_converted_by_opencv(encoding, "bgr8"):
        return _by_opencv(image, encoding)
    return converted(image, encoding, "bgr8")


def _scaled(image: Pixels) -> Pixels:
    """Return a numeric image in gray. The largest value becomes white; negative values, infinities and NaN become black."""
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
    """Return the number of pixels to process for a serialized message, as far as it can be determined in advance."""
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


def _by_opencv(image: Pixels, encoding: str) -> Pixels:
    """Convert a YUV or Bayer image to colors with OpenCV; without OpenCV, YUV becomes gray."""
    cv2 = opencv()
    if cv2 is None:
        return converted(image, encoding, "mono8")
    if encoding == "yuv422":
        return cv2.cvtColor(image, cv2.COLOR_YUV2BGR_UYVY)  # type: ignore[no-any-return]
    # OpenCV names a Bayer pattern by the pixels in its second row and column.
    name = {"rggb": "BG", "bggr": "RG", "gbrg": "GR", "grbg": "GB"}[encoding[6:10]]
    found: Pixels = cv2.cvtColor(image, getattr(cv2, f"COLOR_Bayer{name}2BGR"))
    return converted(found, "bgr16", "bgr8") if encoding.endswith("16") else found


def _debayered(image: Pixels, encoding: str) -> Pixels:
    """Return the colors of a Bayer pattern; each cell of four pixels becomes one pixel."""
    import numpy as np

    eight = converted(image, "mono16", "mono8") if encoding.endswith("16") else image
    height, width = (size // 2 * 2 for size in eight.shape[:2])
    cells = [eight[at // 2 : height : 2, at % 2 : width : 2].astype(np.uint16) for at in range(4)]
    colors = {
        color: [cell for cell, name in zip(cells, encoding[6:10], strict=True) if name == color]
        for color in "bgr"
    }
    planes = [sum(found[1:], found[0]) // len(found) for found in colors.values()]
    return np.stack(planes, axis=-1).astype(np.uint8)


def _changed(image: Pixels, picture: Picture) -> Pixels:
    """Return an image scaled to the requested size, rotated by 180 degrees if requested."""
    if image.dtype != "uint8":
        # A compressed image may have 16 bits per channel.
        image = (image >> 8).astype("uint8")
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
