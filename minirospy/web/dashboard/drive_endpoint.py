"""Driving from the page: publish velocities while the user holds a control, and a zero velocity afterwards.

A client of the sub-protocol sends ``{"topic", "twist": [x, y, z, roll, pitch, yaw]}`` (m/s, rad/s), ``{"topic",
"axes": [...], "buttons": [...]}``, or ``{"topic", "joints": [name, ...], "positions": [...], "seconds"}`` repeatedly
while a control is held, and ``{"leave": topic}`` when it no longer drives a topic. The server sends ``{"writes": bool}``
first, ``{"stopped": topic}`` after it has stopped a topic because commands stopped arriving, and ``{"error": text,
"topic"}``. The last message on each topic is a zero velocity, or an empty trajectory, with which joints hold their
positions. It is sent whether the control is released or the connection is lost. If a client stops sending, a separate
thread publishes it (:mod:`minirospy.runtime.stop_guard`), even if the event loop is blocked.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import math
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Protocol

from minirospy.base.errors import BridgeError, ROSException
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.introspect.graph import why_illegal
from minirospy.runtime.stop_guard import StopGuard

if TYPE_CHECKING:
    from minirospy.web.graph import Publication, SharedGraph
    from minirospy.web.server.client import WebClient

__all__ = [
    "SILENT_SECONDS",
    "SUBPROTOCOL",
    "Command",
    "DriveEndpoint",
    "DriveSession",
    "Joystick",
    "Target",
    "Velocity",
    "parse",
]

SUBPROTOCOL = "minirospy.drive.v1"

SILENT_SECONDS = 0.5
"""Seconds without a command after which a client that holds a control counts as lost, and its topics are stopped."""

_log = logging.getLogger(__name__)

_MAX_TOPICS = 20
_MAX_VALUES = 100
_MAX_COMMAND_LENGTH = 20_000  # maximum number of characters in a command
_MAX_MOTION_SECONDS = 3600.0

_MAX_AXIS = 3.4028234663852886e38  # largest finite float32


@dataclass(frozen=True)
class Velocity:
    """A geometry_msgs/Twist, in m/s and rad/s."""

    values: tuple[float, ...]

    @property
    def is_zero(self) -> bool:
        """Return whether all components are zero."""
        return not any(self.values)

    def zero(self) -> Velocity:
        """Return a velocity whose components are all zero."""
        return Velocity((0.0,) * 6)


@dataclass(frozen=True)
class Joystick:
    """A sensor_msgs/Joy with axes from -1 to 1, and buttons of 0 or 1."""

    axes: tuple[float, ...]
    buttons: tuple[int, ...]

    @property
    def is_zero(self) -> bool:
        """Return whether all axes are 0 and no button is pressed."""
        return not any(self.axes) and not any(self.buttons)

    def zero(self) -> Joystick:
        """Return a joystick state whose axes are 0 and whose buttons are released."""
        return Joystick((0.0,) * len(self.axes), (0,) * len(self.buttons))


@dataclass(frozen=True)
class Target:
    """A trajectory_msgs/JointTrajectory with one point: the joints' positions, and the seconds to reach it."""

    joints: tuple[str, ...]
    positions: tuple[float, ...]
    seconds: float

    @property
    def is_zero(self) -> bool:
        """Return whether the trajectory is empty, which makes the joints hold their positions."""
        return not self.joints

    def zero(self) -> Target:
        """Return an empty trajectory, which makes the joints hold their positions."""
        return Target((), (), 0.0)


Held = Velocity | Joystick | Target


@dataclass(frozen=True)
class Command:
    """A client's command: a topic and the message to publish, or None to release the topic."""

    topic: str
    held: Held | None


def parse(text: str) -> Command:
    """Parse a client's command. Raise ValueError if it is invalid."""
    if len(text) > _MAX_COMMAND_LENGTH:
        raise ValueError(f"it has more than {_MAX_COMMAND_LENGTH} characters")
    try:
        fields = json.loads(text)
    except RecursionError:
        raise ValueError("it is nested too deep") from None
    if not isinstance(fields, Mapping):
        raise ValueError("it is not an object")
    names = set(fields)
    if names == {"leave"}:
        return Command(_topic(fields["leave"]), None)

    if names == {"topic", "twist"}:
        values = _numbers(fields["twist"])
        if len(values) != 6:
            raise ValueError("a twist has 6 numbers")
        return Command(_topic(fields["topic"]), Velocity(values))
    if names == {"topic", "axes", "buttons"}:
        buttons = tuple(int(each) for each in _numbers(fields["buttons"]))
        if not all(-(2**31) <= each < 2**31 for each in buttons):
            raise ValueError("a button is 0 or 1")
        axes = _numbers(fields["axes"])
        if not all(abs(each) <= _MAX_AXIS for each in axes):
            raise ValueError("an axis is from -1 to 1")
        return Command(_topic(fields["topic"]), Joystick(axes, buttons))
    if names == {"topic", "joints", "positions", "seconds"}:
        return Command(_topic(fields["topic"]), _target(fields))
    raise ValueError(f"it has {', '.join(sorted(map(str, names)))[:80] or 'nothing'}")


