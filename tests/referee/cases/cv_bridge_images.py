"""cv_bridge: conversion of messages to images and back, in every encoding, and refused ones."""

import hashlib

import numpy as np
from cv_bridge import CvBridge, CvBridgeError, getCvType
from referee import outcome, show
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

bridge = CvBridge()
COLORS = ["mono8", "bgr8", "rgb8", "bgra8", "rgba8", "mono16", "bgr16", "rgb16", "bgra16", "rgba16"]
GENERIC = [
    "8UC1",
    "8UC2",
    "8UC3",
    "8UC4",
    "8SC1",
    "8SC3",
    "16UC1",
    "16UC3",
    "16SC1",
    "16SC4",
    "32SC1",
    "32SC2",
    "32FC1",
    "32FC3",
    "64FC1",
    "64FC4",
    "8UC5",
    "8U",
    "32F",
]
WRONG = ["8UC", "9UC1", "8FC1", "foo", "BGR8", "nv21", ""]


def pixels(encoding, big=False, width=7, height=5):
    """Return a message with the same random pixels each time, including the extreme values."""
    dtype, channels = bridge.encoding_to_dtype_with_channels(encoding)
    dtype = np.dtype(dtype)
    state = (
        np.arange(1, width * height * channels + 1, dtype=np.uint64)
        * np.uint64(2654435761)
        % np.uint64(2**32)
    )
    if dtype.kind == "f":
        values = (state / 2**32 - 0.5) * 200000
        values[:6] = [0.5, 1.5, -2.5, 254.5, 1e20, -1e20]
    else:
        info = np.iinfo(dtype)
        values = state % np.uint64(int(info.max) - int(info.min) + 1)
        values = values.astype(np.int64) + int(info.min)
        values[:2] = [info.min, info.max]
    array = values.astype(dtype.newbyteorder(">" if big else "<"))
    data = array.tobytes()
    return Image(
        height=height, width=width, encoding=encoding, is_bigendian=big, step=len(data) // height, data=data
    )


def summary(image):
    native = image.astype(image.dtype.newbyteorder("="))
    return image.shape, image.dtype.name, hashlib.md5(native.tobytes()).hexdigest()[:8]


def attempt(call):
    try:
        return call()
    except CvBridgeError as error:
        return f"refused: {error}"


for encoding in COLORS + GENERIC + ["yuv422", "bayer_rggb8", "bayer_gbrg16"]:
    show(
        encoding,
        getCvType(encoding),
        bridge.encoding_to_cvtype2(encoding),
        bridge.encoding_to_dtype_with_channels(encoding),
    )
    for big in (False, True):
        image = bridge.imgmsg_to_cv2(pixels(encoding, big))
        show(encoding, big, summary(image), image.dtype.isnative, big or image.flags.writeable)
for encoding in WRONG:
    outcome(encoding, lambda: getCvType(encoding))
    outcome(encoding, lambda: bridge.encoding_to_cvtype2(encoding))
    outcome(encoding, lambda: bridge.imgmsg_to_cv2(Image(height=1, width=1, encoding=encoding, data=b"1234")))

for source in COLORS + GENERIC[:16] + ["bayer_rggb8", "yuv422"]:
    texts = []
    for wanted in [*COLORS, *GENERIC[:16], "bayer_gbrg16", "yuv422", "foo", ""]:
        if source[:2] in ("ba", "yu") and wanted in COLORS:
            continue
        found = attempt(lambda: summary(bridge.imgmsg_to_cv2(pixels(source), wanted)))
        texts.append(f"{wanted} {found}")
    show(source, len(texts), texts[0], texts[-7], texts[-2], hashlib.md5("".join(texts).encode()).hexdigest())

for encoding in COLORS + GENERIC[:16]:
    image = bridge.imgmsg_to_cv2(pixels(encoding))
    for wanted in ("passthrough", encoding, "bgr8", "8UC1", "foo"):

        def message(wanted=wanted):
            made = bridge.cv2_to_imgmsg(image, wanted, header=Header(frame_id="camera"))
            text = hashlib.md5(made.data).hexdigest()[:8]
            return (
                made.height,
                made.width,
                made.encoding,
                made.is_bigendian,
                made.step,
                made.header.frame_id,
                text,
            )

        show(encoding, "to", wanted, attempt(message))
big = np.arange(6, dtype=">u2").reshape(2, 3)
made = bridge.cv2_to_imgmsg(big)
show(made.encoding, made.is_bigendian, made.step, made.data, bridge.imgmsg_to_cv2(made).tolist())
made = bridge.cv2_to_imgmsg(np.arange(24, dtype=np.uint8).reshape(4, 6)[::2, ::3])
show(made.height, made.width, made.step, made.data)
show(
    bridge.cv2_to_imgmsg(np.zeros((2, 3, 1), np.uint8)).encoding,
    bridge.cv2_to_imgmsg(np.zeros((2, 3, 1), np.uint8), "mono8").step,
)
outcome("no array", lambda: bridge.cv2_to_imgmsg([[1, 2]]))
outcome("no array", lambda: bridge.cv2_to_compressed_imgmsg([[1, 2]]))
show(issubclass(CvBridgeError, TypeError), sorted(bridge.cvtype_to_name.items()))
show(bridge.cvdepth_to_numpy_depth, sorted(bridge.numpy_type_to_cvtype.items()))
show(bridge.dtype_with_channels_to_cvtype2(np.dtype("f4"), 3), bridge.cvtype2_to_dtype_with_channels(21))

# Compressed: lossless formats give the same pixels, in OpenCV's order.
for encoding in ("mono8", "bgr8", "bgra8", "mono16"):
    image = bridge.imgmsg_to_cv2(pixels(encoding))
    for format in ("png", "bmp", "tiff", "jpg", "jpeg"):
        if format not in ("png", "tiff") and encoding in ("bgra8", "mono16"):
            continue
        made = bridge.cv2_to_compressed_imgmsg(image, format)
        back = bridge.compressed_imgmsg_to_cv2(made)
        exact = format not in ("jpg", "jpeg")
        show(encoding, made.format, back.shape, back.dtype, (back == image).all() if exact else "")
image = np.full((16, 16, 3), (200, 100, 50), np.uint8)
made = bridge.cv2_to_compressed_imgmsg(image)
back = bridge.compressed_imgmsg_to_cv2(made)
show(made.format, bytes(made.data[:2]), back.shape, np.abs(back.astype(int) - image).max() < 4)
made = bridge.cv2_to_compressed_imgmsg(image, "png")
for wanted in ("bgr8", "rgb8", "mono8", "bgra8", "mono16", "8UC3"):
    show(wanted, attempt(lambda: summary(bridge.compressed_imgmsg_to_cv2(made, wanted))))
outcome("a wrong encoding", lambda: bridge.compressed_imgmsg_to_cv2(made, "foo"))
