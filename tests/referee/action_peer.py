"""Helpers for the actions cases: scripted endpoints of an action on its five topics, and the log lines of actionlib."""

from __future__ import annotations

import logging
import re
import threading

import rospy
from actionlib.msg import TestActionFeedback, TestActionGoal, TestActionResult, TestGoal
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from referee import eventually, show

_NAMES = {
    value: name for name, value in vars(GoalStatus).items() if name.isupper() and isinstance(value, int)
}
# Log lines from rospy itself, which are not compared.
_OTHERS = re.compile(
    r"connecting to |\[/.*failed to receive|.*topic|.*TCPROS|node|init_node|signal_shutdown|the first message"
)
_STAMP = re.compile(r"stamp: 1[5-9]\d{8}\.\d\d")
_ID = re.compile(r"(/\w+)-(\d+)-1[5-9]\d{8}\.\d+")


def name_of(status):
    """Return the name of a status, such as PENDING."""
    return _NAMES.get(status, status)


def mask(text):
    """Return a string with the times masked."""
    text = _STAMP.sub("stamp: <stamp>", _ID.sub(r"\1-\2-<stamp>", text))
    return re.sub(r"<bound method (\S+) of .*?>>", r"\1", text)


class Story:
    """Records callbacks and log lines from all threads in order, and prints them when the case requests it."""

    def __init__(self, level=logging.DEBUG):
        self._changed = threading.Condition()
        self._lines = []
        self._said = 0
        logger = logging.getLogger("rosout")
        logger.handlers[:] = [_LogLines(self, level)]
        logger.setLevel(level)

    def say(self, *values):
        """Return a callback that prints its call."""
        with self._changed:
            self._lines.append(" ".join(map(str, values)))
            self._said += 1
            self._changed.notify_all()

    def log(self, *values):
        """Print a line of the log."""
        with self._changed:
            self._lines.append(" ".join(map(str, values)))
            self._changed.notify_all()

    def wait(self, count, seconds=30):
        """Return whether callbacks add ``count`` entries in time, counted since the last tell()."""
        with self._changed:
            return self._changed.wait_for(lambda: self._said >= count, seconds)

    def wait_log(self, text, seconds=30):
        """Return whether a line with this text is logged in time, or has been since the last tell()."""
        with self._changed:
            return self._changed.wait_for(lambda: any(text in line for line in self._lines), seconds)

    def tell(self):
        """Print the entries since the last call."""
        with self._changed:
            for line in self._lines:
                show("  ", mask(line))
            self._lines = []
            self._said = 0


class _LogLines(logging.Handler):
    def __init__(self, story, level):
        super().__init__(level)
        self._story = story

    def emit(self, record):
        text = record.getMessage()
        if not _OTHERS.match(text):
            # Print only the exception of a traceback: its lines of code differ.
            lines = text.splitlines() or [""]
            self._story.log(
                "log", record.levelname, lines[0], *(["...", lines[-1]] if len(lines) > 1 else [])
            )


