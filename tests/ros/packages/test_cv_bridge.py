"""cv_bridge: padding, views and faults. tests/referee compares the pixels with ROS."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from cv_bridge import CvBridge, CvBridgeError
from sensor_msgs.msg import CompressedImage, Image

from minirospy.base.installation import install_command
from tests.conftest import modules_loaded_by

bridge = CvBridge()


def test_image_is_a_view_of_the_message() -> None:
    message = Image(height=4, width=5, encoding="bgr8", step=15, data=bytes(range(60)))
    image = bridge.imgmsg_to_cv2(message, "bgr8")
    assert np.shares_memory(image, np.frombuffer(message.data, np.uint8))
    assert not image.flags.writeable
    assert image[3, 4].tolist() == [57, 58, 59]


@pytest.mark.parametrize(("encoding", "size"), [("mono8", 1), ("bgr8", 3), ("16UC1", 2), ("32FC3", 12)])
@pytest.mark.parametrize("big", [False, True])
def test_bytes_between_rows_are_left_out(encoding: str, size: int, big: bool) -> None:
    rows = [bytes(range(at, at + 5 * size)) for at in range(4)]
    packed = Image(height=4, width=5, encoding=encoding, step=5 * size, is_bigendian=big, data=b"".join(rows))
    padded = Image(
        height=4,
        width=5,
        encoding=encoding,
        step=5 * size + 3,
        is_bigendian=big,
        # The last row may lack its padding.
        data=b"xxx".join(rows),
    )
    np.testing.assert_array_equal(bridge.imgmsg_to_cv2(padded), bridge.imgmsg_to_cv2(packed))


def test_step_of_zero_is_that_of_the_width() -> None:
    message = Image(height=2, width=3, encoding="mono8", step=0, data=b"abcdef")
    assert bridge.imgmsg_to_cv2(message).tobytes() == b"abcdef"


def test_image_with_less_data_than_its_size_is_refused() -> None:
    message = Image(height=480, width=640, encoding="rgb8", step=1920, data=bytes(1000))
    with pytest.raises(CvBridgeError) as caught:
        bridge.imgmsg_to_cv2(message)
    assert str(caught.value) == "the image of 640x480 [rgb8] needs 921600 bytes, its data has 1000"


@pytest.mark.parametrize(("height", "width"), [(0, 0), (0, 5), (5, 0)])
def test_empty_images_go_there_and_back(height: int, width: int) -> None:
    image = bridge.imgmsg_to_cv2(Image(height=height, width=width, encoding="bgr8"))
    assert image.shape == (height, width, 3)
    message = bridge.cv2_to_imgmsg(image, "bgr8")
    assert (message.height, message.width, message.step, message.data) == (height, width, 0, b"")


@pytest.mark.parametrize("dtype", [bool, np.int64, np.complex64, "S3"])
def test_array_of_a_type_that_images_lack_is_refused(dtype: type) -> None:
    with pytest.raises(CvBridgeError, match="have no encoding: there is uint8, int8"):
        bridge.cv2_to_imgmsg(np.zeros((2, 2), dtype))


@pytest.mark.parametrize("shape", [(), (4,), (2, 2, 3, 1)])
def test_array_that_is_not_an_image_is_refused(shape: tuple[int, ...]) -> None:
    for convert in (bridge.cv2_to_imgmsg, bridge.cv2_to_compressed_imgmsg):
        with pytest.raises(CvBridgeError, match=f"two or three dimensions, not {len(shape)}"):
            convert(np.zeros(shape, np.uint8))


def without(module: str, code: str) -> str:
    """Run a program that cannot import a module; return its output."""
    head = (
        f"import sys; sys.modules[{module!r}] = None; sys.modules['cv2'] = None\n"
        "import numpy as np; from cv_bridge import CvBridge, CvBridgeError; from sensor_msgs.msg import Image\n"
        "try:\n    "
    )
    tail = "\nexcept CvBridgeError as error:\n    print(error)"
    return subprocess.check_output([sys.executable, "-c", head + code + tail], text=True)


@pytest.mark.parametrize(
    ("source", "wanted", "size"),
    [("bayer_rggb8", "bgr8", 4), ("bayer_gbrg16", "mono16", 8), ("yuv422", "rgb8", 8)],
)
def test_colors_that_need_opencv_say_so(source: str, wanted: str, size: int) -> None:
    code = f"CvBridge().imgmsg_to_cv2(Image(height=2, width=2, encoding={source!r}, data=bytes({size})), {wanted!r})"
    text = f"converting [{source}] to [{wanted}] needs OpenCV: {install_command('opencv-python-headless')}\n"
    assert without("cv2", code) == text


def test_brightness_of_yuv_needs_no_opencv() -> None:
    message = Image(height=1, width=2, encoding="yuv422", step=4, data=bytes([128, 10, 129, 20]))
    assert bridge.imgmsg_to_cv2(message, "mono8").tolist() == [[10, 20]]


def test_compressed_images_without_pillow_say_what_to_install() -> None:
    text = without("PIL", "CvBridge().cv2_to_compressed_imgmsg(np.zeros((2, 2), np.uint8))")
    assert text == f"compressed images need OpenCV or Pillow: {install_command('minirospy[images]')}\n"


@pytest.mark.parametrize("data", [b"", b"\xff\xd8\xff", b"not an image", b"\x89PNG\r\n\x1a\n" + bytes(40)])
def test_compressed_data_that_is_not_an_image_is_refused(data: bytes) -> None:
    with pytest.raises(CvBridgeError, match="bytes are not an image that"):
        bridge.compressed_imgmsg_to_cv2(CompressedImage(format="jpeg", data=data))


def test_truncated_compressed_image_is_refused() -> None:
    message = bridge.cv2_to_compressed_imgmsg(np.arange(30000, dtype=np.uint8).reshape(100, 100, 3), "png")
    message.data = message.data[: len(message.data) // 2]
    with pytest.raises(CvBridgeError, match="bytes are not an image that"):
        bridge.compressed_imgmsg_to_cv2(message)


@pytest.mark.parametrize(
    ("image", "format"),
    [
        (np.zeros((2, 2), np.float32), "jpg"),
        (np.zeros((2, 2, 2), np.uint8), "png"),
        (np.zeros((2, 2), np.uint16), "jpg"),
        (np.zeros((2, 2), np.uint8), "nonsense"),
        (np.zeros((0, 0), np.uint8), "jpg"),
    ],
)
def test_image_that_a_format_cannot_hold_is_refused(image: np.ndarray, format: str) -> None:
    with pytest.raises(CvBridgeError):
        bridge.cv2_to_compressed_imgmsg(image, format)


def test_import_leaves_numpy_unloaded() -> None:
    assert not {"numpy", "PIL"} & modules_loaded_by("import cv_bridge; cv_bridge.CvBridge()")
