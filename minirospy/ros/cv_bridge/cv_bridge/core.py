"""cv_bridge.core: CvBridge. It requires numpy; OpenCV is required only for Bayer patterns and YUV."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

from minirospy.base.installation import install_command
from minirospy.core.images.compressed import decode, encode, opencv
from minirospy.core.images.encodings import DEPTHS, converted, is_converted_by_opencv, type_of_encoding
from minirospy.core.images.view import pixels

if TYPE_CHECKING:
    import numpy

    from minirospy.core.images.encodings import Pixels

__all__ = ["CvBridge", "CvBridgeError"]


class CvBridgeError(TypeError):
    """Raised if the image cannot be converted."""


class CvBridge:
    """Converts messages to OpenCV arrays, (height, width) or (height, width, channels), and back."""

    def __init__(self) -> None:
        self.cvdepth_to_numpy_depth: dict[int, str] = dict(enumerate(DEPTHS.values()))
        self.cvtype_to_name: dict[int, str] = {
            type_of_encoding(f"{depth}C{channels}"): f"{depth}C{channels}"
            for depth in DEPTHS
            for channels in range(1, 5)
        }
        self.numpy_type_to_cvtype: dict[str, str] = {
            **{dtype: depth for depth, dtype in DEPTHS.items()},
            **DEPTHS,
        }

    def dtype_with_channels_to_cvtype2(self, dtype: numpy.dtype[numpy.generic], n_channels: int) -> str:
        """Return the OpenCV name for an array type, such as 8UC3. Raise CvBridgeError if OpenCV has no such type."""
        if dtype.name not in self.numpy_type_to_cvtype:
            raise CvBridgeError(
                f"images of {dtype.name} have no encoding: there is {', '.join(DEPTHS.values())}"
            )
        return f"{self.numpy_type_to_cvtype[dtype.name]}C{n_channels}"

    def cvtype2_to_dtype_with_channels(self, cvtype: int) -> tuple[str, int]:
        """Return the numpy type and the number of channels for an OpenCV type number."""
        return self.cvdepth_to_numpy_depth[cvtype % 8], cvtype // 8 + 1

    def encoding_to_cvtype2(self, encoding: str) -> int:
        """Return the OpenCV type number for an encoding. Raise CvBridgeError if the encoding is unknown."""
        try:
            return type_of_encoding(encoding)
        except ValueError as error:
            raise CvBridgeError(error) from error

    def encoding_to_dtype_with_channels(self, encoding: str) -> tuple[str, int]:
        """Return the numpy type and the number of channels for an encoding. Raise CvBridgeError if the encoding is unknown."""
        return self.cvtype2_to_dtype_with_channels(self.encoding_to_cvtype2(encoding))

    def imgmsg_to_cv2(self, img_msg: Image, desired_encoding: str = "passthrough") -> Pixels:
        """Convert an image message to an array.

        The array is a read-only view into the message's data, without a copy, unless the encoding or byte order has to change.
        Padding between the rows (``step``) is skipped. Raise CvBridgeError if the encoding is unknown, the conversion
        does not exist, or the message has too little data.
        """
        try:
            image = pixels(img_msg)
        except ValueError as error:
            raise CvBridgeError(error) from error
        if desired_encoding == "passthrough":
            return image
        return _converted(image, img_msg.encoding, desired_encoding)

    def cv2_to_imgmsg(
        self, cvim: Pixels, encoding: str = "passthrough", header: Header | None = None
    ) -> Image:
        """Convert an array to an image message.

        Raise CvBridgeError if the array's type does not match the encoding, TypeError if ``cvim`` is not an array.
        """
        _check_array(cvim)
        message = Image()
        message.height, message.width = cvim.shape[:2]
        if header is not None:
            message.header = header
        name = self.dtype_with_channels_to_cvtype2(cvim.dtype, 1 if cvim.ndim < 3 else cvim.shape[2])
        message.encoding = name if encoding == "passthrough" else encoding
        if encoding != "passthrough" and self.cvtype_to_name.get(self.encoding_to_cvtype2(encoding)) != name:
            raise CvBridgeError(f"encoding specified as {encoding}, but image has incompatible type {name}")
        if cvim.dtype.byteorder == ">" or (cvim.dtype.byteorder == "=" and sys.byteorder == "big"):
            message.is_bigendian = True
        message.data = cvim.tobytes()
        message.step = len(message.data) // message.height if message.height else 0
        return message

    def compressed_imgmsg_to_cv2(
        self, cmprs_img_msg: CompressedImage, desired_encoding: str = "passthrough"
    ) -> Pixels:
        """Decode a compressed message. Raise CvBridgeError if the data is not an image or the conversion does not exist."""
        try:
            image = decode(bytes(cmprs_img_msg.data))
        except ValueError as error:
            raise CvBridgeError(error) from error
        if desired_encoding == "passthrough":
            return image
        channels = 1 if image.ndim == 2 else image.shape[2]
        kind = {1: "mono", 3: "bgr", 4: "bgra"}[channels]
        return _converted(image, f"{kind}{8 * image.dtype.itemsize}", desired_encoding)

    def cv2_to_compressed_imgmsg(self, cvim: Pixels, dst_format: str = "jpg") -> CompressedImage:
        """Convert an array to a compressed message: jpg, png, bmp, tiff, webp or another format that OpenCV supports.

        Raise CvBridgeError if the format does not support the array, TypeError if ``cvim`` is not an array.
        """
        _check_array(cvim)
        try:
            return CompressedImage(format=dst_format, data=encode(cvim, dst_format))
        except ValueError as error:
            raise CvBridgeError(error) from error


def _check_array(image: object) -> None:
    import numpy as np

    if not isinstance(image, np.ndarray):
        raise TypeError("Your input type is not a numpy array")
    if image.ndim not in (2, 3):
        raise CvBridgeError(f"an image has two or three dimensions, not {image.ndim}")


def _converted(image: Pixels, source: str, wanted: str) -> Pixels:
    """Convert an image to another encoding. Raise CvBridgeError if there is no such conversion."""
    try:
        if is_converted_by_opencv(source, wanted):
            image, source = _by_opencv(image, source, wanted)
        return converted(image, source, wanted)
    except ValueError as error:
        raise CvBridgeError(error) from error


def _by_opencv(image: Pixels, source: str, wanted: str) -> tuple[Pixels, str]:
    """Convert a Bayer or YUV image to a color image of the same depth; return it with its new encoding.

    Raise ValueError if OpenCV is not installed.
    """
    cv2 = opencv()
    if cv2 is None:
        raise ValueError(
            f"converting [{source}] to [{wanted}] needs OpenCV: {install_command('opencv-python-headless')}"
        )

    # OpenCV names a Bayer pattern after the second row's pixels, starting at the second column.
    patterns = {
        "bayer_rggb": "BayerBG",
        "bayer_bggr": "BayerRG",
        "bayer_gbrg": "BayerGR",
        "bayer_grbg": "BayerGB",
    }
    name = source.rstrip("0123456789")
    bits = "16" if source.endswith("16") else "8"
    color = wanted.rstrip("0123456789")
    if name in patterns and color in ("bgra", "rgba"):
        raise ValueError(f"Unsupported conversion from [{source}] to [{wanted}]")
    code = f"COLOR_{patterns.get(name, 'YUV')}2{'GRAY' if color == 'mono' else color.upper()}"
    if name not in patterns:
        code += "_UYVY"
    return cv2.cvtColor(image, getattr(cv2, code)), f"{color}{bits if name in patterns else 8}"
