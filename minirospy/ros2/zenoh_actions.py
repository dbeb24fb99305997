"""Clients and servers of ROS 2 actions over Zenoh: three services and two topics, named as in rcl_action.

A goal is preceded by its id, which has 16 bytes, so that the alignment of the rest does not change. Source:
https://design.ros2.org/articles/actions.html, and the definitions of action_msgs.
"""

from __future__ import annotations

import concurrent.futures
import contextlib
import logging
import time
import uuid
from collections.abc import Callable, Mapping
from concurrent.futures import CancelledError, Future, InvalidStateError
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple, cast

from minirospy.base.errors import BridgeError, DeserializationError, MinirospyError
from minirospy.core.graph.goals import is_meant
from minirospy.core.idl.cdr import CDR_HEADER
from minirospy.core.idl.type_hash import Fields
from minirospy.ros2.cdr_values import decode, encode
from minirospy.ros2.rclpy_actions import ABORTED, CANCELED, SUCCEEDED
from minirospy.ros2.zenoh_calls import ZenohClient, ZenohServer
from minirospy.ros2.zenoh_keys import Kind
from minirospy.ros2.zenoh_topics import ZenohPublisher, subscribe

if TYPE_CHECKING:
    from minirospy.ros2.interface import Accept, GoalOfRos1, Ros2Goal
    from minirospy.ros2.zenoh_keys import Entity
    from minirospy.ros2.zenoh_node import ZenohNode

__all__ = ["ActionEnds", "ActionType", "ZenohActionClient", "ZenohActionServer"]

_log = logging.getLogger(__name__)
_HEADER = len(CDR_HEADER)
_BODY = _HEADER + 16
_NO_ID = bytes(16)
_SECOND = 1_000_000_000
_ACCEPTED, _EXECUTING, _CANCELING = 1, 2, 3
"""Statuses of running goals, from action_msgs/GoalStatus; 0 means unknown."""
_UNKNOWN_GOAL, _ENDED_GOAL = 2, 3
"""Error codes from action_msgs/srv/CancelGoal."""
_KEPT_SECONDS = 60.0  # seconds to store the result of a goal that has ended
_MAX_GOALS = 2_000
CLOSE_SECONDS = 1.0


class ActionEnds(NamedTuple):
    """The endpoints of an action client or server."""

    send_goal: Entity
    get_result: Entity
    cancel_goal: Entity
    feedback: Entity
    status: Entity


class ActionType:
    """Encodes and decodes the messages that carry an action's goals, results and feedback.

    ``name`` is ``pkg/action/Name``; ``fields`` is a function that returns a part's fields.
    """

    def __init__(self, name: str, fields: Callable[[str], Fields]) -> None:
        self._name = name
        self._fields = fields

    def write(self, part: str, values: Mapping[str, object]) -> bytes:
        """Encode one of the action's messages, such as ``SendGoal_Response``, as CDR."""
        return encode(f"{self._name}_{part}", self._fields, values)

    def read(self, part: str, data: bytes) -> dict[str, object]:
        """Decode one of the action's messages from CDR. Raise DeserializationError if ``data`` is invalid."""
        return decode(f"{self._name}_{part}", self._fields, data)

    def response(self, status: int, result: bytes | None) -> bytes:
        """Encode the response to a result request. A ``result`` of None means an empty result.

        Raise DeserializationError if the result is invalid.
        """
        values = {} if result is None else self.read("Result", result)
        return self.write("GetResult_Response", {"status": status, "result": values})

    def result(self, response: bytes) -> tuple[int, bytes]:
        """Return the status and result in the response to a result request.

        Raise DeserializationError if the response is invalid.
        """
        found = self.read("GetResult_Response", response)
        return cast("int", found["status"]), self.write(
            "Result", cast("Mapping[str, object]", found["result"])
        )

    def message(self, name: str, values: Mapping[str, object]) -> bytes:
        """Encode an action_msgs message as CDR."""
        return encode(name, self._fields, values)

    def cancelled(self, request: bytes) -> tuple[bytes, int]:
        """Parse a cancel request; return its goal id and stamp. Raise DeserializationError if the request is invalid."""
        found = decode("action_msgs/srv/CancelGoal_Request", self._fields, request)
        info = cast("dict[str, dict[str, object]]", found["goal_info"])
        stamp = cast("dict[str, int]", info["stamp"])
        return cast("bytes", info["goal_id"]["uuid"]), stamp["sec"] * _SECOND + stamp["nanosec"]


