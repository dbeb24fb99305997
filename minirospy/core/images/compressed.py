"""Compressed images, with OpenCV if it is installed, else with Pillow (`pip install "minirospy[images]"`)."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING, Any, NamedTuple

from minirospy.base.installation import install_command
from minirospy.core.images.sizes import size_of

if TYPE_CHECKING:
    from minirospy.core.images.encodings import Pixels

__all__ = ["MAX_PIXELS", "Options", "decode", "encode", "opencv"]

_FORMATS = {
    **dict.fromkeys(("jpg", "jpeg", "jpe"), "JPEG"),
    **dict.fromkeys(("bmp", "dib"), "BMP"),
    **dict.fromkeys(("tif", "tiff"), "TIFF"),
    **dict.fromkeys(("pbm", "pgm", "ppm"), "PPM"),
    "png": "PNG",
    "webp": "WEBP",
    "jp2": "JPEG2000",
}
_QUALITY = 95  # JPEG quality, OpenCV's default


MAX_PIXELS = 100_000_000
"""Maximum number of pixels in a decoded image.

A file of a few kilobytes may have ten times as many pixels, and use gigabytes of memory.
"""


class Options(NamedTuple):
    """Options for compressing an image."""

    quality: int = _QUALITY  # JPEG quality, from 1 to 100
    progressive: bool = False
    optimize: bool = False
    # PNG compression level, from 0 to 9 (the smallest file); None for the library's default
    level: int | None = None


def opencv() -> Any:
    """Return the module cv2, or None if it is not installed."""
    try:
        import cv2  # type: ignore[import-not-found]
    except ImportError:
        return None
    return cv2


def require_library() -> None:
    """Raise ValueError with installation instructions if neither OpenCV nor Pillow is installed."""
    if opencv() is None:
        _pillow()


def decode(data: bytes, max_pixels: int = MAX_PIXELS) -> Pixels:
    """Decode a compressed image, with its channels in OpenCV's order: gray, BGR or BGRA.

    Raise ValueError if it is not an image or, before decoding it, if its header states more than ``max_pixels`` pixels. If the
    limit is lower than the default, also reject an image whose size cannot be determined in advance.
    """
    import numpy as np

    size = size_of(data)
    if size:
        _check_size(size, max_pixels)
    cv2 = opencv()
    if cv2:
        if size is None and data and max_pixels < MAX_PIXELS:
            raise ValueError(f"{len(data)} bytes are of an image format that is not known")
        image: Pixels | None = (
            cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if data else None
        )
        if image is None:
            raise ValueError(f"{len(data)} bytes are not an image that OpenCV can read")
        return image

    pillow = _pillow()
    try:
        with pillow.open(BytesIO(data)) as picture:
            _check_size(picture.size, max_pixels)
            if picture.mode.startswith("I;16"):
                return np.asarray(picture).astype(np.uint16)
            if picture.mode not in ("L", "RGB", "RGBA"):
                has_alpha = "A" in picture.mode or "transparency" in picture.info
                mode = "L" if picture.mode == "1" else "RGBA" if has_alpha else "RGB"
                return _swapped(np.asarray(picture.convert(mode)))
            return _swapped(np.asarray(picture))
    except (OSError, ValueError, SyntaxError, pillow.DecompressionBombError) as error:
        raise ValueError(f"{len(data)} bytes are not an image that Pillow can read: {error}") from error


def _check_size(size: tuple[int, int], max_pixels: int) -> None:
    width, height = size
    if width * height > max_pixels:
        raise ValueError(f"an image of {width}x{height} pixels is too large: {max_pixels} are allowed")


def encode(image: Pixels, format: str, options: Options | None = None) -> bytes:
    """Encode a gray, BGR or BGRA image in a format such as jpg or png. Raise ValueError if the format is not supported."""
    options = options or Options()
    import numpy as np

    cv2 = opencv()
    if cv2:
        try:
            choices = [cv2.IMWRITE_JPEG_QUALITY, options.quality]
            choices += [cv2.IMWRITE_JPEG_PROGRESSIVE, int(options.progressive)]
            choices += [cv2.IMWRITE_JPEG_OPTIMIZE, int(options.optimize)]
            choices += [] if options.level is None else [cv2.IMWRITE_PNG_COMPRESSION, options.level]
            data: bytes = np.asarray(cv2.imencode(f".{format}", image, choices)[1]).tobytes()
        except cv2.error as error:
            raise ValueError(str(error)) from error
        return data

    name = _FORMATS.get(format.lower())
    if name is None:
        raise ValueError(f"{format!r} is not a format: there is {', '.join(_FORMATS)}")
    if image.ndim == 3 and image.shape[2] == 1:
        image = image[..., 0]
    deep = image.dtype == np.uint16 and image.ndim == 2 and name in ("PNG", "TIFF", "JPEG2000")
    if not deep and (image.dtype != np.uint8 or (image.ndim == 3 and image.shape[2] not in (3, 4))):
        raise ValueError(f"an image of {image.dtype} and shape {image.shape} cannot be {format}")
    if name in ("JPEG", "PPM") and image.ndim == 3:
        image = image[..., :3]

    buffer, pillow = BytesIO(), _pillow()
    keywords: dict[str, int] = {"quality": options.quality}
    if name == "JPEG":
        keywords |= {"progressive": int(options.progressive), "optimize": int(options.optimize)}
    if name == "PNG" and options.level is not None:
        keywords["compress_level"] = options.level
    try:
        pillow.fromarray(_swapped(image)).save(buffer, name, **keywords)
    except (OSError, ValueError, KeyError) as error:
        raise ValueError(f"the image cannot be {format}: {error}") from error
    return buffer.getvalue()


def _swapped(image: Pixels) -> Pixels:
    """Swap an image's red and blue channels; OpenCV uses BGR, Pillow RGB."""
    import numpy as np

    if image.ndim == 2:
        return image
    order = [2, 1, 0, 3][: image.shape[2]]
    return np.ascontiguousarray(image[..., order])


def _pillow() -> Any:
    try:
        from PIL import Image
    except ImportError as error:
        raise ValueError(
            f"compressed images need OpenCV or Pillow: {install_command('minirospy[images]')}"
        ) from error
    return Image
