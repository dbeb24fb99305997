"""The display Camera of the 3D view: objects at the right pixels, and the camera's picture behind and over them."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from image_geometry import PinholeCameraModel
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import ColorRGBA
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker

from tests.interop import robot_scene
from tests.interop.browser import Page
from tests.interop.page_modules import needs_node, run_script
from tests.interop.test_interop_dashboard import address, browse, needs_chromium
from tests.interop.test_interop_dashboard_3d import Serve, publish, status
from tests.web.dashboard.conftest import serve

__all__ = ["browse", "serve"]

WIDTH, HEIGHT = 160, 120
FAR = 2.0  # distance in metres from the camera to the front of the cube


def camera_info(**fields: Any) -> CameraInfo:
    found: CameraInfo = robot_scene.stamped(CameraInfo, "lens", width=WIDTH, height=HEIGHT)
    found.K = [160, 0, 80, 0, 160, 60, 0, 0, 1]
    found.R = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    found.P = [160, 0, 80, 0, 0, 160, 60, 0, 0, 0, 1, 0]
    for name, value in fields.items():
        setattr(found, name, value)
    return found


def projected(info: CameraInfo, point: tuple[float, float, float], zoom: float = 1) -> Any:
    """Return the pixel at which the page draws a point in the camera's frame, or the error's text."""
    body = f"""
        const info = {json.dumps({"width": info.width, "height": info.height, "P": [*info.P]})};
        try {{
          const {{matrix: m, offset}} = projectionOf(info, {zoom});
          // The camera's z is forward and its y down; pictures have z backward and y up.
          const [x, y, z] = {json.dumps(point)}.map((part, index) => (part - offset[index]) * [1, -1, -1][index]);
          const at = [0, 1, 2, 3].map((row) => m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]);
          return [(at[0] / at[3] + 1) / 2 * info.width, (1 - at[1] / at[3]) / 2 * info.height];
        }} catch (error) {{ return error.message; }}"""
    return run_script("projectionOf", "js/scene/projection.js", body)


@needs_node
@pytest.mark.parametrize(
    "p",
    [
        [160, 0, 80, 0, 0, 160, 60, 0, 0, 0, 1, 0],
        [120, 0, 70, 0, 0, 200, 66, 0, 0, 0, 1, 0],
        # This is the right camera of a stereo pair.
        [160, 0, 80, -16, 0, 160, 60, 8, 0, 0, 1, 0],
    ],
)
def test_projection_is_that_of_image_geometry(p: list[float]) -> None:
    info = camera_info(P=p)
    model = PinholeCameraModel()
    model.fromCameraInfo(info)
    for point in ((0.0, 0.0, 2.0), (0.5, -0.25, 3.0), (-1.0, 0.5, 2.5)):
        assert projected(info, point) == pytest.approx(model.project3dToPixel(point), abs=1e-6)


@needs_node
def test_zoom_is_around_the_middle() -> None:
    assert projected(camera_info(), (0.25, 0, 2), zoom=2) == pytest.approx([120, 60])


@needs_node
@pytest.mark.parametrize(
    ("fields", "error"),
    [
        ({"P": [0] * 12}, "the camera is not calibrated: P of its CameraInfo has no focal length"),
        ({"P": [0] * 12, "width": 0}, "Could not determine width/height of image"),
    ],
)
def test_info_that_cannot_be_used_is_refused(fields: dict[str, Any], error: str) -> None:
    assert projected(camera_info(**fields), (0, 0, 1)).startswith(error)


@needs_node
def test_info_is_next_to_the_image() -> None:
    body = "return ['/a/b/image_raw', '/image'].map(infoTopicOf);"
    assert run_script("infoTopicOf", "js/scene/projection.js", body) == ["/a/b/camera_info", "/camera_info"]


def scene() -> dict[str, Any]:
    """Return a camera that looks along x, a red cube in front of it, and the camera's image, which is blue."""
    lens = robot_scene.transform("map", "lens", 0, 0, 1)
    lens.transform.rotation = Quaternion(-0.5, 0.5, -0.5, 0.5)
    cube = Marker(type=Marker.CUBE, scale=Vector3(1, 1, 1), color=ColorRGBA(1, 0, 0, 1))
    cube.header.frame_id = "map"
    # The right half of the cube covers the left quarter of the camera's image.
    cube.pose = Pose(Point(FAR + 0.5, 0.5, 1), Quaternion(0, 0, 0, 1))
    blue = robot_scene.stamped(Image, "lens", width=WIDTH, height=HEIGHT, encoding="rgb8", step=3 * WIDTH)
    # The upper half is darker.
    blue.data = bytes((0, 0, 100)) * (WIDTH * HEIGHT // 2) + bytes((0, 0, 200)) * (WIDTH * HEIGHT // 2)
    dock = robot_scene.transform("map", "dock", FAR, -0.3, 1.2)
    return {"/tf_static": TFMessage([lens, dock]), "/cube": cube, "/lens/image": blue}


def color(page: Page, x: float, y: float) -> list[int]:
    """Return the color in the camera's view at a position, from 0 to 1 from left to right and from top to bottom."""
    found: list[int] = page.evaluate(
        "(() => { const c = document.querySelector('canvas.inset');"
        f"return [...c.getContext('2d').getImageData(c.width * {x}, c.height * {y}, 1, 1).data].slice(0, 3) }})()"
    )
    return found


@needs_chromium
def test_scene_is_seen_through_the_camera(serve: Serve, browse: Callable[..., Page]) -> None:
    served = serve()
    send = publish(served, scene())
    page = browse(address(served, "3d"))
    status(page, "Marker /cube", "1 markers")
    # Grid and axes would cover the colors.
    for name in ("Grid", "TF"):
        page.click(f"[data-name='{name}'] input[type=checkbox]")
    page.evaluate(
        "document.querySelector('select[aria-label=\"Add a display\"]').dispatchEvent(new Event('focus'))"
    )
    page.choose("select[aria-label='Add a display']", "Camera")
    page.wait_text(".display", "Camera")
    page.type("[data-name='Camera'] [aria-label='Image Topic'] input", "/lens/image")
    page.evaluate("document.activeElement.dispatchEvent(new Event('change'))")
    status(page, "Camera", "No CameraInfo received on [/lens/camera_info]. Topic may not exist.")
    send("/lens/camera_info", camera_info())
    status(page, "Camera", "Camera Info: OK")
    # Wait until the cube and the picture next to it are drawn.
    page.wait(
        "const c = document.querySelector('canvas.inset'); if (c.hidden || c.width <= 100) return false;"
        "const at = (x, y) => c.getContext('2d').getImageData(c.width * x, c.height * y, 1, 1).data;"
        "return at(0.1, 0.5)[0] > 60 && Math.abs(at(0.9, 0.25)[2] - 100) <= 3 && at(0.52, 0.6)[0] < 5"
    )

    # The cube's front ends at the middle of the image. It is a metre wide at a distance of two metres, so 80 of 160
    # pixels.
    side, outside = color(page, 0.1, 0.5), color(page, 0.9, 0.25)
    assert side[0] > 60, side
    assert side[2] in range(40, 110), side
    assert outside == pytest.approx([0, 0, 100], abs=3)
    assert color(page, 0.9, 0.75) == pytest.approx([0, 0, 200], abs=3)
    assert color(page, 0.48, 0.6)[0] > 60
    assert color(page, 0.52, 0.6)[0] < 5

    # Draw the picture opaquely over the scene.
    page.type("[data-name='Camera'] input[aria-label='Overlay Alpha']", "1")
    page.evaluate("document.activeElement.dispatchEvent(new Event('change'))")
    page.wait(
        "const c = document.querySelector('canvas.inset');"
        "const d = c.getContext('2d').getImageData(c.width * 0.1, c.height * 0.6, 1, 1).data;"
        "return d[0] < 5 && Math.abs(d[2] - 200) < 5"
    )
    small = page.evaluate("document.querySelector('canvas.inset').width")
    page.click("canvas.inset")
    page.wait(f"return document.querySelector('canvas.inset').width > {small} * 1.5")
    # Frames are labelled with their names: this label is right of and above the middle.
    count = (
        "(() => { const c = document.querySelector('canvas.inset'), w = c.width, h = c.height;"
        "const d = c.getContext('2d').getImageData(0.65 * w, 0.34 * h, 0.3 * w, 0.16 * h).data;"
        "let n = 0; for (let i = 0; i < d.length; i += 4) n += Math.min(d[i], d[i + 1], d[i + 2]) > 200; return n; })()"
    )
    assert page.evaluate(count) == 0
    page.click("[data-name='TF'] input[type=checkbox]")
    page.wait(f"return {count} > 20")
    send("/lens/camera_info", camera_info(P=[0] * 12))
    status(page, "Camera", "the camera is not calibrated")
    page.click("[data-name='Camera'] input[type=checkbox]")
    page.wait("return !document.querySelector('canvas.inset')")
