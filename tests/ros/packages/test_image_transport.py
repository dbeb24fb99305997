"""image_transport: republish's conversions of images, the format strings, faults, and the program itself."""

from __future__ import annotations

import hashlib
import json
import math
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cv_bridge import CvBridge
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

from minirospy.base.installation import install_command
from minirospy.ros.image_transport.codecs import (
    CodecError,
    Settings,
    compressed,
    compressed_depth,
    uncompressed,
    uncompressed_depth,
)
from minirospy.ros.image_transport.republish import settings_of

BRIDGE = CvBridge()
PROGRAM = Path(__file__).parents[3] / "minirospy" / "ros" / "image_transport" / "nodes" / "republish"
PNG = Settings(format="png")
RECORDED = json.loads(Path(__file__).with_name("compressed_images.json").read_text(encoding="utf-8"))


def image(encoding: str) -> Image:
    """Return a smooth image of 32x24 pixels."""
    dtype, channels = BRIDGE.encoding_to_dtype_with_channels(encoding)
    v, u = np.mgrid[:24, :32]
    planes = [(u * 7 + v * 3 * (at + 1)) % 251 for at in range(channels)]
    pixels = np.stack(planes, axis=-1).astype(dtype) * (200 if dtype == "uint16" else 1)
    made = BRIDGE.cv2_to_imgmsg(pixels if channels > 1 else pixels[..., 0], encoding)
    made.header = Header(seq=7, frame_id="camera")
    return made


@pytest.mark.parametrize(
    ("encoding", "settings", "format"),
    [
        ("rgb8", Settings(), "rgb8; jpeg compressed bgr8"),
        ("bgr8", Settings(), "bgr8; jpeg compressed bgr8"),
        ("bgra8", Settings(), "bgra8; jpeg compressed bgr8"),
        ("mono8", Settings(), "mono8; jpeg compressed "),
        ("bayer_rggb8", Settings(), "bayer_rggb8; jpeg compressed "),
        ("rgb16", Settings(), "rgb16; jpeg compressed bgr8"),
        ("mono16", Settings(), "mono16; jpeg compressed "),
        ("rgb8", PNG, "rgb8; png compressed bgr8"),
        ("8UC1", PNG, "8UC1; png compressed "),
        ("16UC1", PNG, "16UC1; png compressed "),
    ],
)
def test_format_names_both_encodings(encoding: str, settings: Settings, format: str) -> None:
    made = compressed(image(encoding), settings)
    assert (made.format, made.header) == (format, image(encoding).header)
    assert made.data.startswith(b"\xff\xd8\xff" if settings is not PNG else b"\x89PNG\r\n")


@pytest.mark.parametrize("encoding", ["rgb8", "bgr8", "mono8", "8UC1", "bayer_gbrg8", "mono16", "16UC1"])
def test_png_is_without_loss(encoding: str) -> None:
    sent = image(encoding)
    assert uncompressed(compressed(sent, PNG)) == sent


