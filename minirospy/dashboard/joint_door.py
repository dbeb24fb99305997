"""The joints of a robot for the page: joint_state_publisher_gui, with its sliders in a browser, by JSON over WebSocket.

A client sends ``{"op": NAME, ...}``: set {positions: {joint: number}}, center, randomize, publish {on}, reload. The server sends
``{"writes"}``, ``{"joints": {"robot", "rows", "rate", ...} or null, "why"}``, ``{"state": {"positions", "publishing",
"others"}}`` and ``{"error"}``. All clients set the same joints. Parameters and zeros: see minirospy/robots/joint_parameters.py.
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
from typing import TYPE_CHECKING

from minirospy.bridge.tasks import Faults, keep_running
from minirospy.errors import MinirospyError, ROSException, UrdfError, UsageError
from minirospy.robots.joint_parameters import NAMES, JointParameters, read_parameters
from minirospy.robots.joints import FreeJoint, JointError, JointStates, read_joints
from minirospy.urdf.elements import parse_xml

if TYPE_CHECKING:
    from sensor_msgs.msg import JointState

    from minirospy.aio.node import Node
    from minirospy.aio.topics import Publisher
    from minirospy.bridge.graph import SharedGraph
    from minirospy.bridge.web.client import WebClient

__all__ = ["SUBPROTOCOL", "JointDoor", "JointSession"]

SUBPROTOCOL = "minirospy.joints.v1"

_log = logging.getLogger(__name__)

_LOOK_SECONDS = 0.05
_RELOAD_SECONDS = 2.0
_TOPIC = "joint_states"
_FARTHEST = 1e6
_Fields = Mapping[str, object]


class JointDoor:
    """Serves the joints of robot_description. ``always_publishes``: as the node joint_state_publisher_gui does."""

    def __init__(
        self, node: Node, graph: Callable[[], SharedGraph], *, always_publishes: bool = False
    ) -> None:
        self.node = node
        self.always_publishes = always_publishes
        self.joints: JointStates | None = None
        self.parameters: JointParameters | None = None
        self.why = ""
        """Why there are no joints."""
        self.warnings: list[str] = []
        self.kinds: dict[str, str] = {}
        self.robot = ""
        self.generation = 0
        """Counts descriptions that were read."""
        self.is_publishing = False
        self._graph = graph
        self._sessions: set[asyncio.Task[None]] = set()
        self._values: dict[str, object] = {}
        self._publisher: Publisher[JointState] | None = None
        self._working: asyncio.Task[None] | None = None
        self._sources: list[asyncio.Task[None]] = []
        self._faults = Faults(_log, "following and publishing joints")

    # --- Door

    def select(self, offered: Sequence[str]) -> str:
        """Return the sub-protocol to use. Raise LookupError."""
        if SUBPROTOCOL in offered:
            return SUBPROTOCOL
        raise LookupError(f"sub-protocol {SUBPROTOCOL} is required")

    def open(self, client: WebClient) -> JointSession:
        """Start serving a client."""
        session = JointSession(self, client)
        self._sessions.add(session.task)
        session.task.add_done_callback(self._left)
        self.start_work()
        return session

    def _left(self, task: asyncio.Task[None]) -> None:
        self._sessions.discard(task)
        if not self._sessions and not self.always_publishes:
            self.is_publishing = False

    async def close(self) -> None:
        """End all sessions, and publish nothing any more. Idempotent."""
        working, self._working = self._working, None
        tasks = [*self._sessions, *self._sources, *([working] if working else [])]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        if self._publisher:
            await self._publisher.close()
            self._publisher = None

    # --- the joints

    def start_work(self) -> None:
        """Follow the parameters, and publish where wanted, from now on, while there is somebody who wants that."""
        if self._working is None or self._working.done():
            self.is_publishing = self.is_publishing or self.always_publishes
            self._working = asyncio.ensure_future(keep_running(self._work, self._faults))

    async def _work(self) -> None:
        loop = asyncio.get_running_loop()
        next_load = loop.time()
        next_message = loop.time()

        while self._sessions or self.always_publishes or self._publisher:
            now = loop.time()
            if now >= next_load:
                next_load = now + _RELOAD_SECONDS
                with contextlib.suppress(MinirospyError):  # no master for a while
                    await self.load()
            pause = next_load - loop.time()
            if self.parameters and self.is_publishing:
                if loop.time() >= next_message:
                    await self._publish()
                    next_message = max(next_message + 1 / self.parameters.rate, loop.time())
                pause = min(pause, next_message - loop.time())
            elif self._publisher:
                publisher, self._publisher = self._publisher, None
                await publisher.close()
            else:
                pause = min(pause, _LOOK_SECONDS)
            await asyncio.sleep(max(0.0, pause))

    async def load(self, *, is_forced: bool = False) -> None:
        """Read the parameters, and the description again where one has changed. Raise MinirospyError."""
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

        self._values = values
        self.generation += 1
        self.warnings = []
        zeros = [values.get(key, {}) for key in ("~zeros", "zeros")]
        try:
            self.parameters = read_parameters(
                lambda name, default: values.get(f"~{name}", values.get(name, default)), zeros
            )
            description = self.parameters.description
            self.joints = read_joints(description, self.parameters.options, self.warnings.append)
            self.robot, self.kinds = _kinds(description)
            self.why = ""
        except (JointError, UrdfError) as error:
            self.joints = self.parameters = None
            self.why = str(error)
        self._follow(self.parameters.sources if self.parameters else [])

    def _follow(self, topics: Sequence[str]) -> None:
        """Follow the topics of source_list, and no others."""
        from sensor_msgs.msg import JointState

        for task in self._sources:
            task.cancel()

        async def follow(topic: str) -> None:
            subscription = self.node.subscribe(topic, JointState)
            try:
                async for state in subscription:
                    if self.joints:
                        self.joints.update(state.name, state.position, state.velocity, state.effort)
            finally:
                await subscription.close()

        self._sources = [
            asyncio.ensure_future(keep_running(partial(follow, topic), self._faults)) for topic in topics
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

    def set(self, positions: Mapping[str, float]) -> None:
        """Set joints, within their limits. Raise UsageError on a joint that cannot be set."""
        free = self._free()
        for name, position in positions.items():
            if name not in free:
                raise UsageError(f"there is no joint [{name[:200]}] that can be set")
            free[name].position = min(max(position, free[name].lower), free[name].upper)

    def center(self) -> None:
        """Set all joints to their zeros."""
        for joint in self._free().values():
            joint.position = joint.zero

    def randomize(self) -> None:
        """Set all joints anywhere between their limits."""
        for joint in self._free().values():
            joint.position = random.uniform(joint.lower, joint.upper)

    def _free(self) -> dict[str, FreeJoint]:
        return self.joints.free if self.joints else {}

    def description(self) -> dict[str, object]:
        """Return what the page shows of the joints, but for their positions."""
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
        """Return the positions of all joints, also of those that follow others, and who publishes."""
        values = self.joints.values() if self.joints else None
        # A source may publish what JSON does not have.
        pairs = zip(values.name, values.position, strict=False) if values else ()
        positions = {name: position if math.isfinite(position) else None for name, position in pairs}
        publishers = self._graph().snapshot.publishers.get(self.node.resolve(_TOPIC), ())
        others = [each for each in publishers if each != self.node.name]
        return {"positions": positions, "publishing": self.is_publishing, "others": others}


class JointSession:
    """One client."""

    def __init__(self, door: JointDoor, client: WebClient) -> None:
        self._door = door
        self._client = client
        self._is_reload_wanted = False
        self._generation = -1
        self._sent = ""
        self._handlers: Mapping[str, Callable[[_Fields], None]] = {
            "set": lambda fields: self._door.set(_positions(fields)),
            "center": lambda _: self._door.center(),
            "randomize": lambda _: self._door.randomize(),
            "publish": self._publish,
            "reload": self._reload,
        }
        faults = Faults(_log, "serving joints")
        self.task = asyncio.ensure_future(keep_running(self._run, faults))

    def received_text(self, text: str) -> None:
        """Carry out an operation."""
        if not self._client.may_write:
            self._send_error("this token is read-only: it sets no joints")
            return
        try:
            fields = json.loads(text)
            self._handlers[fields["op"]](fields)
        except UsageError as error:
            self._send_error(str(error))
        except (ValueError, TypeError, LookupError, AttributeError, OverflowError, RecursionError) as error:
            self._send_error(f"not an operation on joints: {error}")

    def received_binary(self, data: bytes) -> None:
        """Refuse what no client sends."""
        self._send_error("binary messages have no meaning here")

    def ended(self) -> None:
        """End the session."""
        self.task.cancel()

    async def _run(self) -> None:
        self._client.send_text(json.dumps({"writes": self._client.may_write}))
        while True:
            if self._is_reload_wanted:
                self._is_reload_wanted = False
                try:
                    await self._door.load(is_forced=True)
                except MinirospyError as error:
                    self._send_error(str(error))
            if self._door.generation and self._generation != self._door.generation:
                self._generation = self._door.generation
                self._client.send_text(json.dumps(self._door.description()))
            text = json.dumps({"state": self._door.state()})
            if text != self._sent:
                self._sent = text
                self._client.send_text_message("state", text.encode(), newest_only=True)
            await asyncio.sleep(_LOOK_SECONDS)

    def _publish(self, fields: _Fields) -> None:
        self._door.is_publishing = bool(fields["on"]) or self._door.always_publishes

    def _reload(self, _: _Fields) -> None:
        self._is_reload_wanted = True

    def _send_error(self, text: str) -> None:
        self._client.send_text(json.dumps({"error": text[:500]}))


def _finite(value: float) -> float:
    """Return a number that JSON has: limits may be infinite."""
    return min(max(value, -_FARTHEST), _FARTHEST) if not math.isnan(value) else 0.0


def _positions(fields: _Fields) -> dict[str, float]:
    positions = fields["positions"]
    if not isinstance(positions, dict):
        raise TypeError("positions is an object")
    found = {str(name): float(value) for name, value in positions.items()}
    if not all(map(math.isfinite, found.values())):
        raise ValueError("positions are finite numbers")
    return found


def _kinds(description: str) -> tuple[str, dict[str, str]]:
    """Return the robot's name, and the types of its joints, which have different units."""
    root = parse_xml(description, "robot_description")
    kinds = {
        joint.attributes.get("name", ""): joint.attributes.get("type", "") for joint in root.all("joint")
    }
    return root.attributes.get("name", ""), kinds
