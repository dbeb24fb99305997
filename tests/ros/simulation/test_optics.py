"""The description of a camera, and encodings of pictures."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest

from minirospy.base.xml_text import parse_xml
from minirospy.core.sdf.model import IDENTITY
from minirospy.ros.gazebo_plugins.optics import (
    Optics,
    add_noise,
    encode,
    encoding_of,
    read_optics,
    to_camera_info,
)

PICTURE = np.array([[[1, 2, 3], [4, 5, 6]], [[7, 8, 9], [10, 11, 12]]], np.uint8)


def test_camera_elements_have_sdf_defaults() -> None:
    assert read_optics(None) == read_optics(parse_xml("<camera/>")) == Optics()
    camera = parse_xml(
        """<camera name="left"><pose>0 0.1 0 0 0 1</pose><horizontal_fov>1.5</horizontal_fov>
        <image><width>64</width><height>48</height><format>L8</format></image>
        <clip><near>0.05</near><far>8</far></clip><noise><type>gaussian</type><stddev>0.007</stddev></noise>
        <distortion><k1>0.1</k1><p2>0.2</p2></distortion></camera>"""
    )
    optics = read_optics(camera)
    assert (optics.name, optics.width, optics.height, optics.format) == ("left", 64, 48, "L8")
    assert (optics.near, optics.far, optics.noise_deviation) == (0.05, 8.0, 0.007)
    assert optics.distortion == (0.1, 0.0, 0.0, 0.2, 0.0)
    assert optics.pose.position == (0.0, 0.1, 0.0)
    assert optics.pose != IDENTITY


def test_camera_info_follows_the_field_of_view() -> None:
    optics = Optics(width=640, height=480, horizontal_fov=math.radians(90))
    info = to_camera_info(optics, lambda _tag, default: default, automatic=False, baseline=0.07)

    # A quarter turn: the focal length is half the width.
    assert pytest.approx([320, 0, 320.5, 0, 320, 240.5, 0, 0, 1]) == info.K
    assert pytest.approx([320, 0, 320.5, -320 * 0.07, 0, 320, 240.5, 0, 0, 0, 1, 0]) == info.P
    assert (info.width, info.height, info.distortion_model, list(info.D)) == (
        640,
        480,
        "plumb_bob",
        [0.0] * 5,
    )


def test_parameters_replace_the_computed_camera_info() -> None:
    values = {"focalLength": 100.0, "Cx": 3.0, "Cy": 4.0, "distortionK1": 0.1, "distortionK3": 0.5}
    optics = Optics(distortion=(1.0, 2.0, 3.0, 4.0, 5.0))
    info = to_camera_info(optics, values.get, automatic=False, baseline=0)
    assert (info.K[0], info.K[2], info.K[5]) == (100.0, 3.0, 4.0)
    assert list(info.D) == [0.1, 0.0, 0.0, 0.0, 0.5]
    info = to_camera_info(optics, lambda _tag, default: default, automatic=True, baseline=0)
    assert list(info.D) == [1.0, 2.0, 3.0, 4.0, 5.0]


@pytest.mark.parametrize(
    ("image_format", "encoding", "data", "step"),
    [
        ("R8G8B8", "rgb8", bytes(range(1, 13)), 6),
        ("B8G8R8", "bgr8", bytes([3, 2, 1, 6, 5, 4, 9, 8, 7, 12, 11, 10]), 6),
        ("L8", "mono8", bytes([2, 5, 8, 11]), 2),
        ("L16", "mono16", struct.pack("<4H", 514, 1285, 2056, 2827), 4),
        ("BAYER_RGGB8", "bayer_rggb8", bytes([1, 5, 8, 12]), 2),
        ("BAYER_GBRG8", "bayer_gbrg8", bytes([2, 6, 7, 11]), 2),
    ],
)
def test_pictures_have_the_sensors_format(image_format: str, encoding: str, data: bytes, step: int) -> None:
    assert encoding_of(image_format) == (encoding, True)
    assert encode(PICTURE, encoding) == (data, step)


def test_an_unknown_format_is_bgr8() -> None:
    assert encoding_of("FANCY") == ("bgr8", False)


def test_noise_has_the_deviation_of_the_sensor() -> None:
    grey = np.full((100, 100, 3), 128, np.uint8)
    noisy = add_noise(grey, Optics(noise_deviation=0.05), np.random.default_rng(0))
    assert noisy[:, :, 0].std() == pytest.approx(0.05 * 255, rel=0.05)
    assert noisy.mean() == pytest.approx(127.5, abs=1)
    assert add_noise(grey, Optics(), np.random.default_rng(0)) is grey
