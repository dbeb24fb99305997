"""The 3D view of the dashboard in Debian's chromium, operated as by a user; WebGL is rendered in software."""

from __future__ import annotations

import base64
import io
import struct
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import PointStamped, PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from PIL import Image
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from minirospy.web.dashboard.rviz_file import parse_rviz
from tests.interop import robot_scene, rviz_pictures
from tests.interop.browser import PATIENCE, Page
from tests.interop.test_interop_dashboard import address, browse, needs_chromium, publisher
from tests.web.dashboard.conftest import Served, serve

__all__ = ["browse", "serve"]

# Software rendering takes seconds on a busy machine.
pytestmark = needs_chromium

Browse = Callable[..., Page]
Serve = Callable[..., Served]


def publish(served: Served, messages: dict[str, Any]) -> Callable[[str, Any], None]:
    """Publish latched messages, given by topic; return a function that publishes more."""
    node = served.node("robot")
    publishers: dict[str, Any] = {}

    def send(topic: str, message: Any) -> None:
        async def run() -> None:
            if topic not in publishers:
                publishers[topic] = await node.advertise(topic, type(message), latch=True)
            await publishers[topic].publish(message)

        served.run(run())

    for topic, message in messages.items():
        send(topic, message)
    return send


class Listener:
    """A subscriber to a topic."""

    def __init__(self, served: Served, topic: str, cls: type) -> None:
        node = served.node("listener" + topic.replace("/", "_"))

        async def subscribe() -> Any:
            return await node.subscribe(topic, cls)

        self._served = served
        self._subscription = served.run(subscribe())

    def connected(self) -> None:
        """Wait until the page's publisher is connected."""
        self._served.run(self._subscription.wait_for_publishers(timeout=PATIENCE))

    def next(self) -> Any:
        return self._served.run(self._subscription.next(PATIENCE))


def drawn(page: Page) -> int:
    """Wait until a picture is drawn; return the number of pictures."""
    return int(page.wait("return Number(document.querySelector('canvas.stage')?.dataset.drawn) || 0"))


def status(page: Page, name: str, text: str) -> None:
    """Expand a display, and wait until its status has this text."""
    page.wait(
        f"const d = [...document.querySelectorAll('.display')].find(e => e.dataset.name === {name!r}); if (!d) return false;"
        "const b = d.querySelector('.display-name'); if (b.getAttribute('aria-expanded') === 'false') b.click();"
        f"return d.querySelector('.display-status').textContent.includes({text!r})"
    )


def levels(page: Page) -> dict[str, str]:
    """Return the displays' levels by name."""
    found = page.evaluate(
        "Object.fromEntries([...document.querySelectorAll('.displays .display')].map(e => [e.dataset.name, e.dataset.level]))"
    )
    return dict(found)


def mouse(page: Page, kind: str, x: float, y: float, buttons: int = 0) -> None:
    """Move (mouseMoved), press or release the mouse; the position is in pixels from the picture's middle, y downwards."""
    left, top = page.evaluate(
        "(() => { const r = document.querySelector('canvas.stage').getBoundingClientRect();"
        "return [r.x + r.width / 2, r.y + r.height / 2] })()"
    )
    page.call(
        "Input.dispatchMouseEvent",
        type=kind,
        x=left + x,
        y=top + y,
        button="none" if kind == "mouseMoved" else "left",
        buttons=buttons,
        clickCount=0 if kind == "mouseMoved" else 1,
    )


def drag(page: Page, start: tuple[float, float], end: tuple[float, float]) -> None:
    mouse(page, "mouseMoved", *start)
    mouse(page, "mousePressed", *start, buttons=1)
    mouse(page, "mouseMoved", (start[0] + end[0]) / 2, (start[1] + end[1]) / 2, buttons=1)
    mouse(page, "mouseMoved", *end, buttons=1)
    mouse(page, "mouseReleased", *end)


def picture(page: Page, clip: dict[str, float] | None = None) -> Image.Image:
    """Return a picture of the page, or of a part of it."""
    part = {} if clip is None else {"clip": clip}
    data = base64.b64decode(page.call("Page.captureScreenshot", format="png", **part)["data"])
    return Image.open(io.BytesIO(data)).convert("RGB")