@pytest.mark.parametrize("encoding", ["rgba8", "bgra8"])
def test_transparency_becomes_opaque(encoding: str) -> None:
    sent = image(encoding)
    found = BRIDGE.imgmsg_to_cv2(uncompressed(compressed(sent, PNG))).copy()
    expected = BRIDGE.imgmsg_to_cv2(sent).copy()
    expected[..., 3] = 255
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("encoding", ["rgb8", "bgr8", "mono8"])
def test_jpeg_is_close_and_smaller_with_less_quality(encoding: str) -> None:
    sent = image("mono8") if encoding == "mono8" else image(encoding)
    v, u = np.mgrid[:24, :32]
    smooth = (u * 4 + v * 3).astype(np.uint8)
    sent.data = (
        smooth if encoding == "mono8" else np.stack([smooth, smooth // 2, 255 - smooth], -1)
    ).tobytes()
    good, poor = (compressed(sent, Settings(jpeg_quality=quality)) for quality in (95, 10))
    assert len(poor.data) < len(good.data)
    found = uncompressed(good)
    assert (found.encoding, found.header, found.step) == (encoding, sent.header, sent.step)
    difference = BRIDGE.imgmsg_to_cv2(found).astype(int) - BRIDGE.imgmsg_to_cv2(sent)
    assert abs(difference).mean() < 4


def recorded_source(encoding: str) -> Image:
    """Return the image from which the real plug-ins made the recording."""
    dtype, channels = BRIDGE.encoding_to_dtype_with_channels(encoding)
    v, u = np.mgrid[:48, :64]
    if dtype == "float32":
        pixels = (0.3 + u * 0.2 + v * 0.01).astype(np.float32)
        pixels[5, 5] = np.nan
    else:
        planes = [(u * 2 + v * (1 + at)) % 200 for at in range(channels)]
        pixels = np.stack(planes, -1).astype(dtype) * (100 if dtype == "uint16" else 1)
        pixels = pixels if channels > 1 else pixels[..., 0]
    return BRIDGE.cv2_to_imgmsg(np.ascontiguousarray(pixels), encoding)


@pytest.mark.parametrize("row", RECORDED, ids=lambda row: row["format"])
def test_messages_of_the_real_plug_ins_are_read_as_they_read_them(row: dict[str, Any]) -> None:
    """The recording was made and read by Debian's republish and the plug-ins of image_transport_plugins 1.15 (noetic)."""
    message = CompressedImage(format=row["format"], data=bytes.fromhex(row["data"]))
    source = recorded_source(row["encoding"])
    assert hashlib.sha256(source.data).hexdigest() == row["source"]
    encode, decode = {
        "compressed": (compressed, uncompressed),
        "compressedDepth": (compressed_depth, uncompressed_depth),
    }[row["transport"]]
    found = decode(message)
    *shape, digest = row["decoded"]
    assert [found.encoding, found.width, found.height, found.step, found.is_bigendian] == shape
    if "jpeg" in row["format"]:
        # JPEG decoders round differently.
        ours = BRIDGE.imgmsg_to_cv2(uncompressed(compressed(source, Settings()))).astype(int)
        assert abs(ours - BRIDGE.imgmsg_to_cv2(found)).max() <= 12
    else:
        assert hashlib.sha256(found.data).hexdigest() == digest

    made = encode(source, Settings(format="jpeg" if "jpeg" in row["format"] else "png"))
    assert made.format == message.format
    if row["transport"] == "compressedDepth":
        assert made.data[:12] == message.data[:12]


def test_format_without_semicolon_is_that_of_the_picture() -> None:
    made = compressed(image("rgb8"), PNG)
    made.format = "png"
    found = uncompressed(made)
    assert found.encoding == "bgr8"
    np.testing.assert_array_equal(BRIDGE.imgmsg_to_cv2(found, "rgb8"), BRIDGE.imgmsg_to_cv2(image("rgb8")))


def test_format_of_old_bags_has_red_and_blue_exchanged() -> None:
    made = compressed(image("rgb8"), PNG)
    made.format = "rgb8; png compressed rgb8"
    np.testing.assert_array_equal(
        BRIDGE.imgmsg_to_cv2(uncompressed(made)), BRIDGE.imgmsg_to_cv2(image("rgb8"))[..., ::-1]
    )


def test_depths_of_integers_are_without_loss_up_to_the_limit() -> None:
    sent = image("16UC1")
    made = compressed_depth(sent, Settings(depth_max=20.0))
    assert made.format == "16UC1; compressedDepth png"
    assert struct.unpack("<iff", made.data[:12]) == (0, 0.0, 0.0)
    found = BRIDGE.imgmsg_to_cv2(uncompressed_depth(made))
    depths = BRIDGE.imgmsg_to_cv2(sent)
    np.testing.assert_array_equal(found, np.where(depths > 20000, 0, depths))


def test_depths_of_floats_are_inverse_depths() -> None:
    depths = np.array(
        [[0.5, 1.0, 2.0, 9.99], [10.0, 11.0, math.nan, math.inf], [0.0, -1.0, 0.151, 5.0]], np.float32
    )
    made = compressed_depth(BRIDGE.cv2_to_imgmsg(depths, "32FC1"), Settings())
    assert made.format == "32FC1; compressedDepth png"
    kind, a, b = struct.unpack("<iff", made.data[:12])
    assert (kind, a, b) == (0, 10100.0, -1009.0)
    found = BRIDGE.imgmsg_to_cv2(uncompressed_depth(made))
    assert found[0] == pytest.approx([0.5, 1.0, 2.0, 9.99], rel=0.1)
    assert found[0, :3] == pytest.approx([0.5, 1.0, 2.0], rel=0.001)
    assert np.isnan(found[1]).all()
    assert found[2, 2:] == pytest.approx([0.15178, 5.0], rel=0.001)


@pytest.mark.parametrize(
    ("encode", "sent", "reason"),
    [
        (compressed, image("32FC1"), "JPEG compression requires an encoding of 8 or 16 bits: '32FC1'"),
        (compressed, Image(encoding="foo", width=1, height=1), r"Unrecognized image encoding \[foo\]"),
        (compressed, Image(encoding="rgb8"), "the image is empty: 0x0"),
        (
            compressed,
            Image(encoding="rgb8", width=640, height=480, step=1920),
            "needs 921600 bytes, its data has 0",
        ),
        (compressed_depth, image("rgb8"), r"single-channel .* \(input format is: rgb8\)"),
        (compressed_depth, image("32SC1"), "32 bit floats or 16 bit integers, not 32SC1"),
        (compressed_depth, Image(encoding="16UC1", width=9, height=9, step=18), "needs 162 bytes"),
    ],
)
def test_images_that_a_transport_cannot_take(encode: object, sent: Image, reason: str) -> None:
    with pytest.raises(CodecError, match=reason):
        encode(sent, Settings())  # type: ignore[operator]


@pytest.mark.parametrize(
    ("decode", "message", "reason"),
    [
        (
            uncompressed,
            CompressedImage(format="rgb8; jpeg compressed bgr8", data=b"nothing"),
            "are not an image",
        ),
        (uncompressed, CompressedImage(format="rgb8; jpeg compressed bgr8"), "0 bytes are not an image"),
        (
            uncompressed_depth,
            CompressedImage(format="16UC1; png compressed ", data=b"x" * 20),
            "compressedDepth",
        ),
        (
            uncompressed_depth,
            CompressedImage(format="16UC1; compressedDepth rvl", data=b"x" * 20),
            "depth image as PNG",
        ),
        (uncompressed_depth, CompressedImage(format="16UC1; compressedDepth", data=b"x" * 9), "9 bytes"),
        (
            uncompressed_depth,
            CompressedImage(format="16UC1; compressedDepth", data=b"x" * 90),
            "are not an image",
        ),
    ],
)
def test_bytes_that_are_not_an_image(decode: object, message: CompressedImage, reason: str) -> None:
    with pytest.raises(CodecError, match=reason):
        decode(message)  # type: ignore[operator]


def test_unknown_format_is_refused() -> None:
    with pytest.raises(
        CodecError, match="Unknown compression type 'tiff', valid options are 'jpeg' and 'png'"
    ):
        compressed(image("rgb8"), Settings(format="tiff"))


def test_parameters_are_clamped_and_checked() -> None:
    assert settings_of({}) == Settings()
    assert settings_of({"jpeg_quality": 500, "png_level": 0, "depth_max": 7, "else": 1}) == Settings(
        jpeg_quality=100, png_level=1, depth_max=7.0
    )
    for values in ({"jpeg_quality": "best"}, {"png_level": True}, {"format": 3}, {"jpeg_optimize": 1}):
        with pytest.raises(CodecError, match="the parameter"):
            settings_of(values)


@pytest.mark.parametrize(
    ("words", "status", "text"),
    [
        ([], 0, "Usage: republish in_transport in:=<in_base_topic> [out_transport]"),
        (["raw", "raw", "raw"], 1, "Usage: republish"),
        (["theora"], 1, "ERROR: Unable to load plugin for transport 'theora': there is raw, compressed"),
        (["raw", "foo"], 1, "transport 'foo'"),
    ],
)
def test_wrong_words_are_refused(words: list[str], status: int, text: str) -> None:
    done = subprocess.run(
        [sys.executable, str(PROGRAM), *words], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == status
    assert text in done.stdout + done.stderr
    assert "Traceback" not in done.stderr


def test_missing_library_is_logged_before_any_image(master: str) -> None:
    code = (
        "import runpy, sys; sys.modules['cv2'] = sys.modules['PIL'] = None; from minirospy import client; "
        "client.spin = lambda: None; sys.argv = ['republish', 'raw', 'compressed']; "
        f"runpy.run_path({str(PROGRAM)!r}, run_name='__main__')"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    assert (
        done.stderr.count(f"compressed images need OpenCV or Pillow: {install_command('minirospy[images]')}")
        == 1
    )
    assert "Traceback" not in done.stderr


def test_list_of_transports() -> None:
    done = subprocess.run(
        [str(Path(sys.executable).with_name("rosrun")), "image_transport", "list_transports"],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert done.stdout.startswith("Declared transports:\nimage_transport/raw\nimage_transport/compressed\n")


USER = """
import subprocess, sys
import rospy
from sensor_msgs.msg import CompressedImage, Image
rospy.init_node("user")
rospy.set_param("/jpeg/compressed", {"format": "png"})
program = [sys.executable, sys.argv[1]]
chain = [
    ["raw", "in:=/camera", "out:=/jpeg"],
    ["compressed", "in:=/jpeg", "raw", "out:=/again"],
    ["raw", "in:=/again", "raw", "out:=/last"],
]
nodes = [subprocess.Popen(program + words) for words in chain]
try:
    rospy.set_param("/kept", True)
    publisher = rospy.Publisher("/camera", Image, queue_size=1)
    got, kinds = [], set()
    rospy.Subscriber("/last", Image, got.append)
    rospy.Subscriber("/jpeg/compressed", CompressedImage, lambda message: kinds.add(message.format))
    rate = rospy.Rate(20)
    sent = Image(height=2, width=2, encoding="rgb8", step=6, data=bytes(range(12)))
    sent.header.frame_id = "camera"
    while not (got and kinds):
        publisher.publish(sent)
        rate.sleep()
    print(got[0].encoding, got[0].header.frame_id, list(got[0].data) == list(range(12)), got[0].header.seq > 0)
    print(sorted(kinds))
    print(sorted(each for each in rospy.get_published_topics("/jpeg")))
    print(got[0]._connection_header["type"])
finally:
    for node in nodes:
        node.terminate()
    for node in nodes:
        node.wait()
"""


def test_images_go_there_and_back_through_nodes(master: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", USER, str(PROGRAM)], capture_output=True, text=True, timeout=100, check=False
    )
    assert done.stdout.splitlines() == [
        "rgb8 camera True True",
        "['rgb8; png compressed bgr8']",
        "[['/jpeg/compressed', 'sensor_msgs/CompressedImage'], ['/jpeg/compressedDepth', 'sensor_msgs/CompressedImage']]",
        "sensor_msgs/Image",
    ], done.stderr
