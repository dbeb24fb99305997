"""Clients and servers of ROS 2 actions, based on rclpy's classes. Goals, results and feedback are CDR.

Everything runs in the executor's thread, except for methods whose docstrings say otherwise.
"""

from __future__ import annotations

import contextlib
import functools
import importlib
import threading
import uuid
from collections.abc import Callable
from concurrent.futures import CancelledError, Future, InvalidStateError
from typing import TYPE_CHECKING, Protocol, TypeVar, cast

from minirospy.base.clock import SignalSafeEvent
from minirospy.base.errors import BridgeError, MinirospyError
from minirospy.ros2.action_links import send_goal_service
from minirospy.ros2.rclpy_calls import Calls, Message, MessageClass, RclpyFuture

__all__ = ["ActionClass", "ActionClient", "ActionServer", "Feedback", "GoalOfRos2"]

if TYPE_CHECKING:
    from minirospy.ros2.interface import Accept, GoalOfRos1, Ros2Goal, Ros2Probe

_T = TypeVar("_T")

CANCELED = 5
"""Final statuses of goals, from action_msgs/GoalStatus."""
SUCCEEDED = 4
ABORTED = 6

_FEEDBACK_DEPTH = 100
CLOSE_SECONDS = 1.0
_HEADER = 4
_ID = 16


# --- interfaces of the parts of rclpy that are used


class _Impl(Protocol):
    FeedbackMessage: MessageClass


class ActionClass(Protocol):
    """The interface of a generated ROS 2 action class."""

    Impl: _Impl

    Goal: MessageClass
    Result: MessageClass
    Feedback: MessageClass


class _ClientHandle(Protocol):
    accepted: bool

    def cancel_goal_async(self) -> RclpyFuture: ...

    def get_result_async(self) -> RclpyFuture: ...


class _ServerHandle(Protocol):
    request: Message
    is_cancel_requested: bool

    def publish_feedback(self, feedback: Message) -> None: ...

    def succeed(self) -> None: ...

    def abort(self) -> None: ...

    def canceled(self) -> None: ...


class _RclpyActionClient(Protocol):
    def send_goal_async(self, goal: Message, *, goal_uuid: object) -> RclpyFuture: ...

    def server_is_ready(self) -> bool: ...

    def destroy(self) -> None: ...


class _Closable(Protocol):
    def destroy(self) -> None: ...


# --- goals from ROS 1 to ROS 2


class GoalOfRos2:
    """A goal accepted by a ROS 2 server. Methods may be called from any thread."""

    def __init__(self, calls: Calls, handle: _ClientHandle, on_end: Callable[[], None]) -> None:
        self._calls = calls
        self._handle = handle
        self._on_end = on_end

    def cancel(self) -> None:
        """Ask the server to cancel the goal."""
        self._calls.executor.create_task(self._handle.cancel_goal_async)

    def result(self) -> Future[tuple[int, bytes]]:
        """Return a future for the status and the result."""
        ended: Future[tuple[int, bytes]] = Future()

        def arrived(done: RclpyFuture) -> None:
            try:
                response = done.result()
                self._on_end()
                result = self._calls.serialize(getattr(response, "result"))  # noqa: B009 - the class is only known at run time
                found = (int(getattr(response, "status")), result)  # noqa: B009
            except Exception as error:  # noqa: BLE001 - rclpy may raise any error
                _fail(ended, error)
                return
            with contextlib.suppress(InvalidStateError):
                ended.set_result(found)

        def send() -> None:
            self._handle.get_result_async().add_done_callback(arrived)

        self._calls.executor.create_task(send)
        return ended