def colors(page: Page) -> set[tuple[int, int, int]]:
    """Return the picture's colors."""
    image = picture(page)
    return {color for _, color in image.getcolors(image.width * image.height) or []}  # type: ignore[misc]


def color_at(page: Page, x: float, y: float) -> tuple[int, int, int]:
    """Return the color at a position in pixels from the middle of the 3D view, y downwards."""
    left, top = page.evaluate(
        "(() => { const r = document.querySelector('canvas.stage').getBoundingClientRect();"
        "return [r.x + r.width / 2, r.y + r.height / 2] })()"
    )
    clip = {"x": left + x, "y": top + y, "width": 1, "height": 1, "scale": 1}
    found: tuple[int, int, int] = picture(page, clip).getpixel((0, 0))  # type: ignore[assignment]
    return found


def is_near(found: set[tuple[int, int, int]], wanted: tuple[int, int, int], most: int = 12) -> bool:
    return any(all(abs(a - b) <= most for a, b in zip(color, wanted, strict=True)) for color in found)


def wait_color(page: Page, wanted: tuple[int, int, int], most: int = 12) -> None:
    """Wait until the picture contains a color: a received message is drawn with a delay."""
    end = time.monotonic() + PATIENCE
    while not is_near(colors(page), wanted, most):
        assert time.monotonic() < end, wanted
        page.evaluate("new Promise(requestAnimationFrame)")


def look_down(page: Page) -> float:
    """Set the camera to look down; return the number of pixels per metre."""
    following = page.wait(
        "const e = document.querySelector('select[aria-label=View]'); if (!e) return false;"
        "e.value = 'top'; e.dispatchEvent(new Event('change', {bubbles: true}));"
        "return (Number(document.querySelector('canvas.stage').dataset.drawn) || 0) + 1"
    )
    # The camera is aimed in the next picture, which the previous one may delay.
    page.wait(f"return Number(document.querySelector('canvas.stage').dataset.drawn) >= {following}")
    return float(page.evaluate("document.querySelector('.scene').clientHeight")) / (10 * 0.83)


def test_robot_in_its_room_is_shown_without_a_click(serve: Serve, browse: Browse) -> None:
    served = serve()
    served.run(served.node("setter").set_param("/robot_description", robot_scene.description()))
    publish(served, robot_scene.everything())
    page = browse(address(served, "3d"), width=1280, height=800)
    count = len(robot_scene.everything()) - 1 + 3  # tf; grid, TF and the robot
    page.wait(
        "const all = [...document.querySelectorAll('.displays .display')];"
        f"return all.length === {count} && all.every(e => e.dataset.level === 'ok')"
    )
    page.wait(
        "const all = [...document.querySelectorAll('.label:not([hidden])')].map(e => e.textContent);"
        "return all.length >= 8 && ['map', 'odom', 'base_link', 'laser', 'dock'].every(each => all.includes(each))"
    )
    page.wait_text(".scene-side", "map: OK")
    # A display that is turned off is not marked as faulty.
    page.click("[data-name='Grid'] input[type=checkbox]")
    page.wait(
        "const e = document.querySelector(\"[data-name='Grid'] .dot\"); const line = document.createElement('i');"
        "line.style.background = 'var(--line)'; document.body.append(line);"
        "const wanted = getComputedStyle(line).backgroundColor; line.remove();"
        "return getComputedStyle(e).backgroundColor === wanted"
    )
    page.click("[data-name='Grid'] input[type=checkbox]")
    # The colors of the background, of the map's free cells below the grid, and of the cloud and the path.
    for wanted in ((48, 48, 48), (197, 197, 197), (25, 255, 0)):
        wait_color(page, wanted, 16)


def test_missing_frame_is_named_until_it_comes(serve: Serve, browse: Browse) -> None:
    served = serve()
    scan = robot_scene.scan()
    scan.header.frame_id = "lost"
    frames = TFMessage([robot_scene.transform("map", "odom", 1, 0)])
    send = publish(served, {"/scan": scan, "/tf_static": frames})
    page = browse(address(served, "3d"))
    status(
        page,
        "LaserScan /scan",
        "Transform: No transform from [lost] to fixed frame [map]: Frame [lost] does not exist",
    )
    assert levels(page)["LaserScan /scan"] == "error"
    page.wait("return document.querySelector(\"[data-name='LaserScan /scan'] .dot.error\").offsetWidth > 0")
    send("/tf", TFMessage([robot_scene.transform("odom", "lost", 0, 1)]))
    status(page, "LaserScan /scan", "Transform: Transform OK")
    page.choose("select[aria-label='Fixed frame']", "odom")
    page.wait_text(".scene-side", "odom: OK")