def _target(fields: Mapping[str, object]) -> Target:
    joints = fields["joints"]
    if not isinstance(joints, list) or not joints or not all(isinstance(each, str) for each in joints):
        raise ValueError("joints are an array of names")
    positions = _numbers(fields["positions"])
    if len(positions) != len(joints):
        raise ValueError("each joint has one position")
    (seconds,) = _numbers([fields["seconds"]])
    if not 0 < seconds <= _MAX_MOTION_SECONDS:
        raise ValueError(f"a motion lasts up to {_MAX_MOTION_SECONDS:g} seconds")
    return Target(tuple(joints), positions, seconds)


def _topic(value: object) -> str:
    if not isinstance(value, str) or not value:
        raise ValueError("a topic is a name")
    why = why_illegal(value)
    if why:
        raise ValueError(f"topic [{value[:80]}]: {why}")
    return value


def _numbers(values: object) -> tuple[float, ...]:
    if not isinstance(values, list) or len(values) > _MAX_VALUES:
        raise ValueError(f"numbers are an array, of {_MAX_VALUES} at most")
    try:
        numbers = tuple(float(each) for each in values if isinstance(each, int | float))
    except OverflowError:
        numbers = ()
    if len(numbers) != len(values) or not all(map(math.isfinite, numbers)):
        raise ValueError("its numbers are not finite")
    return numbers


class DriveEndpoint:
    """Opens a session for each client. ``graph()`` returns the graph in which clients publish."""

    def __init__(self, graph: Callable[[], SharedGraph]) -> None:
        self._graph = graph
        self._guard = StopGuard()

    def select(self, offered: Sequence[str]) -> str:
        """Choose one of the offered sub-protocols. Raise LookupError if none of ``offered`` is supported."""
        if SUBPROTOCOL in offered:
            return SUBPROTOCOL
        raise LookupError(f"sub-protocol {SUBPROTOCOL} is required")

    def open(self, client: WebClient) -> DriveSession:
        """Start serving a client."""
        return DriveSession(client, self._graph(), self._guard)


class DriveSession:
    """The session of one client. Runs on the loop."""

    def __init__(self, client: WebClient, graph: SharedGraph, guard: StopGuard) -> None:
        self._client = client
        self._graph = graph
        self._guard = guard
        self._driven: dict[str, _Driven] = {}
        self._send(writes=client.may_write)

    def received_text(self, text: str) -> None:
        """Execute a command."""
        if not self._client.may_write:
            self._send(error="this token is read-only: it drives nothing")
            return
        try:
            command = parse(text)
        except ValueError as error:
            self._send(error=f"not a command of driving: {error}")
            return
        try:
            self._carry_out(command)
        except BridgeError as error:
            self._send(error=str(error), topic=command.topic)

    def received_binary(self, data: bytes) -> None:
        """Report an error, because clients send no binary messages."""
        self._send(error="binary messages have no meaning here")

    def ended(self) -> None:
        """Stop and release all topics that the client drives."""
        for topic in list(self._driven):
            try:
                self._driven.pop(topic).close()
            except Exception:  # noqa: BLE001 - whatever it is, the other topics are stopped
                _log.exception("%s could not be stopped", topic)

    def _carry_out(self, command: Command) -> None:
        driven = self._driven.get(command.topic)
        kind = type(command.held)
        if driven and (command.held is None or driven.kind is not kind):
            self._driven.pop(command.topic).close()
            driven = None
        if command.held is None:
            return
        if driven is None:
            if len(self._driven) >= _MAX_TOPICS:
                raise BridgeError(f"a client may drive {_MAX_TOPICS} topics")
            driven = _Driven(self._graph, self._guard, command.topic, command.held, self._stopped)
            self._driven[command.topic] = driven
        driven.hold(command.held)

    def _stopped(self, topic: str) -> None:
        _log.warning("%s is stopped: its client %s is silent", topic, self._client.name)
        self._send(stopped=topic)

    def _send(self, **fields: object) -> None:
        self._client.send_text(json.dumps(fields))


