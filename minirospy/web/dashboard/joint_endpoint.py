"""A robot's joints for the page: joint_state_publisher_gui with its sliders in a browser, as JSON over WebSocket.

A client sends ``{"op": NAME, ...}``: set {positions: {joint: number}}, center, randomize, publish {on}, reload. The
server sends ``{"writes"}``, ``{"joints": {"robot", "rows", "rate", ...} or null, "why"}``, ``{"state": {"positions",
"publishing", "others"}}`` and ``{"error"}``. All clients set the same joints. See
minirospy/ros/robot_state_publisher/joint_parameters.py for parameters and zero positions.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import math
import random
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, ClassVar

from minirospy.aio.tasks import ErrorReporter, keep_running
from minirospy.base.errors import MinirospyError, ROSException, UrdfError, UsageError
from minirospy.core.urdf.elements import parse_xml
from minirospy.introspect.graph import why_illegal
from minirospy.ros.robot_state_publisher.joint_parameters import NAMES, JointParameters, read_parameters
from minirospy.ros.robot_state_publisher.joints import FreeJoint, JointError, JointStates, read_joints
from minirospy.web.dashboard.json_session import (
    Fields,
    Handler,
    JsonEndpoint,
    JsonSession,
    number,
    wait_until,
)

if TYPE_CHECKING:
    from sensor_msgs.msg import JointState

    from minirospy.aio.node import Node
    from minirospy.aio.topics import Publisher
    from minirospy.introspect.snapshot import Changes
    from minirospy.web.graph import SharedGraph
    from minirospy.web.server.client import WebClient

__all__ = ["SUBPROTOCOL", "JointEndpoint", "JointSession"]

SUBPROTOCOL = "minirospy.joints.v1"

_log = logging.getLogger(__name__)

_RELOAD_SECONDS = 2.0
_TOPIC = "joint_states"
_FARTHEST = 1e6


class JointEndpoint(JsonEndpoint["JointSession"]):
    """Serves the joints of the robot in robot_description.

    ``always_publishes``: publish even without clients, as the node joint_state_publisher_gui does.
    """

    def __init__(
        self, node: Node, graph: Callable[[], SharedGraph], *, always_publishes: bool = False
    ) -> None:
        super().__init__(SUBPROTOCOL, lambda client: JointSession(self, client))
        self.node = node
        self.always_publishes = always_publishes
        self.joints: JointStates | None = None
        self.parameters: JointParameters | None = None
        self.why = ""  # the reason why there are no joints, or ""
        self.warnings: list[str] = []
        self.kinds: dict[str, str] = {}
        self.robot = ""
        self.generation = 0  # number of descriptions that have been read
        self.is_publishing = False
        self._graph = graph
        self._values: dict[str, object] = {}
        self._publisher: Publisher[JointState] | None = None
        self._working: asyncio.Task[None] | None = None
        self._work_changed = asyncio.Event()
        self._reporter = ErrorReporter(_log, "following and publishing joints")
        self._sources: list[asyncio.Task[None]] = []

    # --- Endpoint

    def open(self, client: WebClient) -> JointSession:
        """See :meth:`JsonEndpoint.open`."""
        if not self.sessions:
            self._graph().watch(self._graph_changed)
        self.start_work()
        return super().open(client)

    def left(self, session: JointSession) -> None:
        """See :meth:`JsonEndpoint.left`. Stops publishing after the last client, unless ``always_publishes`` is set."""
        if not self.sessions:
            self._graph().unwatch(self._graph_changed)
            self.publish(is_on=False)

    def _graph_changed(self, _: Changes) -> None:
        self.changed()

    def publish(self, *, is_on: bool) -> None:
        """Start or stop publishing the joints. Raise UsageError if clients may not publish the topic."""
        topic = self.node.resolve(_TOPIC)
        if is_on and not self._graph().filters.publishable(topic):
            raise UsageError(f"topic [{topic}] may not be published by clients")
        self.is_publishing = is_on or self.always_publishes
        self._work_changed.set()
        self.changed()

    async def close(self) -> None:
        """End all sessions and stop publishing. Idempotent."""
        await super().close()
        working, self._working = self._working, None
        tasks = [*self._sources, *([working] if working else [])]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        if self._publisher:
            await self._publisher.close()
            self._publisher = None

    # --- joints

    def start_work(self) -> None:
        """Start the task that watches the parameters and publishes the joint states.

        The task runs while there are clients, or always if ``always_publishes`` is set.
        """
        if self._working is None or self._working.done():
            self.is_publishing = self.is_publishing or self.always_publishes
            self._working = asyncio.ensure_future(keep_running(self._work, self._reporter))

    async def _work(self) -> None:
        loop = asyncio.get_running_loop()
        next_load = loop.time()
        next_message = loop.time()
        self._follow(self._legal_sources())

        while self.sessions or self.always_publishes or self._publisher:
            self._work_changed.clear()
            now = loop.time()
            if now >= next_load:
                next_load = now + _RELOAD_SECONDS
                with contextlib.suppress(MinirospyError):  # the master is unreachable: retry later
                    await self.load()
            end = next_load
            if self.parameters and self.is_publishing:
                if loop.time() >= next_message:
                    await self._publish()
                    next_message = max(next_message + 1 / self.parameters.rate, loop.time())
                end = min(end, next_message)
            elif self._publisher:
                publisher, self._publisher = self._publisher, None
                await publisher.close()
            await wait_until(self._work_changed, end)
        # Unsubscribe, because the next page's task subscribes again.
        self._follow([])

    async def load(self, *, is_forced: bool = False) -> None:
        """Read the parameters; if one of them has changed, parse the description again.

        Raise MinirospyError if the master cannot be reached.
        """
        private = await self.node.get_param("~", {})
        values: dict[str, object] = {}
        missing = object()
        for name in NAMES:
            if isinstance(private, dict) and name in private:
                values[f"~{name}"] = private[name]
            if f"~{name}" not in values or name == "zeros":
                found = await self.node.get_param(name, missing)
                if found is not missing:
                    values[name] = found
        if values == self._values and self.generation and not is_forced:
            return

        warnings: list[str] = []
        zeros = [values.get(key, {}) for key in ("~zeros", "zeros")]
        parameters: JointParameters | None = None
        joints: JointStates | None = None
        robot, kinds, missing_because = self.robot, self.kinds, ""
        try:
            parameters = read_parameters(
                lambda name, default: values.get(f"~{name}", values.get(name, default)), zeros
            )
            # Parse in a thread, because that takes seconds for a large description.
            loop = asyncio.get_running_loop()
            joints, robot, kinds = await loop.run_in_executor(None, _described, parameters, warnings.append)
        except (JointError, UrdfError) as error:
            parameters = None
            missing_because = str(error)
        warnings += [
            f"The source_list parameter has [{topic[:200]}]: {why}"
            for topic in (parameters.sources if parameters else [])
            if (why := why_illegal(topic))
        ]

        # Complete the data before incrementing the counter, because clients receive each generation only once.
        self._values, self.parameters, self.joints = values, parameters, joints
        self.robot, self.kinds, self.warnings, self.why = robot, kinds, warnings, missing_because
        self.generation += 1
        self._follow(self._legal_sources())
        self.changed()

    def _legal_sources(self) -> list[str]:
        sources = self.parameters.sources if self.parameters else []
        return [topic for topic in sources if not why_illegal(topic)]

    def _follow(self, topics: Sequence[str]) -> None:
        """Subscribe to these topics, and to no others."""
        from sensor_msgs.msg import JointState

        for task in self._sources:
            task.cancel()

        async def follow(topic: str) -> None:
            subscription = self.node.subscribe(topic, JointState)
            try:
                async for state in subscription:
                    if self.joints:
                        self.joints.update(state.name, state.position, state.velocity, state.effort)
                        self.changed()
            finally:
                await subscription.close()

        self._sources = [
            asyncio.ensure_future(keep_running(partial(follow, topic), self._reporter)) for topic in topics
        ]

    async def _publish(self) -> None:
        from sensor_msgs.msg import JointState

        if not self.joints or not self.parameters:
            return
        if self._publisher is None:
            self._publisher = self.node.advertise(_TOPIC, JointState, queue_size=5)
        if self.parameters.delta > 0:
            self.joints.advance(self.parameters.delta)
        values = self.joints.values()
        if values.name:
            state = JointState(name=values.name, position=values.position)
            state.velocity, state.effort = values.velocity, values.effort
            state.header.stamp = self.node.now()
            with contextlib.suppress(ROSException):  # the node is being shut down
                await self._publisher.publish(state)
        if self.parameters.delta > 0:
            self.changed()

    def set(self, positions: Mapping[str, float]) -> None:
        """Set joint positions within their limits. Raise UsageError if a joint cannot be set."""
        free = self._free()
        for name in positions:
            if name not in free:
                raise UsageError(f"there is no joint [{name[:200]}] that can be set")
        for name, position in positions.items():
            free[name].position = min(max(position, free[name].lower), free[name].upper)
        self.changed()

    def center(self) -> None:
        """Set all joints to their zero positions."""
        for joint in self._free().values():
            joint.position = joint.zero
        self.changed()

    def randomize(self) -> None:
        """Set all joints to random positions within their limits."""
        for joint in self._free().values():
            joint.position = random.uniform(joint.lower, joint.upper)
        self.changed()

    def _free(self) -> dict[str, FreeJoint]:
        return self.joints.free if self.joints else {}

    def description(self) -> dict[str, object]:
        """Return the joints without their positions, for the page."""
        joints, parameters = self.joints, self.parameters
        if joints is None or parameters is None:
            return {"joints": None, "why": self.why}
        rows = []
        for name in joints.names:
            free = joints.free.get(name)
            limits = [_finite(each) for each in (free.lower, free.upper, free.zero)] if free else None
            rows.append([name, self.kinds.get(name, "revolute"), limits])
        found = {
            "robot": self.robot,
            "rows": rows,
            "rate": parameters.rate,
            "sources": parameters.sources,
            "warnings": self.warnings,
            "topic": self.node.resolve(_TOPIC),
            "always": self.always_publishes,
        }
        return {"joints": found, "why": ""}

    def state(self) -> dict[str, object]:
        """Return the positions of all joints, including mimic joints, and the other publishers of the topic."""
        values = self.joints.values() if self.joints else None
        # A source may publish NaN or infinity, which JSON cannot represent.
        pairs = zip(values.name, values.position, strict=False) if values else ()
        positions = {name: position if math.isfinite(position) else None for name, position in pairs}
        publishers = self._graph().snapshot.publishers.get(self.node.resolve(_TOPIC), ())
        others = [each for each in publishers if each != self.node.name]
        return {"positions": positions, "publishing": self.is_publishing, "others": others}


class JointSession(JsonSession):
    """The session of one client."""

    subject: ClassVar[str] = "joints"

    def __init__(self, endpoint: JointEndpoint, client: WebClient) -> None:
        self._endpoint = endpoint
        self._generation = 0
        self._sent = ""
        handlers: Mapping[str, Handler] = {
            "set": self._set,
            "center": self._center,
            "randomize": self._randomize,
            "publish": self._publish,
            "reload": self._reload,
        }
        super().__init__(client, handlers)

    def refusal(self) -> str:
        """See :meth:`JsonSession.refusal`."""
        return "" if self.client.may_write else "this token is read-only: it sets no joints"

    async def follow(self) -> None:
        """Send the joints' positions; if the joints have been reloaded, send the joints first."""
        if self._generation != self._endpoint.generation:
            self._generation = self._endpoint.generation
            self.send(self._endpoint.description())
        text = json.dumps({"state": self._endpoint.state()})
        if text != self._sent:
            self._sent = text
            self.client.send_text_message("state", text.encode(), newest_only=True)

    async def _set(self, fields: Fields) -> None:
        self._endpoint.set(_positions(fields))

    async def _center(self, _: Fields) -> None:
        self._endpoint.center()

    async def _randomize(self, _: Fields) -> None:
        self._endpoint.randomize()

    async def _publish(self, fields: Fields) -> None:
        self._endpoint.publish(is_on=bool(fields["on"]))

    async def _reload(self, _: Fields) -> None:
        await self._endpoint.load(is_forced=True)


def _finite(value: float) -> float:
    """Replace an infinite limit with a large finite number, because JSON cannot represent infinity."""
    return min(max(value, -_FARTHEST), _FARTHEST) if not math.isnan(value) else 0.0


def _positions(fields: Fields) -> dict[str, float]:
    positions = fields["positions"]
    if not isinstance(positions, dict):
        raise TypeError("positions is an object")
    return {name: number(value) for name, value in positions.items()}


def _described(
    parameters: JointParameters, warn: Callable[[str], None]
) -> tuple[JointStates, str, dict[str, str]]:
    """Parse a description. Return the joints, the robot's name, and each joint's type.

    Raise UrdfError or JointError if the description is invalid.
    """
    joints = read_joints(parameters.description, parameters.options, warn)
    return (joints, *_kinds(parameters.description))


def _kinds(description: str) -> tuple[str, dict[str, str]]:
    """Return the robot's name, and a dict from joint name to joint type; the type determines the unit of a position."""
    root = parse_xml(description, "robot_description")
    kinds = {
        joint.attributes.get("name", ""): joint.attributes.get("type", "") for joint in root.all("joint")
    }
    return root.attributes.get("name", ""), kinds