def test_frames_that_are_not_published_any_more_are_hidden_and_named(serve: Serve, browse: Browse) -> None:
    served = serve()
    frames = TFMessage([robot_scene.transform("map", "moving", 1, 0)])
    publish(served, {"/tf": frames, "/tf_static": robot_scene.frames()})
    page = browse(address(served, "3d"))
    status(page, "TF", "9 frames")
    page.type("[data-name='TF'] input[aria-label='Frame Timeout']", "0.1")
    page.evaluate("document.activeElement.dispatchEvent(new Event('change'))")
    status(page, "TF", "Timeout: no transform for 0.1 s: moving")
    page.wait(
        "return ![...document.querySelectorAll('.label:not([hidden])')].some(e => e.textContent === 'moving')"
    )
    page.wait_text(".label", "base_link")


def test_without_transforms_the_frame_of_the_messages_is_fixed(serve: Serve, browse: Browse) -> None:
    served = serve()
    publish(served, {"/scan": robot_scene.scan()})
    page = browse(address(served, "3d"))
    status(page, "LaserScan /scan", "Transform: Transform OK")
    page.wait_text(".scene-side", "Fixed Frame [laser] does not exist")
    status(page, "TF", "No tf data")


def test_tools_publish_poses_goals_and_points(serve: Serve, browse: Browse) -> None:
    served = serve()
    publish(served, {"/tf_static": robot_scene.frames()})
    estimates = Listener(served, "/initialpose", PoseWithCovarianceStamped)
    goals = Listener(served, "/move_base_simple/goal", PoseStamped)
    points = Listener(served, "/clicked_point", PointStamped)
    page = browse(address(served, "3d"))
    page.wait_text(".scene-side", "map: OK")
    metre = look_down(page)

    page.click(".tools button", "2D Pose Estimate")
    estimates.connected()
    drag(page, (metre, 0), (metre, -2 * metre))
    estimate = estimates.next()
    assert estimate.header.frame_id == "map"
    position, orientation = estimate.pose.pose.position, estimate.pose.pose.orientation
    assert (position.x, position.y) == pytest.approx((1, 0), abs=0.05)
    assert orientation.z == pytest.approx(0.7071, abs=0.01)
    assert [round(estimate.pose.covariance[index], 4) for index in (0, 7, 35)] == [0.25, 0.25, 0.0685]
    page.wait_text("[role=status]", "published /initialpose")

    page.click(".tools button", "2D Nav Goal")
    goals.connected()
    drag(page, (0, metre), (-metre, metre))
    goal = goals.next()
    assert goal.pose.position.y == pytest.approx(-1, abs=0.05)
    assert abs(goal.pose.orientation.z) == pytest.approx(1, abs=0.01)

    page.click(".tools button", "Publish Point")
    points.connected()
    drag(page, (2 * metre, 2 * metre), (2 * metre, 2 * metre))
    point = points.next().point
    assert (point.x, point.y, point.z) == pytest.approx((2, -2, 0), abs=0.05)


def test_measure_and_focus_find_the_object_under_the_mouse(serve: Serve, browse: Browse) -> None:
    served = serve()
    cube = robot_scene.marker(Marker.CUBE, 0, 0)
    cube.scale.z = 1.0
    publish(served, {"/shape": cube, "/tf_static": robot_scene.frames()})
    page = browse(address(served, "3d"))
    status(page, "Marker /shape", "1 markers")
    metre = look_down(page)
    page.click(".tools button", "Measure")
    drag(page, (-metre, 0), (-metre, 0))
    drag(page, (-metre, -2 * metre), (-metre, -2 * metre))
    assert float(page.wait_text(".label.measure", "m").split()[0]) == pytest.approx(2, abs=0.03)
    page.click(".tools button", "Focus")
    drag(page, (0, 0), (0, 0))
    # The top face of the cube is half a metre above its middle.
    page.wait_text("[role=status]", "0.70)")


