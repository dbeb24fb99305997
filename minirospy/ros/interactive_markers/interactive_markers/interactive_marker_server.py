"""The server for interactive markers: publishes a program's changes to its markers, and receives feedback from viewers.

Topics: NS/update, NS/update_full (latched, all markers), NS/feedback.
Source: http://wiki.ros.org/rviz/Tutorials/Interactive%20Markers%3A%20Basic%20Controls.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Lock

from geometry_msgs.msg import Pose
from std_msgs.msg import Header
from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerPose,
    InteractiveMarkerUpdate,
)

from minirospy import client as rospy

__all__ = ["Header", "InteractiveMarkerServer", "MarkerContext", "UpdateContext"]

Callback = Callable[[InteractiveMarkerFeedback], object]

_QUEUE_SIZE = 100
_KEEP_ALIVE = 0.5  # seconds between keep-alive updates to viewers
_TURN = 1.0  # seconds for which one viewer's feedback blocks feedback from others
_UNCHANGED: Callback | int = -1


class MarkerContext:
    """A published marker."""

    def __init__(self) -> None:
        self.last_feedback = rospy.Time.now()
        self.last_client_id = ""
        self.default_feedback_cb: Callback | None = None
        self.feedback_cbs: dict[int, Callback] = {}
        self.int_marker = InteractiveMarker()


@dataclass
class UpdateContext:
    """A pending change to a marker."""

    FULL_UPDATE = 0
    POSE_UPDATE = 1
    ERASE = 2

    update_type: int = FULL_UPDATE
    int_marker: InteractiveMarker = field(default_factory=InteractiveMarker)
    default_feedback_cb: Callback | None = None
    feedback_cbs: dict[int, Callback] = field(default_factory=dict)


class InteractiveMarkerServer:
    """Serves the markers in a namespace. ``applyChanges`` publishes pending changes."""

    DEFAULT_FEEDBACK_CB = 255

    def __init__(self, topic_ns: str, server_id: str = "", q_size: int = 100) -> None:
        """Create a server. A node with several servers must set ``server_id``; ``q_size`` is the feedback queue's size."""
        self.topic_ns = topic_ns
        self.seq_num = 0
        self.mutex = Lock()
        self.server_id = rospy.get_name() + server_id
        self.marker_contexts: dict[str, MarkerContext] = {}
        self.pending_updates: dict[str, UpdateContext] = {}

        self.init_pub: rospy.Publisher[InteractiveMarkerInit] = rospy.Publisher(
            f"{topic_ns}/update_full", InteractiveMarkerInit, latch=True, queue_size=_QUEUE_SIZE
        )
        self.update_pub: rospy.Publisher[InteractiveMarkerUpdate] = rospy.Publisher(
            f"{topic_ns}/update", InteractiveMarkerUpdate, queue_size=_QUEUE_SIZE
        )
        self._subscriber = rospy.Subscriber(
            f"{topic_ns}/feedback", InteractiveMarkerFeedback, self.processFeedback, queue_size=q_size
        )
        self._timer = rospy.Timer(rospy.Duration(_KEEP_ALIVE), self.keepAlive, reset=True)
        self.publishInit()

    # --- public methods

    def insert(
        self,
        marker: InteractiveMarker,
        feedback_cb: Callback | int | None = _UNCHANGED,
        feedback_type: int = DEFAULT_FEEDBACK_CB,
    ) -> None:
        """Add or replace a marker; see ``setCallback`` for the other arguments."""
        with self.mutex:
            update = self.pending_updates.setdefault(marker.name, UpdateContext())
            update.update_type = UpdateContext.FULL_UPDATE
            update.int_marker = marker
        if not isinstance(feedback_cb, int):
            self.setCallback(marker.name, feedback_cb, feedback_type)

    def setCallback(
        self, name: str, feedback_cb: Callback | None, feedback_type: int = DEFAULT_FEEDBACK_CB
    ) -> bool:
        """Set the callback for one type of feedback, or the default callback, for types that have no callback of their own.

        None removes the callback. The change takes effect immediately. Return whether the marker exists.
        """
        with self.mutex:
            found = [
                context
                for context in (self.marker_contexts.get(name), self.pending_updates.get(name))
                if context is not None
            ]
            for context in found:
                if feedback_type == self.DEFAULT_FEEDBACK_CB:
                    context.default_feedback_cb = feedback_cb
                elif feedback_cb:
                    context.feedback_cbs[feedback_type] = feedback_cb
                else:
                    context.feedback_cbs.pop(feedback_type, None)
            return bool(found)

    def setPose(self, name: str, pose: Pose, header: Header = Header()) -> bool:  # noqa: B008 - it is only read
        """Move a marker; without a frame in ``header``, keep the marker's header. Return whether the marker has been published.

        As in ROS, a marker that the next ``applyChanges`` adds or replaces is not moved.
        """
        with self.mutex:
            context, update = self.marker_contexts.get(name), self.pending_updates.get(name)
            if context is None or (update is not None and update.update_type == UpdateContext.FULL_UPDATE):
                return False
            if not header.frame_id:
                header = context.int_marker.header
            self.doSetPose(update, name, pose, header)
            return True

    def erase(self, name: str) -> bool:
        """Erase a marker; return whether it exists."""
        with self.mutex:
            if name not in self.pending_updates and name not in self.marker_contexts:
                return False
            self.pending_updates.setdefault(name, UpdateContext()).update_type = UpdateContext.ERASE
            return True

    def clear(self) -> None:
        """Erase all markers and discard pending changes."""
        with self.mutex:
            self.pending_updates = {name: UpdateContext(UpdateContext.ERASE) for name in self.marker_contexts}

    def get(self, name: str) -> InteractiveMarker | None:
        """Return a marker with its pending changes, or None if it does not exist."""
        context, update = self.marker_contexts.get(name), self.pending_updates.get(name)
        if update is None:
            return context.int_marker if context else None
        if update.update_type == UpdateContext.FULL_UPDATE:
            return update.int_marker
        if update.update_type == UpdateContext.ERASE or context is None:
            return None
        context.int_marker.pose = update.int_marker.pose
        return context.int_marker

    def applyChanges(self) -> None:
        """Publish the pending changes."""
        with self.mutex:
            if not self.pending_updates:
                return
            message = InteractiveMarkerUpdate(type=InteractiveMarkerUpdate.UPDATE)
            for name, update in self.pending_updates.items():
                self._apply(name, update, message)
            self.pending_updates = {}
            self.seq_num += 1
            # Publish while holding the lock, so that messages are sent in the order of their sequence numbers.
            self.publish(message)
        self.publishInit()

    def _apply(self, name: str, update: UpdateContext, message: InteractiveMarkerUpdate) -> None:
        """Apply a change to a marker and add the change to a message."""
        context = self.marker_contexts.get(name)
        if update.update_type == UpdateContext.FULL_UPDATE:
            if context is None:
                context = self.marker_contexts[name] = MarkerContext()
                context.default_feedback_cb = update.default_feedback_cb
                context.feedback_cbs = update.feedback_cbs
            context.int_marker = update.int_marker
            message.markers.append(context.int_marker)
        elif context is None:
            # The marker was added and erased since the last applyChanges(), so it was never published.
            return
        elif update.update_type == UpdateContext.POSE_UPDATE:
            marker = context.int_marker
            marker.pose, marker.header = update.int_marker.pose, update.int_marker.header
            message.poses.append(
                InteractiveMarkerPose(header=marker.header, pose=marker.pose, name=marker.name)
            )
        else:
            del self.marker_contexts[name]
            message.erases.append(name)

    # --- messages from and to viewers

    def processFeedback(self, feedback: InteractiveMarkerFeedback) -> None:
        """Move a marker at a viewer's request and call the program's callback.

        For the next second, ignore other viewers' feedback on that marker.
        """
        with self.mutex:
            context = self.marker_contexts.get(feedback.marker_name)
            if context is None:
                return
            now = rospy.Time.now()
            age = (now - context.last_feedback).to_sec()
            # A negative age means that the clock has jumped back.
            if context.last_client_id != feedback.client_id and 0 <= age < _TURN:
                rospy.logdebug(
                    f"Rejecting feedback for {feedback.marker_name}: conflicting feedback from separate clients."
                )
                return
            context.last_feedback, context.last_client_id = now, feedback.client_id

            if feedback.event_type == feedback.POSE_UPDATE:
                # If the marker's header has no timestamp, keep that header.
                header = context.int_marker.header
                self.doSetPose(
                    self.pending_updates.get(feedback.marker_name),
                    feedback.marker_name,
                    feedback.pose,
                    feedback.header if header.stamp else header,
                )
            callback = context.feedback_cbs.get(feedback.event_type, context.default_feedback_cb)
        if callback is not None:
            callback(feedback)

    def keepAlive(self, msg: object) -> None:
        """Publish an update without changes."""
        with self.mutex:
            self.publish(InteractiveMarkerUpdate(type=InteractiveMarkerUpdate.KEEP_ALIVE))

    def publish(self, update: InteractiveMarkerUpdate) -> None:
        """Publish an update with the server's ID and sequence number; the caller holds the lock."""
        update.server_id = self.server_id
        update.seq_num = self.seq_num
        self.update_pub.publish(update)

    def publishInit(self) -> None:
        """Publish all markers, latched for viewers that connect later."""
        with self.mutex:
            markers = [context.int_marker for context in self.marker_contexts.values()]
            self.init_pub.publish(
                InteractiveMarkerInit(server_id=self.server_id, seq_num=self.seq_num, markers=markers)
            )

    def doSetPose(self, update: UpdateContext | None, name: str, pose: Pose, header: Header) -> None:
        """Add a new pose to the pending changes; the caller holds the lock."""
        if update is None:
            update = self.pending_updates[name] = UpdateContext(UpdateContext.POSE_UPDATE)
        elif update.update_type != UpdateContext.FULL_UPDATE:
            update.update_type = UpdateContext.POSE_UPDATE
        update.int_marker.pose = pose
        update.int_marker.header = header
