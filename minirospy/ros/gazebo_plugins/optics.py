"""The ``<camera>`` of a sensor, its camera_info, and the encodings of pictures."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo

from minirospy.base.xml_text import XmlElement
from minirospy.core.sdf.model import IDENTITY, Pose
from minirospy.core.sdf.poses import pose_from_rpy
from minirospy.ros.gazebo_ros.parameters import number_of, numbers_of, text_of

__all__ = ["Optics", "add_noise", "encode", "encoding_of", "read_optics", "to_camera_info"]

Picture = NDArray[np.uint8]

ENCODINGS = {
    "L8": "mono8",
    "L_INT8": "mono8",
    "L16": "mono16",
    "L_INT16": "mono16",
    "R8G8B8": "rgb8",
    "RGB_INT8": "rgb8",
    "B8G8R8": "bgr8",
    "BGR_INT8": "bgr8",
    "R16G16B16": "rgb16",
    "RGB_INT16": "rgb16",
    "BAYER_RGGB8": "bayer_rggb8",
    "BAYER_BGGR8": "bayer_bggr8",
    "BAYER_GBRG8": "bayer_gbrg8",
    "BAYER_GRBG8": "bayer_grbg8",
}
_UNKNOWN_ENCODING = "bgr8"


@dataclass(frozen=True)
class Optics:
    """A camera that looks along its x axis. ``pose`` is in the sensor's frame; near and far limit the rendered depths, in m."""

    name: str = ""
    pose: Pose = IDENTITY
    width: int = 320
    height: int = 240
    format: str = "R8G8B8"
    horizontal_fov: float = 1.047  # rad
    near: float = 0.1
    far: float = 100.0
    noise_mean: float = 0.0  # relative to the maximum brightness, which is 1
    noise_deviation: float = 0.0
    distortion: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)  # k1, k2, p1, p2, k3

    @property
    def focal_length(self) -> float:
        """Return the focal length in pixels."""
        return self.width / (2 * math.tan(self.horizontal_fov / 2))


def read_optics(camera: XmlElement | None) -> Optics:
    """Read ``<camera>``. Raise PluginError if a value is invalid."""
    if camera is None:
        return Optics()
    image, clip = camera.first("image"), camera.first("clip")
    noise, lens = camera.first("noise"), camera.first("distortion")
    kind = text_of(noise, "type") or (noise.attributes.get("type", "") if noise is not None else "")
    is_noisy = kind in ("gaussian", "gaussian_quantized")
    return Optics(
        camera.attributes.get("name", ""),
        _pose(camera),
        int(number_of(image, "width", 320)),
        int(number_of(image, "height", 240)),
        text_of(image, "format") or "R8G8B8",
        number_of(camera, "horizontal_fov", 1.047),
        number_of(clip, "near", 0.1),
        number_of(clip, "far", 100.0),
        number_of(noise, "mean", 0.0) if is_noisy else 0.0,
        number_of(noise, "stddev", 0.0) if is_noisy else 0.0,
        tuple(number_of(lens, tag, 0.0) for tag in ("k1", "k2", "p1", "p2", "k3")),
    )


def to_camera_info(
    optics: Optics, number: Callable[[str, float], float], *, automatic: bool, baseline: float
) -> CameraInfo:
    """Return a CameraInfo without a header.

    number: returns a plugin's parameter or a default. automatic: whether to use the sensor's distortion. baseline: the distance
    from the left camera in m.
    """
    focal = number("focalLength", 0.0) or optics.focal_length
    cx = number("Cx", 0.0) or (optics.width + 1) / 2
    cy = number("Cy", 0.0) or (optics.height + 1) / 2
    info = CameraInfo(height=optics.height, width=optics.width, distortion_model="plumb_bob")
    tags = ("distortionK1", "distortionK2", "distortionT1", "distortionT2", "distortionK3")
    info.D = list(optics.distortion) if automatic else [number(tag, 0.0) for tag in tags]
    info.K = [focal, 0.0, cx, 0.0, focal, cy, 0.0, 0.0, 1.0]
    info.R = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    info.P = [focal, 0.0, cx, -focal * baseline, 0.0, focal, cy, 0.0, 0.0, 0.0, 1.0, 0.0]
    return info


def encoding_of(image_format: str) -> tuple[str, bool]:
    """Return the sensor_msgs encoding for an SDF image format, and whether the format is known."""
    return ENCODINGS.get(image_format, _UNKNOWN_ENCODING), image_format in ENCODINGS


def encode(picture: Picture, encoding: str) -> tuple[bytes, int]:
    """Encode an RGB picture; return the data and the number of bytes per row."""
    pixels: NDArray[np.uint8] | NDArray[np.uint16] = picture
    if encoding.startswith("mono"):
        pixels = (picture @ np.array([0.299, 0.587, 0.114]) + 0.5).astype(np.uint8)
    elif encoding == "bgr8":
        pixels = picture[:, :, ::-1]
    elif encoding.startswith("bayer"):
        pixels = np.empty(picture.shape[:2], np.uint8)
        for index, letter in enumerate(encoding[6:10]):
            row, column = divmod(index, 2)
            pixels[row::2, column::2] = picture[row::2, column::2, "rgb".index(letter)]
    if encoding.endswith("16"):
        pixels = pixels.astype("<u2") * np.uint16(257)
    return pixels.tobytes(), pixels[0].nbytes


def add_noise(picture: Picture, optics: Optics, random: np.random.Generator) -> Picture:
    """Return a picture with camera noise added."""
    if optics.noise_deviation <= 0 and optics.noise_mean == 0:
        return picture
    size = picture.shape[:2]
    noise = 255 * (
        optics.noise_deviation * random.standard_normal(size, np.float32) + np.float32(optics.noise_mean)
    )
    noisy: Picture = np.clip(picture + noise[:, :, None], 0, 255).astype(np.uint8)
    return noisy


def _pose(camera: XmlElement) -> Pose:
    values = numbers_of(camera, "pose", (6,))
    if not values:
        return IDENTITY
    x, y, z, roll, pitch, yaw = values
    return pose_from_rpy((x, y, z), (roll, pitch, yaw))
