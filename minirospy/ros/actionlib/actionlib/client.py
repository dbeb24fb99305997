"""ActionClient: any number of concurrent goals for one action, each with a handle.

Source: http://wiki.ros.org/actionlib/DetailedDescription.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from typing import TypeVar

from actionlib_msgs.msg import GoalID, GoalStatusArray

from minirospy import client as rospy
from minirospy.base import times
from minirospy.base.numpy_names import add_numpy_note
from minirospy.client.connection import Connection
from minirospy.client.session import current_session
from minirospy.core.idl.protocols import Action, ActionFeedback, ActionResult, Message
from minirospy.ros.actionlib.actionlib.machine import (
    ClientGoalHandle,
    CommStateMachine,
    FeedbackCallback,
    GoalManager,
    TransitionCallback,
)
from minirospy.ros.actionlib.actionlib.spec import SERVER_SECONDS, TAKES_FAST_ANSWERS
from minirospy.ros.actionlib.actionlib.statuses import StatusList, find_status
from minirospy.ros.actionlib.actionlib.waiting import Waiting

__all__ = ["ActionClient"]

_M = TypeVar("_M", bound=Message)


class ActionClient:
    """A client for the action server in the namespace ``ns``; ``ActionSpec`` is the action's class.

    The parameters ``actionlib_client_pub_queue_size`` and ``actionlib_client_sub_queue_size`` set the client's queue sizes.
    Raise ActionException if ``ActionSpec`` is not an action class.
    """

    def __init__(self, ns: str, ActionSpec: type[Action]) -> None:
        self.ns = ns
        self.last_status_msg: GoalStatusArray | None = None
        self._news = Waiting()
        self.manager = GoalManager(ActionSpec)
        self.ActionSpec = ActionSpec
        self.ActionGoal = self.manager.ActionGoal
        self.ActionResult = self.manager.ActionResult
        self.ActionFeedback = self.manager.ActionFeedback

        listener = _Listener(self._news.notify)
        self.pub_queue_size: int = rospy.get_param("actionlib_client_pub_queue_size", 10)
        if self.pub_queue_size < 0:
            self.pub_queue_size = 10

        # Disable Nagle's algorithm: it delays a small message until the previous one is acknowledged.
        self.pub_goal = rospy.Publisher(
            rospy.remap_name(ns) + "/goal",
            self.ActionGoal,
            subscriber_listener=listener,
            tcp_nodelay=True,
            headers=TAKES_FAST_ANSWERS,
            queue_size=self.pub_queue_size,
        )
        self.pub_cancel = rospy.Publisher(
            rospy.remap_name(ns) + "/cancel",
            GoalID,
            subscriber_listener=listener,
            tcp_nodelay=True,
            queue_size=self.pub_queue_size,
        )

        self.manager.register_send_goal_fn(self.pub_goal.publish)
        self.manager.register_cancel_fn(self.pub_cancel.publish)
        self.sub_queue_size: int | None = rospy.get_param("actionlib_client_sub_queue_size", -1)
        if self.sub_queue_size is not None and self.sub_queue_size < 0:
            self.sub_queue_size = None

        self.status_sub = self._subscribe("/status", StatusList, self._status_cb)
        self.result_sub = self._subscribe("/result", self.ActionResult, self._result_cb)
        self.feedback_sub = self._subscribe("/feedback", self.ActionFeedback, self._feedback_cb)

    def stop(self) -> None:
        """Unregister from the action's topics."""
        # Other clients in this process may share these subscriptions, so remove only this client's callbacks.
        for subscriber in (self.status_sub, self.result_sub, self.feedback_sub):
            impl = subscriber.impl
            if impl and (subscription := impl.subscription):
                _remove(subscription.on_ended, self._status_link_ended)
                _remove(subscription.on_connected, self._news.notify)
        for end in (self.pub_goal, self.pub_cancel, self.status_sub, self.result_sub, self.feedback_sub):
            end.unregister()

    def send_goal(
        self,
        goal: Message,
        transition_cb: TransitionCallback | None = None,
        feedback_cb: FeedbackCallback | None = None,
    ) -> ClientGoalHandle:
        """Send a goal and return its handle. Keep a reference to the handle: the callbacks are only called while it exists.

        ``transition_cb(handle)`` is called on each state change, and ``feedback_cb(handle, feedback)`` for each feedback
        message. Both are called in the library's threads: one at a time for each goal, but concurrently for different
        goals.
        """
        impl = self.status_sub.impl
        subscription = impl and impl.subscription
        if subscription and self._status_link_ended not in subscription.on_ended:
            subscription.on_ended.append(self._status_link_ended)
        return self.manager.init_goal(goal, transition_cb, feedback_cb)

    def cancel_all_goals(self) -> None:
        """Send the server a request to cancel all its goals, including those from other clients."""
        self.pub_cancel.publish(GoalID())

    def cancel_goals_at_and_before_time(self, time: times.Time) -> None:
        """Send the server a request to cancel all goals stamped at or before ``time``, including those from other clients."""
        self.pub_cancel.publish(GoalID(stamp=time))

    def wait_for_action_server_to_start(self, timeout: times.Duration = rospy.Duration()) -> bool:  # noqa: B008
        """Wait for the server: the old name of :meth:`wait_for_server`."""
        return self.wait_for_server(timeout)

    def wait_for_server(self, timeout: times.Duration = rospy.Duration()) -> bool:  # noqa: B008
        """Wait until a server is connected on all five topics; return False after ``timeout`` (zero Duration: no timeout).

        Raise ROSException in a forked process that has not called init_node.
        """
        session = current_session()
        if session.is_fork_without_node:
            raise rospy.ROSException(session.why_fork_has_no_effect(f"the action client of {self.ns}"))
        for subscriber in (self.result_sub, self.feedback_sub):
            impl = subscriber.impl
            subscription = impl and impl.subscription
            if subscription and self._news.notify not in subscription.on_connected:
                subscription.on_connected.append(self._news.notify)
        return self._news.wait_for(self._is_connected, timeout)

    def _is_connected(self) -> bool:
        if self.last_status_msg is None:
            return False
        server = self.last_status_msg._connection_header["callerid"]
        return all(
            impl is not None and any(_peer(link) == server for link in impl.connections)
            for impl in (
                end.impl for end in (self.pub_goal, self.pub_cancel, self.result_sub, self.feedback_sub)
            )
        )

    def _status_link_ended(self) -> None:
        """Check whether the server is gone, SERVER_SECONDS after a status connection has ended. Called on the loop."""
        if goals := self.manager.unfinished():
            self._check_later(goals)

    def _check_later(self, goals: list[CommStateMachine]) -> None:
        # Use a wall-clock timer instead of rospy.Timer, because a simulated clock may stop when the server does.
        timer = threading.Timer(SERVER_SECONDS, self._check_server, (goals, self.last_status_msg))
        timer.daemon = True
        timer.start()

    def _check_server(self, goals: list[CommStateMachine], last: GoalStatusArray | None) -> None:
        """Mark ``goals`` as LOST if no server is connected, else those missing from a status list newer than ``last``."""
        impl = self.status_sub.impl  # read the attribute once: stop() in another thread may set it to None
        if rospy.is_down() or impl is None:
            return
        statuses = self.last_status_msg
        is_connected = impl.get_num_connections() > 0
        if is_connected and (statuses is last or statuses is None):
            self._check_later(goals)
            return

        for goal in goals:
            goal_id = goal.action_goal.goal_id.id
            is_listed = is_connected and statuses is not None and find_status(statuses, goal_id) is not None
            if not is_listed and _lose(goal):
                rospy.logerr(
                    "The action server [%s] has died or is unreachable: goal %s is LOST",
                    rospy.resolve_name(self.ns),
                    goal_id,
                )

    def _subscribe(
        self, name: str, data_class: type[_M], callback: Callable[[_M], None]
    ) -> rospy.Subscriber[_M]:
        return rospy.Subscriber(
            rospy.remap_name(self.ns) + name,
            data_class,
            callback=callback,
            queue_size=self.sub_queue_size,
            tcp_nodelay=True,
        )

    def _status_cb(self, msg: GoalStatusArray) -> None:
        self.last_status_msg = msg
        self.manager.update_statuses(msg)
        self._news.notify()

    def _result_cb(self, msg: ActionResult) -> None:
        self.manager.update_results(msg)

    def _feedback_cb(self, msg: ActionFeedback) -> None:
        self.manager.update_feedbacks(msg)