def test_displays_are_added_set_hidden_and_removed(serve: Serve, browse: Browse) -> None:
    served = serve()
    publish(served, {"/tf_static": robot_scene.frames(), "/cloud": robot_scene.cloud()})
    page = browse(address(served, "3d"))
    status(page, "PointCloud2 /cloud", "Showing 8064 points from 8064")
    page.choose("[data-name='PointCloud2 /cloud'] select[aria-label='Color Transformer']", "FlatColor")
    page.evaluate(
        "(() => { const e = document.querySelector(\"[data-name='PointCloud2 /cloud'] input[type=color]\");"
        "e.value = '#00ffff'; e.dispatchEvent(new Event('change')) })()"
    )
    page.type("[data-name='PointCloud2 /cloud'] input[aria-label='Size (m)']", "0.3")
    page.evaluate("document.activeElement.dispatchEvent(new Event('change'))")
    page.wait("return Boolean(localStorage.getItem('3d')?.includes('0; 255; 255'))")
    wait_color(page, (0, 255, 255), 0)
    page.click("[data-name='PointCloud2 /cloud'] input[type=checkbox]")
    page.wait("return document.querySelector(\"[data-name='PointCloud2 /cloud']\").classList.contains('off')")
    page.reload()
    page.wait("return document.querySelector(\"[data-name='PointCloud2 /cloud']\").classList.contains('off')")
    drawn(page)
    assert not is_near(colors(page), (0, 255, 255), 0)
    page.click("[data-name='PointCloud2 /cloud'] .display-name")
    page.click("[data-name='PointCloud2 /cloud'] button", "Remove")
    page.wait("return !document.querySelector(\"[data-name='PointCloud2 /cloud']\")")
    page.evaluate(
        "document.querySelector('select[aria-label=\"Add a display\"]').dispatchEvent(new Event('focus'))"
    )
    page.choose("select[aria-label='Add a display']", "PointCloud2 /cloud")
    status(page, "PointCloud2 /cloud", "Showing 8064 points from 8064")


def test_markers_come_and_go(serve: Serve, browse: Browse) -> None:
    served = serve()
    send = publish(served, {"/tf_static": robot_scene.frames(), "/shapes": robot_scene.markers()})
    page = browse(address(served, "3d"))
    status(page, "MarkerArray /shapes", "Markers: 11 markers")
    page.wait_text(".label.marker", "dock")
    gone = robot_scene.marker(Marker.TEXT_VIEW_FACING, 0, 0, action=Marker.DELETE)
    send("/shapes", MarkerArray([gone]))
    status(page, "MarkerArray /shapes", "Markers: 10 markers")
    assert not page.evaluate("document.querySelectorAll('.label.marker').length")
    bad = robot_scene.marker(Marker.CUBE, float("nan"), 0)
    odd = robot_scene.marker(Marker.LINE_LIST, 0, 0, points=[Marker().pose.position])
    send("/shapes", MarkerArray([bad]))
    status(
        page, "MarkerArray /shapes", "shapes/1: Marker contained invalid floating point values (nans or infs)"
    )
    send("/shapes", MarkerArray([odd]))
    status(page, "MarkerArray /shapes", "shapes/5: a line list needs an even number of points")
    send("/shapes", MarkerArray([robot_scene.marker(0, 0, 0, action=Marker.DELETEALL)]))
    status(page, "MarkerArray /shapes", "Markers: 0 markers")


STL = (
    b"\0" * 80
    + struct.pack("<I", 2)
    + 2 * (struct.pack("<12f", 0, 0, 1, -1, -1, 0.5, 1, -1, 0.5, 0, 1, 0.5) + b"\0\0")
)