class ActionClient:
    """A client for a ROS 2 action.

    It subscribes to feedback itself, because rclpy's client drops unread feedback when the result arrives.
    """

    def __init__(self, calls: Calls, name: str, class_: ActionClass) -> None:
        self._calls = calls
        self._name = name
        self._callbacks: dict[bytes, Callable[[bytes], None]] = {}
        self._class = class_
        self._feedback_class = class_.Impl.FeedbackMessage
        # Create the feedback subscription before the client: a server that has discovered the client then knows both.
        self._feedback = calls.node.create_subscription(
            self._feedback_class, f"{name}/_action/feedback", self._take_feedback, _FEEDBACK_DEPTH, raw=True
        )
        self._client: _RclpyActionClient = _client_class()(
            calls.node,
            class_,
            name,
            callback_group=calls.options["callback_group"],
            goal_service_qos_profile=calls.options["qos_profile"],
            result_service_qos_profile=calls.options["qos_profile"],
            cancel_service_qos_profile=calls.options["qos_profile"],
        )

    @property
    def is_ready(self) -> bool:
        """Return whether a server is connected. May be called from any thread."""
        return bool(self._client.server_is_ready())

    @property
    def servers(self) -> frozenset[bytes] | None:
        """Return the IDs of the servers. May be called from any thread."""
        return self._calls.servers(send_goal_service(self._name))

    def probe(self) -> Ros2Probe:
        """Return a probe that asks to cancel a nonexistent goal.

        The cancel client is the action client's last endpoint, so its response proves that the earlier ones have also
        been discovered.
        """
        return _CancelProbe(self)

    def reach(self) -> Future[None]:
        """Ask to cancel a nonexistent goal; return a future for the response. May be called from any thread."""
        reached: Future[None] = Future()

        def answered(_: object) -> None:
            with contextlib.suppress(InvalidStateError):
                reached.set_result(None)

        def send() -> None:
            try:
                handle = importlib.import_module("rclpy.action.client").ClientGoalHandle(
                    self._client, _uuid_message(uuid.uuid4().bytes), None
                )
                handle.cancel_goal_async().add_done_callback(answered)
            except Exception as error:  # noqa: BLE001 - rclpy may raise any error
                _fail(reached, error)

        self._calls.executor.create_task(send)
        return reached

    def send(self, goal: bytes, feedback: Callable[[bytes], None]) -> Future[Ros2Goal | None]:
        """Send a goal; return a future for the accepted goal, or for None if it is rejected. May be called from any thread."""
        accepted: Future[Ros2Goal | None] = Future()
        self._calls.executor.create_task(self._send, goal, feedback, accepted)
        return accepted

    def close(self) -> None:
        """Close the client."""
        self._calls.end(lambda: self._calls.node.destroy_subscription(self._feedback))
        self._calls.end(self._client.destroy)

    def _send(
        self, goal: bytes, feedback: Callable[[bytes], None], accepted: Future[Ros2Goal | None]
    ) -> None:
        id = uuid.uuid4().bytes
        self._callbacks[id] = feedback

        def ended() -> None:
            self._read_feedback()
            self._callbacks.pop(id, None)

        def answered(done: RclpyFuture) -> None:
            handle = cast("_ClientHandle", done.result())
            if not handle.accepted:
                self._callbacks.pop(id, None)
            try:
                accepted.set_result(GoalOfRos2(self._calls, handle, ended) if handle.accepted else None)
            except InvalidStateError:
                # The caller has stopped waiting and treats the goal as rejected, so cancel the goal.
                self._callbacks.pop(id, None)
                if handle.accepted:
                    handle.cancel_goal_async()

        try:
            message = self._calls.deserialize(goal, self._class.Goal)
            self._client.send_goal_async(message, goal_uuid=_uuid_message(id)).add_done_callback(answered)
        except Exception as error:  # noqa: BLE001 - rclpy may raise any error
            self._callbacks.pop(id, None)
            _fail(accepted, error)

    def _read_feedback(self) -> None:
        """Deliver feedback that is still queued, before the result that was sent after it."""
        handle = self._feedback.handle
        with handle:
            while taken := handle.take_message(self._feedback_class, True):
                self._take_feedback(taken[0])

    def _take_feedback(self, data: bytes) -> None:
        # The goal ID has 16 bytes, so removing it keeps the data that follows aligned.
        callback = self._callbacks.get(bytes(data[_HEADER : _HEADER + _ID]))
        if callback:
            callback(data[:_HEADER] + data[_HEADER + _ID :])


class _CancelProbe:
    """Probes an action's servers through an existing client, which stays open when the probe is closed."""

    def __init__(self, client: ActionClient) -> None:
        self._client = client

    @property
    def is_ready(self) -> bool:
        return self._client.is_ready

    def reach(self) -> Future[None]:
        return self._client.reach()

    def close(self) -> None:
        pass


def _uuid_message(id: bytes) -> object:
    return importlib.import_module("unique_identifier_msgs.msg").UUID(uuid=list(id))


def _client_class() -> Callable[..., _RclpyActionClient]:
    """Return a subclass of rclpy's action client that has a lock as a class attribute.

    rclpy's constructor adds the client to the executor before it creates the lock, and the executor's thread would fail
    without the lock.
    """
    return type(
        "ActionClient", (importlib.import_module("rclpy.action").ActionClient,), {"_lock": threading.Lock()}
    )


# --- goals from ROS 2 to ROS 1