class RawClient:
    """A scripted client that sends on demand, and records the messages that it receives."""

    def __init__(self, ns, hides_pending=False):
        self._hides_pending = hides_pending
        self._changed = threading.Condition()
        self.statuses = {}
        self.seen = {}
        self._last = {}
        self.results = []
        self.feedback = []
        self.arrays = 0
        self.array = None
        self.goal_pub = rospy.Publisher(ns + "/goal", TestActionGoal, queue_size=10)
        self.cancel_pub = rospy.Publisher(ns + "/cancel", GoalID, queue_size=10)
        self.subscribers = [
            rospy.Subscriber(ns + "/status", GoalStatusArray, self._on_status),
            rospy.Subscriber(ns + "/result", TestActionResult, self._on_result),
            rospy.Subscriber(ns + "/feedback", TestActionFeedback, self._on_feedback),
        ]
        ends = [self.goal_pub, self.cancel_pub, *self.subscribers]
        assert eventually(lambda: all(end.get_num_connections() for end in ends))

    def goal(self, id, goal=0, stamp=None):
        """Send a goal; without ``stamp`` it has none."""
        message = TestActionGoal(goal_id=GoalID(id=id), goal=TestGoal(goal))
        if stamp is not None:
            message.goal_id.stamp = stamp
        self.goal_pub.publish(message)

    def cancel(self, id="", stamp=None):
        """Send a cancel request; without ``stamp`` it has none."""
        message = GoalID(id=id)
        if stamp is not None:
            message.stamp = stamp
        self.cancel_pub.publish(message)

    def wait_status(self, id, status, seconds=30):
        """Return whether the status list reports this status for a goal in time."""
        with self._changed:
            return self._changed.wait_for(lambda: self.statuses.get(id) == status, seconds)

    def wait_told(self, id, name, seconds=30):
        """Return whether status lists report this status of a goal in time, or have since the last tell()."""
        with self._changed:
            return self._changed.wait_for(
                lambda: any(said.startswith(f"{name}(") for said in self.seen.get(id, ())), seconds
            )

    def wait_gone(self, id, seconds=30):
        """Return whether the status list no longer contains a goal in time."""
        with self._changed:
            return self._changed.wait_for(lambda: self.arrays and id not in self.statuses, seconds)

    def wait_results(self, count, seconds=30):
        """Return whether this many results arrive."""
        with self._changed:
            return self._changed.wait_for(lambda: len(self.results) >= count, seconds)

    def wait_feedback(self, count, seconds=30):
        """Return whether this many feedback messages arrive."""
        with self._changed:
            return self._changed.wait_for(lambda: len(self.feedback) >= count, seconds)

    def tell(self):
        """Print the messages about each goal since the last call, in order."""
        with self._changed:
            for id, statuses in sorted(self.seen.items()):
                is_hidden = self._hides_pending and len(statuses) > 1 and statuses[0] == "PENDING()"
                show("   statuses of", id, *statuses[is_hidden:])
            for result in self.results:
                show("   result", *result)
            for feedback in self.feedback:
                show("   feedback", *feedback)
            self.seen, self.results, self.feedback = {}, [], []

    def _on_status(self, message):
        with self._changed:
            self.arrays += 1
            self.array = message
            self.statuses = {}
            for status in message.status_list:
                id = mask(status.goal_id.id)
                self.statuses[id] = status.status
                said = f"{name_of(status.status)}({status.text})"
                if self._last.get(id) != said:
                    self._last[id] = said
                    self.seen.setdefault(id, []).append(said)
            self._changed.notify_all()

    def _on_result(self, message):
        with self._changed:
            id = mask(message.status.goal_id.id)
            self.results.append(
                (id, name_of(message.status.status), repr(message.status.text), message.result.result)
            )
            self._changed.notify_all()

    def _on_feedback(self, message):
        with self._changed:
            id = mask(message.status.goal_id.id)
            self.feedback.append(
                (id, name_of(message.status.status), repr(message.status.text), message.feedback.feedback)
            )
            self._changed.notify_all()


class RawServer:
    """A scripted server that records the goals and cancel requests that it receives, and publishes on demand."""

    def __init__(self, ns):
        self._changed = threading.Condition()
        self.goals = []
        self.cancels = []
        self.status_pub = rospy.Publisher(ns + "/status", GoalStatusArray, latch=True, queue_size=50)
        self.result_pub = rospy.Publisher(ns + "/result", TestActionResult, queue_size=50)
        self.feedback_pub = rospy.Publisher(ns + "/feedback", TestActionFeedback, queue_size=50)
        self.subscribers = [
            rospy.Subscriber(ns + "/goal", TestActionGoal, self._on_goal),
            rospy.Subscriber(ns + "/cancel", GoalID, self._on_cancel),
        ]

    def connected(self):
        """Return whether a client connects to all topics."""
        ends = [self.status_pub, self.result_pub, self.feedback_pub, *self.subscribers]
        return eventually(lambda: all(end.get_num_connections() for end in ends))

    def wait_goals(self, count, seconds=30):
        """Return whether this many goals arrive."""
        with self._changed:
            return self._changed.wait_for(lambda: len(self.goals) >= count, seconds)

    def wait_cancels(self, count, seconds=30):
        """Return whether this many cancel requests arrive."""
        with self._changed:
            return self._changed.wait_for(lambda: len(self.cancels) >= count, seconds)

    def status(self, *statuses):
        """Publish a status list of (id, status, text)."""
        said = [GoalStatus(GoalID(id=id), status, text) for id, status, text in statuses]
        message = GoalStatusArray(status_list=said)
        message.header.stamp = rospy.Time.now()
        self.status_pub.publish(message)

    def result(self, id, status, text="", result=0):
        """Publish the result of a goal."""
        message = TestActionResult(status=GoalStatus(GoalID(id=id), status, text))
        message.result.result = result
        self.result_pub.publish(message)

    def feedback(self, id, feedback):
        """Publish the feedback of a goal."""
        message = TestActionFeedback(status=GoalStatus(GoalID(id=id), GoalStatus.ACTIVE, ""))
        message.feedback.feedback = feedback
        self.feedback_pub.publish(message)

    def _on_goal(self, message):
        with self._changed:
            self.goals.append(message)
            self._changed.notify_all()

    def _on_cancel(self, message):
        with self._changed:
            self.cancels.append(message)
            self._changed.notify_all()
