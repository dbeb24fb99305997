"""libgazebo_ros_camera.so, libgazebo_ros_depth_camera.so and libgazebo_ros_openni_kinect.so: cameras.

Each camera renders in a thread of its own, so that the simulation goes on meanwhile. A picture is late rather than the
simulation: its stamp is the time of the world that it shows.
"""

from __future__ import annotations

import math
import threading
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField
from std_msgs.msg import Header

from minirospy import client as rospy
from minirospy.base.xml_text import XmlElement
from minirospy.ros.gazebo_ros.loop import LoopClosed
from minirospy.ros.gazebo_ros.messages import time_of
from minirospy.ros.gazebo_ros.physics import SimulationError
from minirospy.ros.gazebo_ros.plugins import SensorPlugin

if TYPE_CHECKING:
    from minirospy.ros.gazebo_ros.physics.rendering import Renderer

__all__ = ["Camera", "DepthCamera"]

_POINT_STEP = 32  # bytes: x, y, z and rgb, each aligned as PCL does


class Camera(SensorPlugin):
    """Colour pictures. Parameters: cameraName, imageTopicName, cameraInfoTopicName, frameName, updateRate, hackBaseline."""

    def load(self) -> None:
        """Read the sensor, and start the thread."""
        camera = self.sensor.element.first("camera")
        image, clip = _child(camera, "image"), _child(camera, "clip")
        self._width, self._height = int(_number(image, "width", 320)), int(_number(image, "height", 240))
        self._encoding = {"L8": "mono8", "B8G8R8": "bgr8", "BGR8": "bgr8"}.get(_text(image, "format"), "rgb8")
        self._fov = _number(camera, "horizontal_fov", 1.047)
        self._near, self._far = _number(clip, "near", 0.1), _number(clip, "far", 100.0)
        self._focal = self._width / (2 * math.tan(self._fov / 2))
        self._frame = self.frame("frameName", "/world")
        self._baseline = self.number("hackBaseline", 0.0)
        self.rate = self.number("updateRate", 0.0) or self.rate
        self._images = self.camera_publisher("imageTopicName", "image_raw", Image)
        self._infos = self.camera_publisher("cameraInfoTopicName", "camera_info", CameraInfo)
        self._publishers = [self._images, self._infos]
        self._wanted, self._is_closed = threading.Event(), False
        threading.Thread(target=self._run, name=f"camera {self.sensor.name}").start()

    def camera_publisher(self, tag: str, default: str, kind: Any) -> rospy.Publisher[Any]:
        """Return a publisher in the camera's namespace, whose topic is a parameter."""
        topic = self.text(tag, default)
        name = self.text("cameraName", self.sensor.name).rstrip("/")
        return self.publish_to(topic if topic.startswith("/") else f"{name}/{topic}", kind)

    def is_needed(self) -> bool:
        """Return whether there is a subscriber."""
        return any(each.get_num_connections() for each in self._publishers)

    def sense(self) -> None:
        """Ask the thread for a picture."""
        self._wanted.set()

    def close(self) -> None:
        """End the thread."""
        self._is_closed = True
        self._wanted.set()
        super().close()

    def _run(self) -> None:
        renderer: Renderer | None = None
        try:
            while True:
                self._wanted.wait()
                if self._is_closed:
                    return
                self._wanted.clear()
                with self.loop.held() as simulation:
                    if self.model.is_removed:
                        return
                    if renderer is None:
                        renderer = simulation.renderer(self._width, self._height)
                    renderer.capture(self.sensor_pose, self._fov, self._near, self._far)
                    stamp = time_of(simulation.time_ns)
                self._publish(renderer, Header(stamp=stamp, frame_id=self._frame))
        except LoopClosed:
            pass
        except (SimulationError, rospy.ROSException) as error:
            if not self._is_closed and str(error) not in self.loop.reported:
                self.loop.reported.add(str(error))
                rospy.logerr("there are no pictures: %s", error)
        finally:
            if renderer is not None:
                renderer.close()

    def _publish(self, renderer: Renderer, header: Header) -> None:
        if self._images.get_num_connections():
            self._images.publish(self._image(header, renderer.color()))
        if self._infos.get_num_connections():
            self._infos.publish(self._info(header))

    def _image(self, header: Header, color: NDArray[np.uint8]) -> Image:
        if self._encoding == "mono8":
            color = (color @ np.array([0.299, 0.587, 0.114])).astype(np.uint8)
        elif self._encoding == "bgr8":
            color = color[:, :, ::-1]
        return _to_image(header, self._encoding, color)

    def _info(self, header: Header) -> CameraInfo:
        width, height, focal = self._width, self._height, self._focal
        x, y = (width + 1) / 2, (height + 1) / 2
        return CameraInfo(
            header=header,
            height=height,
            width=width,
            distortion_model="plumb_bob",
            D=[0.0] * 5,
            K=[focal, 0.0, x, 0.0, focal, y, 0.0, 0.0, 1.0],
            R=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            P=[focal, 0.0, x, -focal * self._baseline, 0.0, focal, y, 0.0, 0.0, 0.0, 1.0, 0.0],
        )


