"""The display DepthCloud in the 3D view: a depth image as colored points at the positions that image_geometry computes."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Sequence
from typing import Any

import pytest
from geometry_msgs.msg import Quaternion
from image_geometry import PinholeCameraModel
from rospy import Time
from sensor_msgs.msg import CameraInfo, Image, RegionOfInterest
from tf2_msgs.msg import TFMessage

from tests.interop import robot_scene
from tests.interop.browser import Page
from tests.interop.page_modules import needs_node, run_script
from tests.interop.rviz_pictures import depth_camera
from tests.interop.test_interop_dashboard import address, browse, needs_chromium
from tests.interop.test_interop_dashboard_3d import Serve, publish, status
from tests.web.dashboard.conftest import serve

__all__ = ["browse", "serve"]

K = [160.0, 0.0, 79.0, 0.0, 150.0, 61.0, 0.0, 0.0, 1.0]


def info_of(width: int, height: int, **fields: Any) -> CameraInfo:
    found: CameraInfo = robot_scene.stamped(CameraInfo, "lens", width=width, height=height)
    found.K, found.R = K, [1, 0, 0, 0, 1, 0, 0, 0, 1]
    found.P = [*K[:3], 0, *K[3:6], 0, *K[6:], 0]
    for name, value in fields.items():
        setattr(found, name, value)
    return found


def image_of(
    width: int, height: int, encoding: str, values: Sequence[float], *, is_big: bool = False
) -> Image:
    kind = {"16UC1": "H", "32FC1": "f"}[encoding]
    data = struct.pack(f"{'>' if is_big else '<'}{width * height}{kind}", *values)
    step = len(data) // height
    return Image(width=width, height=height, encoding=encoding, is_bigendian=is_big, step=step, data=data)


def points_of(image: Image, info: CameraInfo, stride: int = 1, colors: bytes | None = None) -> Any:
    """Return the points that the page computes, with their colors, or the error's text."""
    roi = {name: getattr(info.roi, name) for name in ("x_offset", "y_offset", "width", "height")}
    names = ("width", "height", "K", "binning_x", "binning_y")
    fields = {name: getattr(info, name) for name in names} | {"K": [*info.K], "roi": roi}
    pixels = {name: getattr(image, name) for name in ("width", "height", "encoding", "step")}
    body = f"""
        const image = {{...{json.dumps(pixels)}, is_bigendian: {json.dumps(bool(image.is_bigendian))}}};
        image.data = Uint8Array.from({json.dumps([*image.data])});
        const rgba = {json.dumps([*colors] if colors else None)};
        try {{
          const lens = lensOf({json.dumps(fields)}, image);
          const {{count, total, positions, channels}} = pointsOfDepth(image, lens, rgba, {stride});
          const rgb = channels.get("rgb") ?? [];
          const points = [...Array(count).keys()].map((index) => [...positions.slice(3 * index, 3 * index + 3)]);
          return {{points, total, rgb: [...rgb]}};
        }} catch (error) {{ return error.message; }}"""
    return run_script("lensOf, pointsOfDepth", "js/scene/depth.js", body)