def _remove(functions: list[Callable[[], object]], function: Callable[[], object]) -> None:
    """Remove ``function`` from ``functions``, unless another thread has already removed it."""
    with contextlib.suppress(ValueError):
        functions.remove(function)


def _lose(goal: CommStateMachine) -> bool:
    """Mark ``goal`` as LOST and log any error from its callback; return False if the goal had already ended."""
    try:
        return goal.lose()
    except BaseException as error:  # noqa: BLE001 - user code failed, but the goal has ended
        add_numpy_note(error)
        session = current_session()
        # As in a Subscriber's callback, ignore errors during a shutdown.
        if not session.lifecycle.is_shutdown_requested:
            session.callback_errors.log(goal.transition_cb, error)
        return True


class _Listener(rospy.SubscribeListener):
    """Calls ``notify`` for each new subscriber."""

    def __init__(self, notify: Callable[[], None]) -> None:
        self._notify = notify

    def peer_subscribe(
        self, topic_name: str, topic_publish: Callable[..., None], peer_publish: Callable[..., None]
    ) -> None:
        """Call ``notify``."""
        self._notify()


def _peer(connection: Connection) -> str:
    """Return the name of the node at the other end of a connection."""
    return connection.callerid_pub if connection.direction == "i" else connection.endpoint_id