class DepthCamera(Camera):
    """Colour and depth pictures, and points in optical axes (z forwards).

    Additional parameters: depthImageTopicName, depthImageCameraInfoTopicName (or depthImageInfoTopicName),
    pointCloudTopicName, pointCloudCutoff, pointCloudCutoffMax, useDepth16UC1Format.
    """

    def load(self) -> None:
        """Read the sensor, and start the thread."""
        self._nearest = self.number("pointCloudCutoff", 0.4)
        self._farthest = self.number("pointCloudCutoffMax", 5.0)
        self._uses_millimetres = self.flag("useDepth16UC1Format", False)
        self._depths = self.camera_publisher("depthImageTopicName", "depth/image_raw", Image)
        tag = "depthImageCameraInfoTopicName"
        tag = tag if self.element.first(tag) is not None else "depthImageInfoTopicName"
        self._depth_infos = self.camera_publisher(tag, "depth/camera_info", CameraInfo)
        self._points = self.camera_publisher("pointCloudTopicName", "points", PointCloud2)
        super().load()
        self._publishers += [self._depths, self._depth_infos, self._points]

    def _publish(self, renderer: Renderer, header: Header) -> None:
        super()._publish(renderer, header)
        if self._depth_infos.get_num_connections():
            self._depth_infos.publish(self._info(header))
        has_points = self._points.get_num_connections() > 0
        if not has_points and not self._depths.get_num_connections():
            return
        depths = renderer.depth()
        is_outside = (depths < self._nearest) | (depths > self._farthest)
        depths = np.where(is_outside, np.float32(np.nan), depths).astype(np.float32)
        if self._depths.get_num_connections():
            if self._uses_millimetres:
                values = np.nan_to_num(depths * 1000).astype(np.uint16)
                self._depths.publish(_to_image(header, "16UC1", values))
            else:
                self._depths.publish(_to_image(header, "32FC1", depths))
        if has_points:
            self._points.publish(self._cloud(header, depths, renderer.color()))

    def _cloud(self, header: Header, depths: NDArray[np.float32], color: NDArray[np.uint8]) -> PointCloud2:
        height, width = depths.shape
        rows, columns = np.mgrid[0:height, 0:width]
        cloud = np.zeros((height, width, _POINT_STEP // 4), np.float32)
        cloud[:, :, 0] = (columns - (width - 1) / 2) / self._focal * depths
        cloud[:, :, 1] = (rows - (height - 1) / 2) / self._focal * depths
        cloud[:, :, 2] = depths
        red, green, blue = (color[:, :, index].astype(np.uint32) for index in range(3))
        cloud[:, :, 4] = ((red << 16) | (green << 8) | blue).view(np.float32)
        names = (("x", 0), ("y", 4), ("z", 8), ("rgb", 16))
        return PointCloud2(
            header=header,
            height=height,
            width=width,
            fields=[PointField(name, offset, PointField.FLOAT32, 1) for name, offset in names],
            is_bigendian=False,
            point_step=_POINT_STEP,
            row_step=_POINT_STEP * width,
            data=cloud.tobytes(),
            is_dense=False,
        )


def _to_image(header: Header, encoding: str, values: NDArray[Any]) -> Image:
    values = np.ascontiguousarray(values)
    height, width = values.shape[:2]
    return Image(
        header=header,
        height=height,
        width=width,
        encoding=encoding,
        is_bigendian=0,
        step=values.strides[0],
        data=values.tobytes(),
    )


def _child(element: XmlElement | None, tag: str) -> XmlElement | None:
    return element.first(tag) if element is not None else None


def _text(element: XmlElement | None, tag: str) -> str:
    child = _child(element, tag)
    return child.text.strip() if child is not None else ""


def _number(element: XmlElement | None, tag: str, default: float) -> float:
    text = _text(element, tag)
    return float(text) if text else default
