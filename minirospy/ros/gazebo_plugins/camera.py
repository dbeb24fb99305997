"""libgazebo_ros_camera.so and libgazebo_ros_multicamera.so: publish colour pictures and camera_info."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from sensor_msgs.msg import CameraInfo, Image
from sensor_msgs.srv import SetCameraInfo, SetCameraInfoRequest, SetCameraInfoResponse

from minirospy import client as rospy
from minirospy.base.times import Time
from minirospy.core.sdf.poses import compose
from minirospy.ros.dynamic_reconfigure.definition import Definition
from minirospy.ros.gazebo_plugins.optics import (
    Optics,
    add_noise,
    encode,
    encoding_of,
    read_optics,
    to_camera_info,
)
from minirospy.ros.gazebo_plugins.pictures import Photographer
from minirospy.ros.gazebo_ros.physics.rendering import MAX_PIXELS
from minirospy.ros.gazebo_ros.plugins import PluginError, SensorPlugin

if TYPE_CHECKING:
    from minirospy.ros.gazebo_ros.physics.rendering import Renderer

__all__ = ["Camera", "CameraPlugin", "Lens", "MultiCamera"]

RATES = (2.0, 1.0, 50.0)  # Hz; default, minimum and maximum in dynamic reconfigure


class CameraPlugin(SensorPlugin):
    """The base class of all camera plugins.

    Parameters: cameraName, frameName, imageTopicName, cameraInfoTopicName, updateRate (0: the sensor's), hackBaseline, Cx, Cy,
    focalLength, distortionK1, K2, K3, T1, T2, autoDistortion.
    """

    image_topic = "image_raw"
    info_topic = "camera_info"

    def load(self) -> None:
        """Read the parameters common to all cameras."""
        if self.element.first("robotNamespace") is not None:
            self.default_namespace = self.model.name
        self.camera_name = self.text("cameraName").strip("/")
        prefix = str(rospy.get_param(f"{self.namespace}/tf_prefix", "")).strip("/")
        self.frame_id = "/".join(filter(None, (prefix, self.frame("frameName", ""))))
        rate = self.number("updateRate", 0.0)
        self.period_ns = round(1e9 / rate) if rate > 0 else 0
        self.lenses: list[Lens] = []
        self._last_ns: int | None = None
        if not self.camera_name:
            rospy.logwarn(
                "dynamic reconfigure is not enabled for this image topic [%s] becuase <cameraName> is not specified",
                self.text("imageTopicName", self.image_topic),
            )
            return
        self._offer_rate()

    def add_lens(self, optics: Optics, suffix: str = "", baseline: float | None = None) -> Lens:
        """Add a camera with topics in CAMERA_NAME/``suffix``. Raise PluginError if its size or field of view is invalid."""
        sizes = (optics.width, optics.height)
        if not (min(sizes) >= 1 and max(sizes) <= MAX_PIXELS and 0 < optics.horizontal_fov < math.pi):
            raise PluginError(
                f"a camera of {optics.width}x{optics.height} pixels and {optics.horizontal_fov} rad is not possible"
            )
        lens = Lens(self, optics, suffix, self.number("hackBaseline", 0.0) if baseline is None else baseline)
        self.lenses.append(lens)
        return lens

    def is_due(self) -> bool:
        """Return whether ``updateRate`` requires a picture now."""
        now_ns = self.simulation.time_ns
        if self._last_ns is not None and 0 <= now_ns - self._last_ns < self.period_ns:
            return False
        self._last_ns = now_ns
        return True

    def sense(self) -> None:
        """Publish a picture from each camera."""
        if self.is_due():
            for lens in self.lenses:
                lens.sense()

    def reset(self) -> None:
        """Start a new update period for all cameras."""
        super().reset()
        self._last_ns = None

    def close(self) -> None:
        """Release OpenGL and unregister the topics."""
        for lens in self.lenses:
            lens.photographer.close()
        super().close()

    def _offer_rate(self) -> None:
        """Make the rate configurable with dynamic_reconfigure. The sensor's rate applies until a client changes the rate."""
        from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure.server import Server

        definition = Definition()
        default, least, greatest = RATES
        text = (
            "Sets the frame rate of the imager. In externally triggered mode this must be more than trig_rate"
        )
        definition.add("imager_rate", "double", 3, text, default, least, greatest)
        started: list[bool] = []

        def change(config: dict[str, float], _level: int) -> dict[str, float]:
            if started:
                rospy.loginfo(
                    "Reconfigure request for the gazebo ros camera_: %s. New rate: %.2f",
                    self.camera_name,
                    config["imager_rate"],
                )
                self.call(lambda: self._set_rate(config["imager_rate"]))
            started.append(True)
            return config

        server = Server(definition, change, self.resolve(self.camera_name))  # type: ignore[arg-type]
        self._closing += [
            server.set_service.shutdown,
            server.descr_topic.unregister,
            server.update_topic.unregister,
        ]

    def _set_rate(self, rate: float) -> None:
        self.rate = rate
        self._timer = None
        self.due_ns = 0


class Lens:
    """One camera of a sensor: its topics and the thread that renders its pictures."""

    def __init__(self, plugin: CameraPlugin, optics: Optics, suffix: str, baseline: float) -> None:
        self.plugin = plugin
        self.optics = optics
        self.folder = "/".join(filter(None, (plugin.camera_name, suffix)))
        self.encoding, is_known = encoding_of(optics.format)
        if not is_known:
            rospy.logerr("Unsupported Gazebo ImageFormat\n")
        self.info = to_camera_info(
            optics, plugin.number, automatic=plugin.flag("autoDistortion", False), baseline=baseline
        )
        self.info.header.frame_id = plugin.frame_id
        self._check_focal_length()
        # A separate random generator for the rendering thread: the simulation's is for the simulation's thread.
        self._random = np.random.default_rng(int(plugin.simulation.random.integers(1 << 32)))
        self.photographer = Photographer(plugin.simulation, optics.width, optics.height)
        self.images = self.publish_to("imageTopicName", plugin.image_topic, Image, latch=True)
        self.infos = self.publish_to("cameraInfoTopicName", plugin.info_topic, CameraInfo)
        if self.folder:
            plugin.serve(f"{self.folder}/set_camera_info", SetCameraInfo, self._set_info)

    def publish_to(
        self, tag: str, topic: str, kind: type[rospy.Message], *, latch: bool = False
    ) -> rospy.Publisher[Any]:
        """Return a publisher in the camera's namespace. The parameter ``tag`` overrides the topic's name."""
        name = self.plugin.text(tag, topic)
        full = name if name.startswith("/") or not self.folder else f"{self.folder}/{name}"
        return self.plugin.output_to(full, kind, latch=latch)

    def sense(self) -> None:
        """Publish a picture and its camera_info. If only camera_info has subscribers, do not render a picture."""
        now = self.plugin.now
        if not self.images.get_num_connections() or self.photographer.is_broken:
            self.publish_info(now, self.infos)
            return
        self.take(lambda renderer: self._publish(renderer, now))

    def take(self, draw: Callable[[Renderer], None]) -> None:
        """Copy the scene now, and call ``draw`` later in the rendering thread."""
        optics = self.optics
        pose = compose(self.plugin.sensor_pose, optics.pose)
        self.photographer.take(pose, optics.horizontal_fov, (optics.near, optics.far), draw)

    def publish_info(self, stamp: Time, publisher: rospy.Publisher[Any]) -> None:
        """Publish camera_info if it has subscribers."""
        if publisher.get_num_connections():
            info = copy.copy(self.info)
            info.header = copy.copy(info.header)
            info.header.stamp = stamp
            publisher.publish(info)

    def to_image(self, renderer: Renderer, stamp: Time) -> Image:
        """Render the picture and return it in the sensor's format."""
        picture = add_noise(renderer.color(), self.optics, self._random)
        image = Image(height=self.optics.height, width=self.optics.width, encoding=self.encoding)
        image.header.stamp, image.header.frame_id = stamp, self.plugin.frame_id
        image.data, image.step = encode(picture, self.encoding)
        return image

    def _publish(self, renderer: Renderer, stamp: Time) -> None:
        self.images.publish(self.to_image(renderer, stamp))
        self.publish_info(stamp, self.infos)

    def _set_info(self, request: SetCameraInfoRequest) -> SetCameraInfoResponse:
        frame = self.info.header.frame_id
        self.info = request.camera_info
        self.info.header.frame_id = frame
        return SetCameraInfoResponse(success=True)

    def _check_focal_length(self) -> None:
        focal, right = self.info.K[0], self.optics.focal_length
        if not math.isclose(focal, right, rel_tol=1e-6):
            rospy.logwarn(
                "<focalLength> %f of sensor '%s' does not match width %d and horizontal_fov %f: %f is right",
                focal,
                self.plugin.sensor.name,
                self.optics.width,
                self.optics.horizontal_fov,
                right,
            )


class Camera(CameraPlugin):
    """libgazebo_ros_camera.so: a single camera."""

    def load(self) -> None:
        """Create the camera, its publishers and its service."""
        super().load()
        self.add_lens(read_optics(self.sensor.element.first("camera")))


class MultiCamera(CameraPlugin):
    """libgazebo_ros_multicamera.so: cameras with ``left`` or ``right`` in their names; their pictures have the same timestamp."""

    def load(self) -> None:
        """Create the cameras, their publishers and their services."""
        super().load()
        for element in self.sensor.element.all("camera"):
            optics = read_optics(element)
            if "left" in optics.name:
                self.add_lens(optics, "left", 0.0)
            elif "right" in optics.name:
                self.add_lens(optics, "right")
        if not self.lenses:
            raise PluginError("no <camera> has a name with 'left' or 'right'")
