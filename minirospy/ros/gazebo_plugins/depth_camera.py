"""libgazebo_ros_openni_kinect.so and libgazebo_ros_depth_camera.so: publish depths, points and colours."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField
from std_msgs.msg import Header

from minirospy.base.times import Time
from minirospy.ros.gazebo_plugins.camera import CameraPlugin, Lens
from minirospy.ros.gazebo_plugins.optics import read_optics
from minirospy.ros.gazebo_plugins.pictures import to_depths

if TYPE_CHECKING:
    from minirospy.ros.gazebo_ros.physics.rendering import Renderer

__all__ = ["DepthCamera", "OpenniKinect"]

POINT_STEP = 32  # bytes
_FIELDS = (("x", 0), ("y", 4), ("z", 8), ("rgb", 16))


class DepthCamera(CameraPlugin):
    """libgazebo_ros_depth_camera.so: a camera that also publishes depths and a point cloud.

    Parameters, in addition to a camera's: pointCloudTopicName, depthImageTopicName, depthImageCameraInfoTopicName,
    pointCloudCutoff, useDepth16UC1Format.
    """

    image_topic = "ir/image_raw"
    info_topic = "ir/camera_info"
    is_organized = False  # whether the point cloud has as many rows as the picture

    def load(self) -> None:
        """Create the camera and its publishers."""
        super().load()
        lens = self._lens = self.add_lens(read_optics(self.sensor.element.first("camera")))
        self._points = lens.publish_to("pointCloudTopicName", "points", PointCloud2)
        self._depths = lens.publish_to("depthImageTopicName", "depth/image_raw", Image)
        tag = "depthImageCameraInfoTopicName"
        if self.element.first(tag) is None:
            tag = "depthImageInfoTopicName"  # a tag of another plugin, which many models use here
        self._infos = lens.publish_to(tag, "depth/camera_info", CameraInfo)
        self._nearest, self._farthest = self.number("pointCloudCutoff", 0.4), self.read_farthest()
        self._is_16_bit = self.flag("useDepth16UC1Format", False)
        optics = lens.optics
        self._slopes = (
            _slopes(optics.width, optics.focal_length)[None, :],
            _slopes(optics.height, optics.focal_length)[:, None],
        )

    def read_farthest(self) -> float:
        """Return the distance beyond which the plugin publishes no points."""
        return np.inf

    def sense(self) -> None:
        """Publish on the topics that have subscribers; ``updateRate`` applies only to camera_info."""
        now, lens = self.now, self._lens
        if self.is_due():
            lens.publish_info(now, lens.infos)
            lens.publish_info(now, self._infos)
        if any(each.get_num_connections() for each in (lens.images, self._points, self._depths)):
            lens.take(lambda renderer: self._publish(lens, renderer, now))

    def _publish(self, lens: Lens, renderer: Renderer, stamp: Time) -> None:
        needs_points = self._points.get_num_connections() > 0
        image: Image | None = None
        if needs_points or lens.images.get_num_connections():
            image = lens.to_image(renderer, stamp)
            lens.images.publish(image)
        if needs_points or self._depths.get_num_connections():
            depths = to_depths(renderer, lens.optics.far)
            valid = (depths > self._nearest) & (depths < self._farthest)
            if self._depths.get_num_connections():
                self._depths.publish(self._to_depth_image(depths, valid, stamp))
            if needs_points and image is not None:
                self._points.publish(self._to_cloud(depths, valid, image, stamp))

    def _to_depth_image(self, depths: NDArray[np.float32], valid: NDArray[np.bool_], stamp: Time) -> Image:
        height, width = depths.shape
        image = Image(header=Header(stamp=stamp, frame_id=self.frame_id), height=height, width=width)
        if self._is_16_bit:
            image.encoding, image.step = "16UC1", 2 * width
            millimetres = np.clip(np.where(valid, depths * np.float32(1000), 0), 0, 0xFFFF)
            image.data = millimetres.astype("<u2").tobytes()
        else:
            image.encoding, image.step = "32FC1", 4 * width
            image.data = np.where(valid, depths, np.float32(np.nan)).astype("<f4").tobytes()
        return image

    def _to_cloud(
        self, depths: NDArray[np.float32], valid: NDArray[np.bool_], image: Image, stamp: Time
    ) -> PointCloud2:
        height, width = depths.shape
        right, down = self._slopes
        z = np.where(valid, depths, np.float32(np.nan))
        rows = np.zeros((height, width, POINT_STEP), np.uint8)
        values = rows.view("<f4")
        values[:, :, 0], values[:, :, 1], values[:, :, 2] = z * right, z * down, z
        # As in Gazebo, copy the picture's first channel to blue, although that swaps red and blue in R8G8B8.
        pixels = np.frombuffer(image.data, np.uint8)
        if len(pixels) in (height * width, 3 * height * width):
            rows[:, :, 16:19] = pixels.reshape(height, width, -1)

        cloud = PointCloud2(height=height, width=width, point_step=POINT_STEP)
        if not self.is_organized:
            cloud.height, cloud.width = 1, height * width
        cloud.header = Header(stamp=stamp, frame_id=self.frame_id)
        cloud.fields = [PointField(name, offset, PointField.FLOAT32, 1) for name, offset in _FIELDS]
        cloud.row_step = POINT_STEP * cloud.width
        cloud.is_dense = bool(valid.all())
        cloud.data = rows.tobytes()
        return cloud


class OpenniKinect(DepthCamera):
    """libgazebo_ros_openni_kinect.so: a depth camera with the additional parameter pointCloudCutoffMax."""

    is_organized = True

    def read_farthest(self) -> float:
        """Return the distance beyond which the plugin publishes no points."""
        return self.number("pointCloudCutoffMax", 5.0)


def _slopes(count: int, focal_length: float) -> NDArray[np.float32]:
    """Return each pixel's distance from the optical axis at a depth of 1 m."""
    return ((np.arange(count) - 0.5 * (count - 1)) / focal_length).astype(np.float32)
