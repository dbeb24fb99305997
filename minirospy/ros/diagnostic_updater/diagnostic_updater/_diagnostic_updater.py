"""Diagnostic tasks, and the updater that runs them and publishes their statuses.

Source: http://wiki.ros.org/diagnostic_updater.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray

from minirospy import client as rospy
from minirospy.ros.diagnostic_updater.diagnostic_updater._diagnostic_status_wrapper import (
    OK,
    DiagnosticStatusWrapper,
)

__all__ = [
    "CompositeDiagnosticTask",
    "DiagnosticTask",
    "DiagnosticTaskVector",
    "FunctionDiagnosticTask",
    "Updater",
]

Status = DiagnosticStatusWrapper
Fill = Callable[[Status], Status]

_PERIOD_CHECK = 0.25  # seconds between checks of ~diagnostic_period
_NO_HARDWARE_ID = (
    "diagnostic_updater: No HW_ID was set. This is probably a bug. Please report it. For devices that do not have a "
    "HW_ID, set this value to 'none'. This warning only occurs once all diagnostics are OK so it is okay to wait until "
    "the device is open before calling setHardwareID."
)


class DiagnosticTask:
    """A named task; subclasses override ``run`` to fill a status."""

    def __init__(self, name: str) -> None:
        self.name = name

    def getName(self) -> str:
        """Return the task's name."""
        return self.name

    def run(self, stat: Status) -> Status:
        """Fill a status and return it."""
        return stat


class FunctionDiagnosticTask(DiagnosticTask):
    """A task that calls a function to fill the status."""

    def __init__(self, name: str, fn: Fill) -> None:
        super().__init__(name)
        self.fn = fn

    def run(self, stat: Status) -> Status:
        """Call the function with the status and return its result."""
        return self.fn(stat)


class CompositeDiagnosticTask(DiagnosticTask):
    """Combines several tasks into one status with all their values, the highest level and the merged messages."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.tasks: list[DiagnosticTask] = []

    def addTask(self, t: DiagnosticTask) -> None:
        """Add a task."""
        self.tasks.append(t)

    def run(self, stat: Status) -> Status:
        """Run each task with the initial summary, then merge their summaries."""
        initial, merged = DiagnosticStatusWrapper(), DiagnosticStatusWrapper()
        initial.summary(stat)
        for task in self.tasks:
            stat.summary(initial)
            # If a task returns None, it has filled the status in place.
            stat = task.run(stat) or stat
            merged.mergeSummary(stat)
        stat.summary(merged)
        return stat


class DiagnosticTaskVector:
    """A thread-safe list of tasks."""

    class DiagnosticTaskInternal:
        """A list entry: a name and a function."""

        def __init__(self, name: str, fn: Fill) -> None:
            self.name = name
            self.fn = fn

        def run(self, stat: Status) -> Status:
            """Fill a status: set its name to the task's name, then call the task's function."""
            stat.name = self.name
            return self.fn(stat)

    def __init__(self) -> None:
        self.tasks: list[DiagnosticTaskVector.DiagnosticTaskInternal] = []
        self.lock = threading.Lock()

    def addedTaskCallback(self, task: DiagnosticTaskInternal) -> None:
        """Do nothing. Called for each added task; subclasses may override this method."""

    def add(self, *args: Any) -> None:
        """Add a task: ``add(task)`` or ``add(name, function)``. Raise TypeError for other arguments."""
        if len(args) == 1:
            name, fill = args[0].getName(), args[0].run
        elif len(args) == 2:
            name, fill = args
        else:
            raise TypeError("add takes a task, or a name and a function")
        task = DiagnosticTaskVector.DiagnosticTaskInternal(name, fill)
        with self.lock:
            self.tasks.append(task)
            self.addedTaskCallback(task)

    def removeByName(self, name: str) -> bool:
        """Remove the first task with this name; return whether there was one."""
        with self.lock:
            for task in self.tasks:
                if task.name == name:
                    self.tasks.remove(task)
                    return True
        return False


class Updater(DiagnosticTaskVector):
    """Runs its tasks in ``update`` every ~diagnostic_period seconds (default 1) and publishes their statuses on /diagnostics."""

    def __init__(self) -> None:
        super().__init__()
        self.publisher: rospy.Publisher[DiagnosticArray] = rospy.Publisher(
            "/diagnostics", DiagnosticArray, queue_size=10
        )
        self.last_time = rospy.Time.now()
        self.last_time_period_checked = self.last_time
        self.period: float = 1
        self.verbose = False
        self.hwid = ""
        self.warn_nohwid_done = False

    def setHardwareID(self, hwid: str) -> None:
        """Set the hardware_id of every status."""
        self.hwid = hwid

    def update(self) -> None:
        """Run the tasks if the period has elapsed, or the clock has jumped back; call this method often."""
        self._check_diagnostic_period()
        if _has_passed(self.last_time, self.period):
            self.force_update()

    def force_update(self) -> None:
        """Run the tasks immediately and publish their statuses."""
        self.last_time = rospy.Time.now()
        with self.lock:
            statuses = [self._status_of(task) for task in self.tasks]
        if not self.hwid and not self.warn_nohwid_done and all(status.level == OK for status in statuses):
            rospy.logwarn(_NO_HARDWARE_ID)
            self.warn_nohwid_done = True
        self.publish(statuses)

    def _status_of(self, task: DiagnosticTaskVector.DiagnosticTaskInternal) -> Status:
        status = DiagnosticStatusWrapper(
            level=2, name=task.name, message="No message was set", hardware_id=self.hwid
        )
        task.run(status)
        if self.verbose and status.level:
            rospy.logwarn(
                f"Non-zero diagnostic status. Name: '{status.name}', status {status.level}: '{status.message}'"
            )
        return status

    def broadcast(self, lvl: int, msg: str) -> None:
        """Publish the same level and message for every task."""
        statuses = []
        for task in self.tasks:
            status = DiagnosticStatusWrapper(name=task.name)
            status.summary(lvl, msg)
            statuses.append(status)
        self.publish(statuses)

    def publish(self, msg: Status | list[Status]) -> None:
        """Publish one or more statuses; each name is prefixed with the node's name."""
        statuses = msg if isinstance(msg, list) else [msg]
        for status in statuses:
            status.name = f"{rospy.get_name()[1:]}: {status.name}"
        array = DiagnosticArray(status=statuses)
        array.header.stamp = rospy.Time.now()
        self.publisher.publish(array)

    def addedTaskCallback(self, task: DiagnosticTaskVector.DiagnosticTaskInternal) -> None:
        """Publish the status "Node starting up" for the new task."""
        status = DiagnosticStatusWrapper(name=task.name)
        status.summary(OK, "Node starting up")
        self.publish(status)

    def _check_diagnostic_period(self) -> None:
        if not _has_passed(self.last_time_period_checked, _PERIOD_CHECK):
            return
        self.last_time_period_checked = rospy.Time.now()
        period = rospy.get_param_cached("~diagnostic_period", 1)
        try:
            self.period = float(period)
        except (TypeError, ValueError):
            rospy.logerr_throttle(60, f"~diagnostic_period is not a number of seconds: {period!r}")


def _has_passed(since: rospy.Time, seconds: float) -> bool:
    now = rospy.Time.now()
    return now < since or now >= since + rospy.Duration.from_sec(seconds)