class Feedback:
    """Buffers a goal's feedback until the goal's handle exists; then publishes it.

    Methods may be called from any thread.
    """

    def __init__(self, calls: Calls, class_: MessageClass) -> None:
        self._calls = calls
        self._class = class_
        self._handle: _ServerHandle | None = None
        self._kept: list[bytes] = []

    def __call__(self, data: bytes) -> None:
        self._calls.executor.create_task(self._publish, data)

    def start(self, handle: _ServerHandle) -> None:
        """Publish the buffered feedback, and from now on publish feedback directly."""
        self._handle = handle
        kept, self._kept = self._kept, []
        for data in kept:
            self._publish(data)

    def _publish(self, data: bytes) -> None:
        if self._handle is None:
            self._kept.append(data)
        else:
            self._handle.publish_feedback(self._calls.deserialize(data, self._class))


class ActionServer:
    """An action that the bridge offers in ROS 2."""

    def __init__(self, calls: Calls, name: str, class_: ActionClass, accept: Accept) -> None:
        self._calls = calls
        self._name = name
        self._class = class_
        self._accept = accept
        self._goals: dict[int, tuple[Message, GoalOfRos1, Feedback]] = {}
        self._requests = 0
        self._is_closed = False
        self._module = importlib.import_module("rclpy.action")
        # Set the logger early: the server may be called before rclpy's constructor has created a logger.
        named = {"_logger": calls.node.get_logger()}
        self._server: _Closable = type("ActionServer", (self._module.ActionServer,), named)(
            calls.node,
            class_,
            name,
            self._execute,
            goal_callback=self._requested,
            cancel_callback=self._cancelled,
            goal_service_qos_profile=calls.options["qos_profile"],
            result_service_qos_profile=calls.options["qos_profile"],
            cancel_service_qos_profile=calls.options["qos_profile"],
            feedback_pub_qos_profile=importlib.import_module("rclpy.qos").QoSProfile(depth=_FEEDBACK_DEPTH),
            callback_group=calls.options["callback_group"],
        )

    def close(self) -> None:
        """Send known results and rejections, then close the action. Must not be called in the executor's thread."""
        sent = SignalSafeEvent()
        self._calls.end(functools.partial(self._wait_until_sent, sent))
        sent.wait(CLOSE_SECONDS)
        self._is_closed = True
        self._calls.end(self._server.destroy)

    def _wait_until_sent(self, sent: threading.Event) -> None:
        """Set the event in the first iteration of the executor in which no response is left to send."""
        if self._is_closed:
            return
        if self._requests or any(goal.ended.done() for _, goal, _ in self._goals.values()):
            self._calls.end(functools.partial(self._wait_until_sent, sent))
        else:
            # Set the event in another task, because rclpy may send the last response in a task that runs after this one.
            self._calls.end(sent.set)

    async def _requested(self, goal: Message) -> object:
        self._requests += 1
        try:
            return await self._answered(goal)
        finally:
            self._requests -= 1

    async def _answered(self, goal: Message) -> object:
        feedback = Feedback(self._calls, self._class.Feedback)
        try:
            accepted = await self._calls.result(self._accept(self._calls.serialize(goal), feedback))
        except (MinirospyError, CancelledError, RuntimeError) as error:
            self._calls.node.get_logger().error(f"action [{self._name}] of ROS 1: {error}")
            accepted = None
        if accepted is None:
            return self._module.GoalResponse.REJECT
        # Store the goal under its id(), because the handle that rclpy creates will refer to the same object.
        self._goals[id(goal)] = (goal, accepted, feedback)
        return self._module.GoalResponse.ACCEPT

    def _cancelled(self, handle: _ServerHandle) -> object:
        known = self._goals.get(id(handle.request))
        if known is None:
            return self._module.CancelResponse.REJECT
        known[1].cancel()
        return self._module.CancelResponse.ACCEPT

    async def _execute(self, handle: _ServerHandle) -> Message:
        _, goal, feedback = self._goals[id(handle.request)]
        feedback.start(handle)
        try:
            status, data = await self._calls.result(goal.ended, after_tasks=True)
        except CancelledError:
            status, data = ABORTED, None
        finally:
            del self._goals[id(handle.request)]
        if status == SUCCEEDED:
            handle.succeed()
        elif status == CANCELED and handle.is_cancel_requested:
            handle.canceled()
        else:
            # In ROS 1, another goal has preempted this one; ROS 2 has no status for that.
            handle.abort()
        return self._class.Result() if data is None else self._calls.deserialize(data, self._class.Result)


def _fail(future: Future[_T], error: Exception) -> None:
    with contextlib.suppress(InvalidStateError):
        future.set_exception(BridgeError(" ".join(str(error).split())))