@needs_node
@pytest.mark.parametrize("is_big", [False, True])
@pytest.mark.parametrize(("encoding", "unit"), [("16UC1", 1000), ("32FC1", 1)])
def test_points_are_where_image_geometry_has_the_pixels(encoding: str, unit: int, is_big: bool) -> None:
    info = info_of(4, 3)
    depths = [1.0 + index / 8 for index in range(12)]
    values = [depth * unit for depth in depths]
    whole = [round(value) for value in values] if unit == 1000 else values
    found = points_of(image_of(4, 3, encoding, whole, is_big=is_big), info)
    model = PinholeCameraModel()
    model.fromCameraInfo(info)
    assert found["total"] == 12
    for index, point in enumerate(found["points"]):
        assert point[2] == pytest.approx(depths[index])
        assert model.project3dToPixel(point) == pytest.approx((index % 4, index // 4), abs=1e-4)


@needs_node
def test_pixels_without_a_depth_are_left_out() -> None:
    nan, infinity = float("nan"), float("inf")
    found = points_of(image_of(3, 2, "32FC1", [nan, 1.0, infinity, 0.0, -1.0, 2.0]), info_of(3, 2))
    assert [point[2] for point in found["points"]] == [1.0, 2.0]
    assert points_of(image_of(2, 1, "16UC1", [0, 500]), info_of(2, 1))["points"][0][2] == pytest.approx(0.5)


@needs_node
def test_points_have_the_colors_of_their_pixels() -> None:
    colors = bytes(part for pixel in range(4) for part in (pixel, 10 + pixel, 20 + pixel, 255))
    found = points_of(image_of(4, 1, "16UC1", [1, 0, 1, 1]), info_of(4, 1), colors=colors)
    assert found["rgb"] == [0x000A14, 0x020C16, 0x030D17]
    assert points_of(image_of(4, 1, "16UC1", [1, 1, 1, 1]), info_of(4, 1), 3, colors)["rgb"] == [
        0x000A14,
        0x030D17,
    ]


@needs_node
def test_binned_part_of_a_camera_is_where_the_whole_picture_has_it() -> None:
    part = info_of(160, 120, binning_x=2, binning_y=2)
    part.roi = RegionOfInterest(x_offset=80, y_offset=60, width=8, height=4)
    (point, *_) = points_of(image_of(4, 2, "32FC1", [2.0] * 8), part)["points"]
    whole = PinholeCameraModel()
    whole.fromCameraInfo(info_of(160, 120))
    assert whole.project3dToPixel(point) == pytest.approx((80, 60), abs=1e-4)


@needs_node
@pytest.mark.parametrize(
    ("info", "error"),
    [
        (info_of(5, 3), "Depth image size and camera info don't match: 4 x 3 vs 5 x 3"),
        (info_of(4, 3, K=[0.0] * 9), "the camera is not calibrated: K of its CameraInfo has no focal length"),
    ],
)
def test_info_that_does_not_fit_is_refused(info: CameraInfo, error: str) -> None:
    assert points_of(image_of(4, 3, "32FC1", [1.0] * 12), info) == error


@needs_node
def test_image_without_depths_is_refused() -> None:
    image = Image(width=1, height=1, encoding="rgb8", step=3, data=b"123")
    assert points_of(image, info_of(1, 1)).startswith("Depth image has invalid format")
    short = image_of(4, 3, "32FC1", [1.0] * 12)
    short.data = short.data[:-1]
    assert points_of(short, info_of(4, 3)) == "the image has 47 bytes, 32FC1 of 4 x 3 needs 48"


@needs_chromium
@pytest.mark.timeout(400)
def test_depth_image_is_seen_as_points(serve: Serve, browse: Callable[..., Page]) -> None:
    served = serve()
    scene = depth_camera()
    info = scene.pop("/depth/camera_info")
    red = scene.pop("/color/image")
    lens = robot_scene.transform("map", "lens", 0, 0, 1)
    lens.transform.rotation = Quaternion(-0.5, 0.5, -0.5, 0.5)
    send = publish(served, {**scene, "/tf_static": TFMessage([lens])})
    page = browse(address(served, "3d"))
    page.choose("select[aria-label='Add a display']", "DepthCloud")
    page.wait_text(".display", "DepthCloud")
    row = "[data-name='DepthCloud'] "
    page.type(row + "[aria-label='Depth Map Topic'] input", "/depth/image")
    page.evaluate("document.activeElement.dispatchEvent(new Event('change'))")
    status(page, "DepthCloud", "No CameraInfo received on [/depth/camera_info]")
    send("/depth/camera_info", info)
    count = sum(depth > 0 for depth in struct.unpack("<4800H", scene["/depth/image"].data))
    status(page, "DepthCloud", f"Showing {count} points from 4800")
    page.wait(
        "const e = [...document.querySelectorAll('.display')].find(e => e.dataset.name === 'DepthCloud');"
        "return e.dataset.level === 'ok'"
    )

    page.type(row + "[aria-label='Color Image Topic'] input", "/color/image")
    page.evaluate("document.activeElement.dispatchEvent(new Event('change'))")
    status(page, "DepthCloud", "No image received on [/color/image]")
    send("/color/image", red)
    status(page, "DepthCloud", f"Showing {count} points from 4800")
    # Use a picture of another size with the next stamp; either message may arrive first.
    red.height //= 2
    for topic, message in (("/color/image", red), ("/depth/image", scene["/depth/image"])):
        message.header.stamp = Time(101, 0)
        send(topic, message)
    status(page, "DepthCloud", "Depth image resolution (80x60) does not match color image resolution (80x30)")
    assert not page.errors