def test_robot_has_its_meshes_and_follows_its_joints_without_transforms(
    serve: Serve, browse: Browse, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "my_meshes"
    package.mkdir()
    (package / "package.xml").write_text("<package><name>my_meshes</name></package>", encoding="utf-8")
    (package / "part.stl").write_bytes(STL)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    served = serve()
    shape = (
        '<visual><geometry><mesh filename="package://my_meshes/%s"/></geometry>'
        '<material name="m"><color rgba="1 0 1 1"/></material></visual>'
    )
    setter = served.node("setter")
    served.run(setter.set_param("/robot_description", robot_scene.description(shape % "part.stl")))
    send = publish(served, {})
    page = browse(address(served, "3d"))
    status(
        page,
        "RobotModel",
        "No transform from [mast] to fixed frame [base_link]: Frame [mast] does not exist; and 4 more links",
    )
    send("/joint_states", JointState(name=["left_wheel_joint"], position=[1.0]))
    status(page, "RobotModel", "Transform: Transform OK")
    page.wait("return !document.querySelector(\"[data-name='RobotModel']\").textContent.includes('Meshes')")
    wait_hue(page, (True, False, True))
    served.run(setter.set_param("/robot_description", robot_scene.description(shape % "missing.stl")))
    status(page, "RobotModel", "there is no such file")
    served.run(setter.set_param("/robot_description", "<robot>"))
    status(page, "RobotModel", "URDF failed Model parse: line 1: </robot> is missing")


def wait_hue(page: Page, wanted: tuple[bool, bool, bool]) -> None:
    """Wait until the picture has a color with these red, green and blue components, regardless of lighting."""
    end = time.monotonic() + PATIENCE
    while not any(
        all(part > 150 if is_lit else part < 60 for part, is_lit in zip(color, wanted, strict=True))
        for color in colors(page)
    ):
        assert time.monotonic() < end, wanted
        page.evaluate("new Promise(requestAnimationFrame)")


COLLADA = """<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="t"><lambert>
<diffuse><color>0 1 1 1</color></diffuse></lambert></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="12">-100 -100 50 100 -100 50 100 100 50 -100 100 50</float_array>
<technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles material="s" count="2"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2 0 2 3</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="vs"><node id="n"><instance_geometry url="#g"><bind_material><technique_common>
<instance_material symbol="s" target="#m"/></technique_common></bind_material></instance_geometry></node></visual_scene>
</library_visual_scenes>
<scene><instance_visual_scene url="#vs"/></scene></COLLADA>"""


def test_collada_meshes_have_their_colors_and_unit(
    serve: Serve, browse: Browse, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "my_meshes"
    package.mkdir()
    (package / "package.xml").write_text("<package><name>my_meshes</name></package>", encoding="utf-8")
    (package / "part.dae").write_text(COLLADA, encoding="utf-8")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    served = serve()
    mesh = robot_scene.marker(Marker.MESH_RESOURCE, 0, 0, mesh_resource="package://my_meshes/part.dae")
    mesh.scale.x = mesh.scale.y = mesh.scale.z = 1.0
    mesh.mesh_use_embedded_materials = True
    mesh.color.r = mesh.color.g = mesh.color.b = mesh.color.a = 0.0
    publish(served, {"/shape": mesh, "/tf_static": robot_scene.frames()})
    page = browse(address(served, "3d"))
    status(page, "Marker /shape", "1 markers")
    metre = look_down(page)
    wait_hue(page, (False, True, True))
    # The click is two metres to the side of the marker, and half a metre above it.
    page.click(".tools button", "Focus")
    drag(page, (-0.7 * metre, 0), (-0.7 * metre, 0))
    page.wait_text("[role=status]", "(-0.70, 0.00, 0.70)")


def test_meshes_keep_their_materials_without_lamps_and_a_bad_shape_is_named(
    serve: Serve, browse: Browse, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rviz_pictures.prepare(tmp_path)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    served = serve()
    uri = (tmp_path / "rviz_meshes" / "two.dae").as_uri()
    visual = (
        f'<visual><geometry><mesh filename="{uri}" scale="4 4 4"/></geometry>'
        '<material name="blue"><color rgba="0 0 1 1"/></material></visual>'
        '<visual><geometry><capsule radius="1" length="1"/></geometry></visual>'
    )
    text = f'<robot name="r"><!-- a -- b --><link name="map">{visual}</link></robot>'
    served.run(served.node("setter").set_param("/robot_description", text))
    publish(served, {"/tf_static": robot_scene.frames()})
    page = browse(address(served, "3d"))
    status(page, "RobotModel", "a shape is left out: the shape <capsule> is not known")
    status(page, "RobotModel", "'--' is not allowed inside a comment")
    look_down(page)
    # The file's diffuse and emitted colors are 0.75 0.4 0.2 together, seen from above: neither that of the description, nor
    # that in the lamp's light.
    end = time.monotonic() + PATIENCE
    while not is_near(colors(page), (191, 102, 51), 3):
        assert time.monotonic() < end


def test_meshes_are_opaque_whatever_the_opacity_in_their_files(
    serve: Serve, browse: Browse, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rviz_pictures.prepare(tmp_path)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    served = serve()
    visuals = "".join(
        f'<visual><origin xyz="{x} 0 0"/><geometry><mesh filename="package://rviz_meshes/{name}" scale="4 4 4"/></geometry>'
        "</visual>"
        for x, name in ((-1.5, "two.dae"), (1.5, "leaf.obj"))
    )
    text = f'<robot name="r"><link name="map">{visuals}</link></robot>'
    served.run(served.node("setter").set_param("/robot_description", text))
    publish(served, {"/tf_static": robot_scene.frames()})
    page = browse(address(served, "3d"))
    look_down(page)
    # Both files say that their material cannot be seen.
    wait_color(page, (191, 102, 51), 3)
    wait_color(page, (77, 128, 128), 3)


def test_scans_compile_no_program_after_the_first(serve: Serve, browse: Browse) -> None:
    served = serve()
    scan = robot_scene.everything()["/scan"]
    send = publish(served, {"/scan": scan, "/tf_static": robot_scene.frames()})
    page = browse(address(served, "3d"))
    status(page, "LaserScan /scan", "Messages received")
    page.wait("return document.querySelector('canvas.stage').dataset.settled === 'true'")
    page.evaluate(
        "{ const kind = WebGL2RenderingContext.prototype, { linkProgram, bufferData } = kind;"
        "window.linked = window.uploaded = 0;"
        "kind.linkProgram = function (...parts) { linked += 1; return linkProgram.apply(this, parts); };"
        "kind.bufferData = function (...parts) { uploaded += 1; return bufferData.apply(this, parts); }; }"
    )
    for count in range(3):
        scan.ranges = [1.0 + count] * len(scan.ranges)
        before = page.evaluate("uploaded")
        send("/scan", scan)
        page.wait(
            f"return uploaded > {before} && document.querySelector('canvas.stage').dataset.settled === 'true'"
        )
    assert page.evaluate("linked") == 0


def test_files_that_come_late_are_in_a_picture_that_nothing_else_asks_for(
    serve: Serve, browse: Browse, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rviz_pictures.prepare(tmp_path)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    served = serve()
    publish(served, {"/tf_static": robot_scene.frames()})
    page = browse(address(served, "3d"))
    look_down(page)
    page.evaluate(
        "import('./js/link.js').then(({ Link }) => { const { asset } = Link.prototype; window.held = [];"
        "Link.prototype.asset = async function (uri) {"
        " await new Promise((release) => held.push({ uri, release })); return asset.call(this, uri); } })"
    )
    mesh = '<visual><geometry><mesh filename="package://rviz_meshes/picture.dae" scale="6 6 6"/></geometry></visual>'
    text = f'<robot name="r"><link name="map">{mesh}</link></robot>'
    served.run(served.node("setter").set_param("/robot_description", text))

    for name in ("picture.dae", "squares.png"):
        page.wait(f"return held.length === 1 && held[0].uri.endsWith({name!r})")
        # Comparisons must not use a picture without the mesh.
        assert page.evaluate("document.querySelector('canvas.stage').dataset.settled") == "false"
        page.evaluate("held.pop().release()")
    page.wait("return document.querySelector('canvas.stage').dataset.settled === 'true'")
    assert is_near(colors(page), (240, 220, 40))


def test_light_is_interpolated_between_the_vertices(
    serve: Serve, browse: Browse, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rviz_pictures.prepare(tmp_path)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    served = serve()
    visual = '<visual><geometry><mesh filename="package://rviz_meshes/smooth.obj" scale="4 4 4"/></geometry></visual>'
    text = f'<robot name="r"><link name="map">{visual}</link></robot>'
    served.run(served.node("setter").set_param("/robot_description", text))
    publish(served, {"/tf_static": robot_scene.frames()})
    page = browse(address(served, "3d"))
    metre = look_down(page)
    # The normals at the four corners of the upper side have an angle of 54.7 degrees to the light from above.
    red, green, blue = (
        round(255 * (0.577 * diffuse + emitted)) for diffuse, emitted in ((0.1, 0.2), (0.5, 0.0), (0.2, 0.3))
    )
    end = time.monotonic() + PATIENCE
    while not is_near({color_at(page, 0.3 * metre, 0.3 * metre)}, (red, green, blue), 3):
        assert time.monotonic() < end


def test_meshes_without_a_package_are_named_with_the_reason(serve: Serve, browse: Browse) -> None:
    # RViz shows no such mesh: Could not load resource [package:///torso.stl]: Unable to open file "package:///torso.stl".
    meshes = "".join(
        f'<visual><geometry><mesh filename="package:///{name}.stl"/></geometry></visual>'
        for name in ("torso", "leg")
    )
    served = serve()
    text = f'<robot name="r"><link name="map">{meshes}</link></robot>'
    served.run(served.node("setter").set_param("/robot_description", text))
    page = browse(address(served, "3d"))
    status(
        page,
        "RobotModel",
        "Meshes: package:///torso.stl: the name of the package is missing before the path; and 1 more",
    )


def test_textures_have_the_colors_of_their_pictures(
    serve: Serve, browse: Browse, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rviz_pictures.prepare(tmp_path)
    (tmp_path / "rviz_meshes" / "lost.dae").write_text(rviz_pictures.textured("lost.png"), encoding="utf-8")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    served = serve()
    visuals = "".join(
        f'<visual><origin xyz="{x} 0 0"/><geometry><mesh filename="package://rviz_meshes/{name}.dae" scale="6 6 1"/></geometry>'
        "</visual>"
        for x, name in ((0, "lost"), (2, "picture"), (-2, "bumps"))
    )
    text = f'<robot name="r"><link name="map">{visuals}</link></robot>'
    served.run(served.node("setter").set_param("/robot_description", text))
    publish(served, {"/tf_static": robot_scene.frames()})
    page = browse(address(served, "3d"))
    metre = look_down(page)
    # Nothing moves the camera after the picture of the texture has arrived, which would draw the scene again.
    wait_color(page, (30, 160, 60), 3)
    # As in RViz, a picture that is also that of the bumps is multiplied with itself.
    wait_color(page, (30 * 30 // 255, 160 * 160 // 255, 60 * 60 // 255), 3)
    # A mesh whose picture is missing has its material's color, and is not black.
    end = time.monotonic() + PATIENCE
    while min(color_at(page, 0.4 * metre, 0.4 * metre)) < 250:
        assert time.monotonic() < end


def test_display_of_a_topic_that_vanishes_fades_until_it_comes_again(serve: Serve, browse: Browse) -> None:
    served = serve()
    publish(served, {"/tf_static": robot_scene.frames()})
    cube = robot_scene.marker(Marker.CUBE, 0, 0)
    cube.scale.x = cube.scale.y = cube.scale.z = 3.0
    cube.color.r, cube.color.g, cube.color.b, cube.color.a = 1.0, 0.0, 1.0, 1.0
    sender = publisher(served, "/cube", Marker, latch=True)
    served.run(sender.publish(cube))
    page = browse(address(served, "3d"))
    status(page, "Marker /cube", "Messages received")
    wait_hue(page, (True, False, True))

    served.run(sender.close())
    status(page, "Marker /cube", "Nothing publishes this topic any more")
    row = ".display[data-name='Marker /cube']"
    page.wait(f"return document.querySelector({row!r}).classList.contains('gone')")
    end = time.monotonic() + PATIENCE
    while any(min(red, blue) > 150 and green < 60 for red, green, blue in colors(page)):
        assert time.monotonic() < end

    served.run(publisher(served, "/cube", Marker, latch=True).publish(cube))
    wait_hue(page, (True, False, True))
    page.wait(f"return !document.querySelector({row!r}).classList.contains('gone')")


def test_camera_starts_at_the_robot_and_odometry_is_one_arrow_with_a_trail(
    serve: Serve, browse: Browse
) -> None:
    served = serve()
    served.run(served.node("setter").set_param("/robot_description", robot_scene.description()))
    send = publish(served, {"/tf_static": robot_scene.frames(), "/base/long_odometry_name": Odometry()})
    page = browse(address(served, "3d"))
    kept = "JSON.parse(localStorage.getItem('3d')).raw['Visualization Manager']"
    page.wait(f"return localStorage.getItem('3d') && {kept}.Views.Current.Distance < 4")
    view = page.evaluate(f"{kept}.Views.Current")
    # The robot is about a metre large, and at (0.8, -0.3).
    assert 1.5 < view["Distance"] < 4
    assert (view["Focal Point"]["X"], view["Focal Point"]["Y"]) == pytest.approx((0.8, -0.3), abs=0.2)

    for step in range(20):
        message = robot_scene.stamped(Odometry, "map")
        message.pose.pose = robot_scene.pose(step * 0.2, 0)
        send("/base/long_odometry_name", message)
    name = "Odometry /base/long_odometry_name"
    status(page, name, "Messages received")
    # The page saves a while after a change.
    settings = page.wait(f"return {kept}.Displays.find(e => e.Name === {name!r})")
    assert (settings["Keep"], settings["Trail"]) == (1, 1000)
    # The name may only be broken behind "/" and "_".
    parts = page.evaluate(
        f"[...document.querySelector(\".display[data-name='{name}'] .display-name\").childNodes].map(e => e.textContent)"
    )
    assert [part for part in parts if part] == ["Odometry /", "base/", "long_", "odometry_", "name"]

    # A page that was used before keeps its view.
    page.reload()
    status(page, name, "essages received")
    assert page.evaluate(f"{kept}.Views.Current.Distance") == view["Distance"]


RVIZ = """Visualization Manager:
  Displays:
    - {Class: rviz/Grid, Name: Floor, Enabled: true, Plane Cell Count: 4, Color: 255; 0; 0}
    - Class: rviz/Group
      Displays:
        - {Class: rviz/LaserScan, Name: Front, Enabled: true, Topic: /scan, Style: Points, Size (Pixels): 4}
      Enabled: true
      Name: Sensors
    - {Class: moveit_rviz_plugin/MotionPlanning, Name: Planning, Enabled: true, Planned Path: {Loop: true}}
  Global Options: {Background Color: 10; 20; 30, Fixed Frame: odom, Frame Rate: 30}
  Tools:
    - {Class: rviz/SetGoal, Topic: /my/goal}
  Views:
    Current: {Class: rviz/TopDownOrtho, Scale: 40, X: 1, Y: 0, Angle: 0, Target Frame: base_link}
"""


def test_file_of_rviz_is_opened_changed_and_saved(serve: Serve, browse: Browse, tmp_path: Path) -> None:
    file = tmp_path / "my.rviz"
    file.write_text(RVIZ, encoding="utf-8")
    served = serve()
    assert served.dashboard
    served.dashboard.rviz.file = file
    publish(
        served, {"/tf_static": robot_scene.frames(), "/scan": robot_scene.scan(), "/map": robot_scene.grid()}
    )
    page = browse(address(served, "3d?file=1"))
    page.wait_text(
        "[role=status]", "not shown, but kept when it is saved: Planning (moveit_rviz_plugin/MotionPlanning)"
    )
    status(page, "Front", "Transform: Transform OK")
    page.wait_text(".scene-side", "odom: OK")
    names = "[...document.querySelectorAll('.displays .display')].map(e => e.dataset.name)"
    # Only the file's displays are shown.
    assert page.evaluate(names) == ["Floor", "Sensors", "Front", "Planning"]
    wait_color(page, (10, 20, 30), 2)
    assert page.evaluate("document.querySelector('select[aria-label=View]').value") == "top"
    page.click("[data-name='Front'] input[type=checkbox]")
    page.click(".files button", "Save")
    page.wait_text("[role=status]", "saved my.rviz")
    before, after = parse_rviz(RVIZ), parse_rviz(file.read_text(encoding="utf-8"))
    manager: Any = after["Visualization Manager"]
    assert manager["Displays"][1]["Displays"][0]["Enabled"] is False
    assert manager["Displays"][2] == before["Visualization Manager"]["Displays"][2]  # type: ignore[index]
    assert manager["Views"]["Current"]["Target Frame"] == "base_link"
    assert manager["Global Options"]["Fixed Frame"] == "odom"


def test_read_only_page_publishes_nothing(serve: Serve, browse: Browse) -> None:
    from minirospy.web.access import Access

    access = Access(read_token="read-token-00", write_token="write-token-0", requires_token=True)
    served = serve(access=access)
    page = browse(address(served, "3d?token=read-token-00"))
    page.wait_text("#state", "connected, read-only")
    drawn(page)
    page.click(".tools button", "Publish Point")
    look_down(page)
    drag(page, (10, 10), (10, 10))
    page.wait_text("[role=status]", "/clicked_point: publishing is not allowed: this token is read-only")
