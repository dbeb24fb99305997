"""The bridge's interface to ROS 2. Implemented with rclpy (``side.py``), with Zenoh (``zenoh_side.py``), and in tests.

Callbacks run in ROS 2's own threads. Types are written as ``pkg/Name``; messages are serialized as CDR.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from typing import TYPE_CHECKING, Protocol

from minirospy.ros2.links import Ros2Topic
from minirospy.ros2.parameter_values import Value

if TYPE_CHECKING:
    from minirospy.ros2.rclpy_parameters import ParameterStore

__all__ = [
    "Accept",
    "GoalOfRos1",
    "Reachable",
    "Ros2ActionClient",
    "Ros2Client",
    "Ros2Goal",
    "Ros2Handle",
    "Ros2Parameters",
    "Ros2Probe",
    "Ros2Publisher",
    "Ros2Side",
]


class Ros2Publisher(Protocol):
    """A publisher of serialized messages."""

    @property
    def subscribers(self) -> int:
        """Return the number of connected subscribers."""

    def publish(self, data: bytes) -> None: ...

    def close(self) -> None: ...


class Ros2Handle(Protocol):
    """A subscription or service whose callback is called until the handle is closed."""

    def close(self) -> None: ...


class Ros2Probe(Protocol):
    """Sends requests without side effects to a client's servers. Methods may be called from any thread."""

    @property
    def is_ready(self) -> bool:
        """Return whether the servers are connected."""

    def reach(self) -> Future[None]:
        """Send a request; return a future that completes with its response: from then on, no response to the client is lost."""

    def close(self) -> None: ...


class Reachable(Protocol):
    """The common interface of clients for services and for actions. Methods may be called from any thread."""

    @property
    def is_ready(self) -> bool:
        """Return whether a server is connected."""

    @property
    def servers(self) -> frozenset[bytes] | None:
        """Return the IDs of the existing servers, or None if their responses cannot be lost."""

    def probe(self) -> Ros2Probe | None:
        """Return a probe for the servers, or None if every request to them would have side effects."""


class Ros2Client(Reachable, Protocol):
    """A client for a service. Methods may be called from any thread."""

    def call(self, request: bytes) -> Future[bytes]:
        """Send a request as CDR; return a future for the response as CDR. The future may fail with BridgeError."""

    def close(self) -> None: ...


class Ros2Goal(Protocol):
    """A goal that a ROS 2 server has accepted. Methods may be called from any thread."""

    def cancel(self) -> None: ...

    def result(self) -> Future[tuple[int, bytes]]:
        """Return a future for the final status (see action_msgs/GoalStatus) and the result."""


class Ros2ActionClient(Reachable, Protocol):
    """A client for an action. Methods may be called from any thread."""

    def send(self, goal: bytes, feedback: Callable[[bytes], None]) -> Future[Ros2Goal | None]:
        """Send a goal; return a future for the accepted goal, or for None if the goal is rejected.

        The future may fail with BridgeError.
        """

    def close(self) -> None: ...


class GoalOfRos1(Protocol):
    """A goal that a ROS 1 server has accepted."""

    @property
    def ended(self) -> Future[tuple[int, bytes | None]]:
        """Return a future for the final status (see action_msgs/GoalStatus) and the result, which is None if empty."""

    def cancel(self) -> None:
        """Ask the server to cancel the goal. May be called from any thread."""


Accept = Callable[[bytes, Callable[[bytes], None]], Future[GoalOfRos1 | None]]
"""Takes a goal and a function for its feedback. Returns a future for the accepted goal, or for None if the goal is rejected."""


class Ros2Parameters(Protocol):
    """Parameters of other ROS 2 nodes. All methods block, so call them in a worker thread.

    All methods raise BridgeError if the call fails.
    """

    def names(self, node: str) -> list[str]: ...

    def get(self, node: str, name: str) -> Value:
        """Return the value of a parameter; its type is 0 if the parameter is not set."""

    def set(self, node: str, name: str, value: Value) -> None: ...


class Ros2Side(Protocol):
    """The ROS 2 side of the bridge: a node in a ROS 2 domain."""

    @property
    def domain(self) -> str: ...

    def topics(self) -> Mapping[str, tuple[str, ...]]:
        """Return the names of all topics, with their types."""

    def ends(self, topic: str) -> Ros2Topic: ...

    def fields(self, type_: str) -> dict[str, str]:
        """Return the fields of a message type. Raise TypesDiffer if the type is unknown or its definition is incompatible."""

    def publisher(self, topic: str, type_: str, *, depth: int, is_latched: bool) -> Ros2Publisher: ...

    def subscribe(
        self,
        topic: str,
        type_: str,
        deliver: Callable[[bytes], None],
        *,
        depth: int,
        is_reliable: bool,
        is_latched: bool,
    ) -> Ros2Handle: ...

    def nodes(self) -> list[tuple[str, str]]:
        """Return the (name, namespace) of all nodes except bridges."""

    def services(self) -> Mapping[str, str]:
        """Return the services of all nodes except this bridge, as a dict from name to type."""

    def service_fields(self, type_: str) -> tuple[dict[str, str], dict[str, str]]:
        """Return the fields of a service's request and response. Raise TypesDiffer like :meth:`fields`."""

    def client(self, service: str, type_: str) -> Ros2Client: ...

    def serve(self, service: str, type_: str, answer: Callable[[bytes], Future[bytes]]) -> Ros2Handle:
        """Offer a service. A thread calls ``answer`` with each request as CDR; ``answer`` returns a future for the response.

        The call fails if the future raises MinirospyError.
        """

    def action_fields(self, type_: str) -> tuple[dict[str, str], dict[str, str], dict[str, str]]:
        """Return the fields of an action's goal, result and feedback. Raise TypesDiffer like :meth:`fields`."""

    def action_client(self, action: str, type_: str) -> Ros2ActionClient: ...

    def action_server(self, action: str, type_: str, accept: Accept) -> Ros2Handle:
        """Offer an action. For each goal, a thread calls ``accept`` with the goal and a function that sends its feedback."""

    def serve_parameters(self, store: ParameterStore, loop: asyncio.AbstractEventLoop) -> Ros2Handle:
        """Offer the ROS 1 parameters as parameters of this node."""

    def node_parameters(self) -> Ros2Parameters: ...

    def close(self) -> None: ...
