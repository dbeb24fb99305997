"""The simulation with its plugins and publishers: /clock, the states of models and links, markers for the 3D view."""

from __future__ import annotations

from gazebo_msgs.msg import LinkStates, ModelStates, PerformanceMetrics
from rosgraph_msgs.msg import Clock

from minirospy import client as rospy
from minirospy.base.clock import SimulatedClock
from minirospy.core.sdf.model import Light, Model, Pose, Vector, World
from minirospy.ros.gazebo_ros.loop import LoopClosed, SimulationLoop
from minirospy.ros.gazebo_ros.markers import WorldMarkers
from minirospy.ros.gazebo_ros.messages import time_of, to_pose, to_twist
from minirospy.ros.gazebo_ros.paths import ResourcePaths
from minirospy.ros.gazebo_ros.physics import LostModel, SimModel, State
from minirospy.ros.gazebo_ros.plugins import PluginHost
from minirospy.ros.gazebo_ros.window import Window

__all__ = ["Server"]

METRICS_SECONDS = 1.0  # simulated seconds between messages on /gazebo/performance_metrics


class Server:
    """Runs the world: its loop, plugins and topics.

    lights: by name; they do not affect the physics. clock: this process's own clock, or None if it uses wall time.
    """

    def __init__(
        self,
        loop: SimulationLoop,
        world: World,
        resources: ResourcePaths,
        clock: SimulatedClock | None,
        *,
        only_clock: bool,
    ) -> None:
        self.loop = loop
        self.resources = resources
        self.lights: dict[str, Light] = {light.name: light for light in world.lights}
        self.plugins = PluginHost(loop)
        self._clock = clock
        self._clock_publisher = rospy.Publisher("/clock", Clock, queue_size=10)
        self._published_ns = -1
        self._told = len(loop.simulation.warnings)  # warnings already logged; gzserver logs the initial ones
        self._states: _StatePublishers | None = None
        self._markers: WorldMarkers | None = None
        self._window: Window | None = None
        if not only_clock:
            self._states = _StatePublishers(loop)
            self._markers = WorldMarkers(loop.simulation)
            self._window = Window(loop, self.plugins, world, resources.models)
        loop.before_step = self.plugins.update
        loop.on_tick = self._tick
        loop.on_lost = self._lost
        loop.on_failure = self._fail

    def start(self, world: World) -> None:
        """Load the world file's plugins, and publish the markers. Call this in the loop's thread."""
        self.plugins.add_world(world.plugins)
        for model in list(self.loop.simulation.models.values()):
            self.plugins.add_model(model)
        self._changed()

    def add_model(self, model: Model, pose: Pose, name: str) -> None:
        """Add a model and load its plugins. Raise SimulationError on failure. Call this in the loop's thread."""
        added: SimModel = self.loop.simulation.add_model(model, pose, name)
        self.plugins.add_model(added)
        self._changed()

    def remove_model(self, name: str) -> None:
        """Remove a model and its plugins. Call this in the loop's thread."""
        self.plugins.remove_model(name)
        self.loop.simulation.remove_model(name)
        self._changed()

    def moved(self, name: str, before: Pose) -> None:
        """Publish the states now if the simulation is paused. Call this in the loop's thread.

        A static model's shapes are published if its pose has changed.
        """
        model = self.loop.simulation.models[name]
        if self._window is not None and model.is_static and model.pose != before:
            self._window.changed()
        if self.loop.is_paused:
            self._publish_states()

    def set_physics(self, step: float, update_rate: float, gravity: Vector) -> None:
        """Set the engine's parameters. Raise SimulationError if one is invalid. Call this in the loop's thread."""
        simulation = self.loop.simulation
        physics = simulation.physics._replace(step=step, update_rate=update_rate, gravity=gravity)
        simulation.set_physics(physics)
        self.loop.set_update_rate(update_rate)

    def reset(self, *, with_time: bool) -> None:
        """Reset the models; if ``with_time``, also reset the time and the plugins. Call this in the loop's thread."""
        self.loop.reset(with_time=with_time)
        if self._window is not None:
            self._window.changed()  # the reset may have moved static models
        if with_time:
            self.plugins.reset()

    def close(self) -> None:
        """Close the plugins and stop the loop."""
        if self._window is not None:
            self._window.close()
        try:
            self.loop.call(self.plugins.close)
        except LoopClosed:
            self.plugins.close()
        finally:
            self.loop.close()

    def _changed(self) -> None:
        if self._markers is not None:
            self._markers.publish_all()
        if self._window is not None:
            self._window.changed()
        self._publish_states()

    def _lost(self, lost: LostModel) -> None:
        rospy.logerr("model '%s' %s", lost.name, lost.reason)
        self.plugins.remove_model(lost.name)
        self._changed()

    @staticmethod
    def _fail(error: Exception) -> None:
        rospy.logfatal("the simulation failed: %s: %s", type(error).__name__, error)
        rospy.signal_shutdown("the simulation failed")

    def _tick(self) -> None:
        now = self.loop.simulation.time_ns
        if self._clock is not None:
            self._clock.set(now)
        # While paused, publish only the new time after a reset or a single step.
        if now != self._published_ns:
            self._published_ns = now
            self._clock_publisher.publish(Clock(time_of(now)))
        self._publish_states()
        for line in self.loop.simulation.warnings[self._told :]:
            rospy.logwarn("%s", line)
            self._told += 1

    def _publish_states(self) -> None:
        if self._states is not None:
            self._states.publish()
        if self._markers is not None:
            self._markers.publish_moved()


class _StatePublishers:
    """Publishes states if they have subscribers."""

    def __init__(self, loop: SimulationLoop) -> None:
        self._loop = loop
        self._models = rospy.Publisher("~model_states", ModelStates, queue_size=10)
        self._links = rospy.Publisher("~link_states", LinkStates, queue_size=10)
        self._metrics = rospy.Publisher("~performance_metrics", PerformanceMetrics, queue_size=10)
        self._next_metrics = 0

    def publish(self) -> None:
        models = self._loop.simulation.models.values()
        if self._models.get_num_connections():
            message = ModelStates()
            for model in models:
                _append(message, model.name, model.state)
            self._models.publish(message)
        if self._links.get_num_connections():
            links = LinkStates()
            for model in models:
                for link in model.links.values():
                    _append(links, link.scoped_name, link.state)
            self._links.publish(links)
        now = self._loop.simulation.time_ns
        if not 0 <= self._next_metrics - now <= METRICS_SECONDS * 1e9:
            self._next_metrics = now + round(METRICS_SECONDS * 1e9)
            if self._metrics.get_num_connections():
                metrics = PerformanceMetrics(real_time_factor=self._loop.real_time_factor)
                metrics.header.stamp = time_of(now)
                self._metrics.publish(metrics)


def _append(message: ModelStates | LinkStates, name: str, state: State) -> None:
    message.name.append(name)
    message.pose.append(to_pose(state.pose))
    message.twist.append(to_twist(state.linear, state.angular))