def _info(id: bytes, stamp: int = 0) -> dict[str, object]:
    """Return the values of an action_msgs/GoalInfo."""
    return {"goal_id": {"uuid": id}, "stamp": _time(stamp)}


def _time(stamp: int) -> dict[str, object]:
    return {"sec": stamp // _SECOND, "nanosec": stamp % _SECOND}


def _split(data: bytes) -> tuple[bytes, bytes]:
    """Split a goal's id from the data that follows it. Raise DeserializationError if the data is too short."""
    if len(data) < _BODY:
        raise DeserializationError("the message ends too early")
    return data[_HEADER:_BODY], data[:_HEADER] + data[_BODY:]


def _joined(id: bytes, data: bytes) -> bytes:
    return data[:_HEADER] + id + data[_HEADER:]


# --- goals from ROS 1 to ROS 2


class _SentGoal:
    """A goal accepted by a ROS 2 server. Methods may be called from any thread."""

    def __init__(self, client: ZenohActionClient, id: bytes) -> None:
        self._client = client
        self._id = id

    def cancel(self) -> None:
        """Ask the server to cancel the goal."""
        self._client.cancel(self._id)

    def result(self) -> Future[tuple[int, bytes]]:
        """Return a future for the status and the result."""
        return self._client.result(self._id)


class ZenohActionClient:
    """A client for an action. Does not subscribe to the statuses. Methods may be called from any thread."""

    def __init__(self, node: ZenohNode, ends: ActionEnds, type_: ActionType) -> None:
        self._graph = node.graph
        self._type = type_
        self._ends = ends
        self._callbacks: dict[bytes, Callable[[bytes], None]] = {}
        self._send_goal = ZenohClient(node, ends.send_goal)
        self._get_result = ZenohClient(node, ends.get_result)
        self._cancel_goal = ZenohClient(node, ends.cancel_goal)
        self._feedback = subscribe(node, ends.feedback, self._take_feedback)

    @property
    def is_ready(self) -> bool:
        """Return whether all endpoints of a server are known."""
        publishers = self._graph.of_name(self._ends.feedback.name, Kind.PUBLISHER)
        clients = (self._send_goal, self._get_result, self._cancel_goal)
        return bool(publishers) and all(each.is_ready for each in clients)

    @property
    def servers(self) -> None:
        """Return None, because no response can be lost.

        A response takes the same route as its request, and the tokens prove that the route exists.
        """

    def probe(self) -> None:
        """Return None, because no response can be lost, so no probe is needed."""

    def send(self, goal: bytes, feedback: Callable[[bytes], None]) -> Future[Ros2Goal | None]:
        """Send a goal; return a future for the accepted goal, or for None if it is rejected.

        The future may fail with BridgeError.
        """
        id = uuid.uuid4().bytes
        self._callbacks[id] = feedback
        accepted: Future[Ros2Goal | None] = Future()

        def answered(done: Future[bytes]) -> None:
            sent: _SentGoal | None = None
            try:
                if self._type.read("SendGoal_Response", done.result())["accepted"]:
                    sent = _SentGoal(self, id)
                else:
                    self._callbacks.pop(id, None)
                accepted.set_result(sent)
            except InvalidStateError:
                # The caller has stopped waiting and treats the goal as rejected, so cancel the goal.
                self._callbacks.pop(id, None)
                if sent:
                    sent.cancel()
            except (BridgeError, DeserializationError) as error:
                self._callbacks.pop(id, None)
                _fail(accepted, error)

        self._send_goal.call(_joined(id, goal)).add_done_callback(answered)
        return accepted

    def cancel(self, id: bytes) -> None:
        """Ask the server to cancel a goal; the goal's result will show whether that succeeded."""
        self._cancel_goal.call(
            self._type.message("action_msgs/srv/CancelGoal_Request", {"goal_info": _info(id)})
        )

    def result(self, id: bytes) -> Future[tuple[int, bytes]]:
        """Return a future for a goal's status and result. The future may fail with BridgeError."""
        ended: Future[tuple[int, bytes]] = Future()

        def arrived(done: Future[bytes]) -> None:
            self._callbacks.pop(id, None)
            try:
                found = self._type.result(done.result())
            except (BridgeError, DeserializationError) as error:
                _fail(ended, error)
                return
            with contextlib.suppress(InvalidStateError):
                ended.set_result(found)

        request = self._type.write("GetResult_Request", {"goal_id": {"uuid": id}})
        self._get_result.call(request).add_done_callback(arrived)
        return ended

    def close(self) -> None:
        """Close the client. Idempotent."""
        for each in (self._feedback, self._cancel_goal, self._get_result, self._send_goal):
            each.close()

    def _take_feedback(self, data: bytes) -> None:
        id, feedback = _split(data)
        callback = self._callbacks.get(id)
        if callback:
            callback(feedback)


def _fail(future: Future[Ros2Goal | None] | Future[tuple[int, bytes]], error: Exception) -> None:
    with contextlib.suppress(InvalidStateError):
        future.set_exception(BridgeError(" ".join(str(error).split())))


# --- goals from ROS 2 to ROS 1


@dataclass
class _Goal:
    """A goal from a ROS 2 client.

    ``status`` is 0 until the goal is accepted; ``response`` contains the result once the goal has ended.
    """

    id: bytes
    status: int = 0
    stamp: int = 0
    there: GoalOfRos1 | None = None
    feedback: list[bytes] = field(default_factory=list)
    waiting: list[Future[bytes]] = field(default_factory=list)
    response: bytes = b""
    ended_at: float = 0.0


class ZenohActionServer:
    """An action that the bridge offers in ROS 2. A single thread sends the messages in order."""

    def __init__(self, node: ZenohNode, ends: ActionEnds, type_: ActionType, accept: Accept) -> None:
        self._name = ends.send_goal.name.removesuffix("/_action/send_goal")
        self._type = type_
        self._accept = accept
        self._goals: dict[bytes, _Goal] = {}
        self._thread = concurrent.futures.ThreadPoolExecutor(1, "zenoh-action")
        self._feedback = ZenohPublisher(node, ends.feedback)
        self._status = ZenohPublisher(node, ends.status)
        self._servers = [
            ZenohServer(node, end, {}, answer, self._thread)
            for end, answer in (
                (ends.cancel_goal, self._cancel),
                (ends.get_result, self._result),
                (ends.send_goal, self._request),
            )
        ]

    def close(self) -> None:
        """Send known results, then close the action. Idempotent."""
        with contextlib.suppress(RuntimeError, concurrent.futures.TimeoutError):
            # The first call may submit responses for goals that have just ended; the second call waits for those responses.
            self._thread.submit(lambda: None).result(CLOSE_SECONDS)
            self._thread.submit(lambda: None).result(CLOSE_SECONDS)
        for server in self._servers:
            server.close()
        for publisher in (self._feedback, self._status):
            publisher.close()
        self._thread.shutdown(wait=False)

    def _submit(self, work: Callable[[], None]) -> None:
        def guarded() -> None:
            try:
                work()
            except Exception:  # noqa: BLE001 - one task's error must not stop the others
                _log.exception("action [%s] of ROS 1", self._name)

        # RuntimeError: after close(), the thread accepts no more work.
        with contextlib.suppress(RuntimeError):
            self._thread.submit(guarded)

    def _request(self, request: bytes) -> Future[bytes]:
        id, body = _split(request)
        answered: Future[bytes] = Future()
        self._forget()
        if id in self._goals or len(self._goals) >= _MAX_GOALS:
            answered.set_result(self._decision(None))
            return answered
        goal = self._goals[id] = _Goal(id)

        def feedback(data: bytes) -> None:
            self._submit(lambda: self._pass_feedback(goal, data))

        accepted = self._accept(body, feedback)
        accepted.add_done_callback(lambda done: self._submit(lambda: self._decide(goal, done, answered)))
        return answered

    def _decide(self, goal: _Goal, done: Future[GoalOfRos1 | None], answered: Future[bytes]) -> None:
        try:
            goal.there = done.result()
        except (MinirospyError, CancelledError, RuntimeError) as error:
            _log.error("action [%s] of ROS 1: %s", self._name, error)
        if goal.there is None:
            del self._goals[goal.id]
            answered.set_result(self._decision(None))
            return
        goal.stamp, goal.status = time.time_ns(), _ACCEPTED
        # Send the response before any message that is submitted later.
        answered.set_result(self._decision(goal))
        self._submit(lambda: self._start(goal))
        goal.there.ended.add_done_callback(lambda end: self._submit(lambda: self._end(goal, end)))

    def _decision(self, goal: _Goal | None) -> bytes:
        stamp = goal.stamp if goal else time.time_ns()
        return self._type.write("SendGoal_Response", {"accepted": goal is not None, "stamp": _time(stamp)})

    def _start(self, goal: _Goal) -> None:
        self._publish_statuses()
        if goal.status == _ACCEPTED:
            goal.status = _EXECUTING
            self._publish_statuses()
        kept, goal.feedback = goal.feedback, []
        for data in kept:
            self._feedback.publish(_joined(goal.id, data))

    def _pass_feedback(self, goal: _Goal, data: bytes) -> None:
        if goal.status in (0, _ACCEPTED):
            goal.feedback.append(data)
        else:
            self._feedback.publish(_joined(goal.id, data))

    def _end(self, goal: _Goal, done: Future[tuple[int, bytes | None]]) -> None:
        try:
            status, result = done.result()
        except CancelledError:
            status, result = ABORTED, None
        if status != SUCCEEDED and not (status == CANCELED and goal.status == _CANCELING):
            # In ROS 1, another goal has preempted this one; ROS 2 has no status for that.
            status = ABORTED
        goal.status, goal.ended_at = status, time.monotonic()
        goal.response = self._type.response(status, result)
        waiting, goal.waiting = goal.waiting, []
        for each in waiting:
            each.set_result(goal.response)
        self._publish_statuses()

    def _result(self, request: bytes) -> Future[bytes]:
        id, _ = _split(request)
        goal = self._goals.get(id)
        answered: Future[bytes] = Future()
        if goal is None:
            answered.set_result(self._type.response(0, None))
        elif goal.response:
            answered.set_result(goal.response)
        else:
            goal.waiting.append(answered)
        return answered

    def _cancel(self, request: bytes) -> Future[bytes]:
        id, stamp = self._type.cancelled(request)
        code, canceling = 0, []
        if id != _NO_ID and not stamp:
            known = self._goals.get(id)
            if known is None:
                code = _UNKNOWN_GOAL
            elif known.status not in (_ACCEPTED, _EXECUTING):
                code = _ENDED_GOAL
        text = "" if id == _NO_ID else id.hex()
        for goal in self._goals.values():
            if not goal.there or goal.status not in (_ACCEPTED, _EXECUTING):
                continue
            if is_meant(text, stamp, goal.id.hex(), goal.stamp):
                goal.status = _CANCELING
                goal.there.cancel()
                canceling.append(_info(goal.id, goal.stamp))
        answered: Future[bytes] = Future()
        answered.set_result(
            self._type.message(
                "action_msgs/srv/CancelGoal_Response", {"return_code": code, "goals_canceling": canceling}
            )
        )
        self._publish_statuses()
        return answered

    def _publish_statuses(self) -> None:
        self._forget()
        statuses = [
            {"goal_info": _info(goal.id, goal.stamp), "status": goal.status}
            for goal in self._goals.values()
            if goal.status
        ]
        self._status.publish(self._type.message("action_msgs/GoalStatusArray", {"status_list": statuses}))

    def _forget(self) -> None:
        limit = time.monotonic() - _KEPT_SECONDS
        for id in [id for id, goal in self._goals.items() if 0 < goal.ended_at < limit]:
            del self._goals[id]
