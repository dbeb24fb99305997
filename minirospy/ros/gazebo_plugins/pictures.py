"""A thread that draws the pictures of all cameras, so that the physics does not wait for OpenGL.

A camera copies the scene between two steps, and this thread draws the copy. If a camera's last picture is not finished, it skips
the next one: as in Gazebo, the rate drops if the computer is too slow.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from minirospy import client as rospy
from minirospy.core.sdf.model import Pose
from minirospy.ros.gazebo_ros.physics import Simulation, SimulationError

if TYPE_CHECKING:
    from minirospy.ros.gazebo_ros.physics.rendering import Renderer

__all__ = ["Photographer", "to_depths"]

Draw = Callable[["Renderer"], None]

MAX_CLOSING_SECONDS = 5.0  # timeout in seconds for unfinished pictures when closing


class _DrawingThread:
    """Runs jobs in a thread that owns the OpenGL contexts. The thread ends when the last camera calls :meth:`leave`."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._users = 0
        self._jobs: queue.SimpleQueue[Callable[[], object] | None] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None
        self._is_warned = False

    def join(self) -> None:
        """Register a camera; the first one starts the thread."""
        with self._lock:
            self._users += 1
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="cameras", daemon=True)
                self._thread.start()

    def leave(self) -> None:
        """Unregister a camera. After the last one, wait until the thread has ended."""
        with self._lock:
            self._users -= 1
            thread, is_last = self._thread, not self._users
            if is_last:
                self._thread = None
                self._jobs.put(None)
        if is_last and thread is not None:
            thread.join(MAX_CLOSING_SECONDS)

    def run(self, job: Callable[[], object]) -> None:
        """Queue a job for the thread."""
        self._jobs.put(job)

    def warn_once(self, error: Exception) -> None:
        """Log once, for all cameras, why they publish no pictures."""
        if not self._is_warned:
            self._is_warned = True
            rospy.logwarn("cameras publish no pictures: %s", error)

    def _run(self) -> None:
        while (job := self._jobs.get()) is not None:
            try:
                job()
            except Exception as error:  # noqa: BLE001 - OpenGL's libraries raise errors of many types
                self.warn_once(error)


_thread = _DrawingThread()


class Photographer:
    """Renders one camera's pictures in the drawing thread.

    simulation: used only in its own thread. width, height: the size of the pictures.
    """

    def __init__(self, simulation: Simulation, width: int, height: int) -> None:
        self._simulation = simulation
        self._size = (width, height)
        self._renderer: Renderer | None = None
        self._is_opening = False
        self._is_busy = False
        self._is_closed = False
        self.is_broken = False  # whether OpenGL is missing
        _thread.join()

    def take(self, pose: Pose, horizontal_fov: float, clip: tuple[float, float], draw: Draw) -> bool:
        """Copy the scene now and call ``draw`` later in the drawing thread. Return False if no picture can be taken now.

        No picture can be taken if OpenGL is missing or not open yet, or if the last picture is not finished. Call this in the
        simulation's thread.
        """
        renderer = self._renderer
        if renderer is None:
            if not self._is_opening:
                self._is_opening = True
                _thread.run(self._open)
            return False
        if self._is_busy:
            return False
        self._simulation.add_visuals()
        renderer.capture(pose, horizontal_fov, *clip)
        self._is_busy = True
        _thread.run(lambda: self._draw(renderer, draw))
        return True

    def close(self) -> None:
        """Release the OpenGL context."""
        if not self._is_closed:
            self._is_closed = True
            _thread.run(self._free)
            _thread.leave()

    def _open(self) -> None:
        if self._is_closed:
            return
        try:
            self._renderer = self._simulation.open_renderer(*self._size)
        except SimulationError as error:
            self.is_broken = True
            _thread.warn_once(error)

    def _draw(self, renderer: Renderer, draw: Draw) -> None:
        try:
            if not self._is_closed:
                draw(renderer)
        finally:
            self._is_busy = False

    def _free(self) -> None:
        if self._renderer is not None:
            self._renderer.close()


def to_depths(renderer: Renderer, far: float) -> NDArray[np.float32]:
    """Return the captured depths in m. Pixels that show no object have the depth ``far``."""
    depths: NDArray[np.float32] = np.minimum(renderer.depth(), np.float32(far))
    return depths