class _Driven:
    """A topic that a client drives.

    Commands arrive on the loop; the guard's thread stops the topic if commands stop arriving.
    """

    def __init__(
        self,
        graph: SharedGraph,
        guard: StopGuard,
        topic: str,
        held: Held,
        stopped: Callable[[str], None],
    ) -> None:
        """Advertise the topic. Raise BridgeError if clients may not publish it, or if the topic has a different type."""
        self.kind = type(held)
        self._graph = graph
        self._guard = guard
        self._topic = topic
        self._stopped = stopped
        self._loop = asyncio.get_running_loop()
        self._lock = threading.Lock()
        # Protects the attributes below: a command and the guard's zero velocity must not be published concurrently.
        self._last = held.zero()
        self._deadline = math.inf
        self._publication: Publication = graph.advertise(graph.node.resolve(topic), _type_of(held))
        self._joining: asyncio.Task[None] | None = None

    def hold(self, held: Held) -> None:
        """Publish a command; publish zero velocity if no other command arrives in time.

        Raise BridgeError and publish nothing if a later stop cannot be guaranteed.
        """
        deadline = math.inf if held.is_zero else time.monotonic() + SILENT_SECONDS
        if held.is_zero:
            self._guard.disarm(self._silent)
        else:
            # Arm the guard before publishing, so that a stop follows every published command.
            self._guard.arm(self._silent, deadline)
        with self._lock:
            self._deadline = deadline
            self._publish(held)
        if not self._publication.has_joined and self._joining is None:
            self._joining = self._graph.spawn(self._publish_joined())

    def close(self) -> None:
        """Publish zero velocity, and release the topic."""
        self._guard.disarm(self._silent)
        with self._lock:
            self._deadline = math.inf
            if not self._last.is_zero:
                self._publish(self._last.zero())
        if self._joining and not self._joining.done():
            # The task that waits for subscribers must publish zero velocity first; close the topic after that.
            self._joining.add_done_callback(lambda _: self._publication.close())
        else:
            self._publication.close()

    def _silent(self) -> None:
        """Publish zero velocity, because no further command has arrived. Runs in the guard's thread."""
        with self._lock:
            if self._deadline > time.monotonic():
                return  # a command has just arrived, or the topic was released
            self._deadline = math.inf
            # If the node is shut down, its topics are closed, and nothing more can be published.
            with contextlib.suppress(ROSException):
                self._publish(self._last.zero())
        with contextlib.suppress(RuntimeError):  # the loop has been closed
            self._loop.call_soon_threadsafe(self._stopped, self._topic)

    def _publish(self, held: Held) -> None:
        """Publish a command. If subscribers are still connecting, publish only the newest command when they are connected.

        The caller must hold the lock.
        """
        self._last = held
        if self._publication.has_joined:
            self._publication.publish(self._body())

    async def _publish_joined(self) -> None:
        await self._publication.joined()
        with self._lock:
            self._publication.publish(self._body())

    def _body(self) -> bytes:
        buffer = BytesIO()
        _message_of(self._last, self._graph).serialize(buffer)
        return buffer.getvalue()


class _Message(Protocol):
    def serialize(self, buff: BytesIO) -> None: ...


def _type_of(held: Held) -> InterfaceType:
    from geometry_msgs.msg import Twist
    from sensor_msgs.msg import Joy
    from trajectory_msgs.msg import JointTrajectory

    return InterfaceType.of({Velocity: Twist, Joystick: Joy, Target: JointTrajectory}[type(held)])


def _message_of(held: Held, graph: SharedGraph) -> _Message:
    from genpy import Duration
    from geometry_msgs.msg import Twist, Vector3
    from sensor_msgs.msg import Joy
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    if isinstance(held, Velocity):
        return Twist(Vector3(*held.values[:3]), Vector3(*held.values[3:]))
    message: Joy | JointTrajectory
    if isinstance(held, Joystick):
        message = Joy(axes=list(held.axes), buttons=list(held.buttons))
    else:
        reached = JointTrajectoryPoint(
            positions=list(held.positions), time_from_start=Duration.from_sec(held.seconds)
        )
        message = JointTrajectory(joint_names=list(held.joints), points=[] if held.is_zero else [reached])
    message.header.stamp = graph.node.now()
    return message
