"""Colour and depth pictures of the world, rendered off-screen.

A :class:`Renderer` belongs to the thread that creates it. Only ``capture`` reads the simulation; it runs in the simulation's
thread and does not use OpenGL. ``color`` and ``depth`` only draw, and may run while the simulation steps.
"""

from __future__ import annotations

import math
import os
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from minirospy.core.sdf.model import Pose
from minirospy.core.sdf.poses import rotate
from minirospy.ros.gazebo_ros.physics.engine import Engine
from minirospy.ros.gazebo_ros.physics.library import SimulationError, import_context
from minirospy.ros.gazebo_ros.physics.shapes import GROUP_VISUAL

__all__ = ["MAX_PIXELS", "Renderer"]

MAX_GEOMS = 20_000  # per picture
MAX_PIXELS = 4096  # per side
SPARE_GEOMS = 100  # spare capacity for shapes that are not geoms, such as lights
_VARIABLE = "MUJOCO_GL"


class Renderer:
    """Renders pictures of a fixed size."""

    def __init__(self, engine: Engine, width: int, height: int) -> None:
        """Open an OpenGL context. On failure, raise SimulationError with the library to install."""
        if not (0 < width <= MAX_PIXELS and 0 < height <= MAX_PIXELS):
            raise SimulationError(f"a picture of {width}x{height} is not possible: at most {MAX_PIXELS}")
        self.engine = engine
        self._mujoco = engine.mujoco
        self.width, self.height = width, height
        self.backend, self._gl = open_context(width, height)
        self._generation = -1
        self._model: Any = None  # the compiled model of the scene
        self._loaded: object = None  # the model whose meshes the context has loaded
        self._scene: Any = None
        self._context: Any = None
        self._near, self._far = 0.1, 100.0
        self._area = self._mujoco.MjrRect(0, 0, width, height)
        self._option = self._mujoco.MjvOption()
        self._option.geomgroup[:] = 0
        self._option.geomgroup[GROUP_VISUAL] = 1

    def capture(self, pose: Pose, horizontal_fov: float, near: float = 0.1, far: float = 100.0) -> None:
        """Copy the world as seen from a pose (x forward, z up). The angle is in radians, distances are in metres."""
        engine, mujoco = self.engine, self._mujoco
        engine.refresh()
        if self._generation != engine.generation:
            self._model = engine.model
            self._scene = mujoco.MjvScene(engine.model, min(engine.model.ngeom + SPARE_GEOMS, MAX_GEOMS))
            self._generation = engine.generation
        camera = mujoco.MjvCamera()
        mujoco.mjv_updateScene(
            engine.model, engine.data, self._option, None, camera, mujoco.mjtCatBit.mjCAT_ALL, self._scene
        )
        self._near, self._far = near, far
        half = near * math.tan(min(max(horizontal_fov, 0.01), 3.1) / 2)
        for each in self._scene.camera:
            each.pos = pose.position
            each.forward = rotate(pose.orientation, (1.0, 0.0, 0.0))
            each.up = rotate(pose.orientation, (0.0, 0.0, 1.0))
            each.frustum_center = 0.0
            each.frustum_width = half
            each.frustum_top = half * self.height / self.width
            each.frustum_bottom = -each.frustum_top
            each.frustum_near, each.frustum_far = near, far

    def color(self) -> NDArray[np.uint8]:
        """Return the captured picture as an RGB array (height, width, 3), top row first."""
        picture: NDArray[np.uint8] = np.empty((self.height, self.width, 3), np.uint8)
        self._draw()
        self._mujoco.mjr_readPixels(picture, None, self._area, self._context)
        return picture[::-1]

    def depth(self) -> NDArray[np.float32]:
        """Return distances along the camera's axis (height, width) in metres, infinite if a pixel shows nothing."""
        values = np.empty((self.height, self.width), np.float32)
        self._draw(has_background=False)
        self._mujoco.mjr_readPixels(None, values, self._area, self._context)
        # The depth buffer is 1 at the near plane and 0 at the far plane.
        near, far = self._near, self._far
        with np.errstate(divide="ignore"):
            distances = near * far / (near + values[::-1].astype(np.float64) * (far - near))
        distances[values[::-1] <= 0] = np.inf
        return distances.astype(np.float32)

    def close(self) -> None:
        """Release the OpenGL context."""
        if self._context is not None:
            self._gl.make_current()
            self._context.free()
            self._context = None
        if self._gl is not None:
            self._gl.free()
            self._gl = None

    def _load(self) -> None:
        """Load the meshes of the captured model into the context."""
        model, mujoco = self._model, self._mujoco
        if self._context is not None:
            self._context.free()
        model.vis.global_.offwidth = self.width
        model.vis.global_.offheight = self.height
        # Disable multisampling, which would take depths from points beside the pixel's centre.
        model.vis.quality.offsamples = 0
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        self._loaded = model

    def _draw(self, *, has_background: bool = True) -> None:
        if self._scene is None:
            raise SimulationError("a picture is drawn after it is captured")
        self._scene.flags[self._mujoco.mjtRndFlag.mjRND_SKYBOX] = has_background
        self._gl.make_current()
        if self._loaded is not self._model:
            self._load()
        self._mujoco.mjr_render(self._area, self._scene, self._context)


def open_context(width: int, height: int) -> tuple[str, Any]:
    """Return the first backend that works, and its context. ``MUJOCO_GL`` selects a specific one."""
    wanted = os.environ.get(_VARIABLE, "").lower()
    backends = [wanted] if wanted in ("egl", "osmesa", "glfw") else _backends()
    faults: list[str] = []
    for backend in backends:
        before = os.environ.get("PYOPENGL_PLATFORM")
        try:
            context = import_context(backend)(width, height)
            context.make_current()
        except Exception as error:  # noqa: BLE001 (OpenGL's libraries raise errors of many types)
            faults.append(f"{backend}: {' '.join(str(error).split())[:100] or type(error).__name__}")
            # PyOpenGL reads its platform from this variable, and the next backend needs a different platform.
            if before is None:
                os.environ.pop("PYOPENGL_PLATFORM", None)
            continue
        return backend, context
    raise SimulationError(f"cameras need OpenGL: {_advice(faults)} ({'; '.join(faults)})")


def _backends() -> list[str]:
    if sys.platform == "linux":
        return ["egl", "osmesa", "glfw"]
    return ["glfw"] if sys.platform != "darwin" else ["cgl", "glfw"]


def _advice(faults: list[str]) -> str:
    from importlib.util import find_spec

    if find_spec("OpenGL") is None or find_spec("glfw") is None:
        from minirospy.base.installation import install_command

        return install_command("mujoco-core[rendering]")
    if sys.platform == "linux":
        return "sudo apt install libegl1 libgl1-mesa-dri, or libosmesa6"
    return "this machine has no usable graphics driver"
