"""diagnostic_updater: the reports of the tasks, and when the updater publishes them."""

import queue

import diagnostic_updater
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from diagnostic_updater import (
    CompositeDiagnosticTask,
    DiagnosedPublisher,
    DiagnosticStatusWrapper,
    FrequencyStatus,
    FrequencyStatusParam,
    FunctionDiagnosticTask,
    HeaderlessTopicDiagnostic,
    Heartbeat,
    TimeStampStatus,
    TimeStampStatusParam,
    TopicDiagnostic,
    Updater,
)
from geometry_msgs.msg import PointStamped
from referee import eventually, outcome, show

rospy.init_node("updating")


class Clock:
    """Controls the time that rospy.Time.now() returns."""

    now = 1000.0


rospy.Time.now = staticmethod(lambda: rospy.Time.from_sec(Clock.now))


def status(stat):
    return stat.level, stat.name, stat.message, [(pair.key, pair.value) for pair in stat.values]


def filled(task):
    stat = DiagnosticStatusWrapper(level=2, message="No message was set")
    result = task.run(stat)
    return result is stat, *status(stat)


# Statuses.
stat = DiagnosticStatusWrapper(name="a", message="b")
stat.summary(1, 5)
show("summary", status(stat), isinstance(stat, DiagnosticStatus))
for level, message in ((0, "fine"), (1, "warm"), (2, "hot"), (1, "again"), (0, "")):
    stat.mergeSummary(level, message)
    show("merged", status(stat))
stat.clearSummary()
stat.mergeSummary(0, "x")
stat.mergeSummary(DiagnosticStatus(level=0, message="y"))
stat.add("number", 1.5)
stat.add("list", [1, None])
show("cleared", status(stat))
other = DiagnosticStatusWrapper()
other.summary(stat)
show("copied", status(other), diagnostic_updater.OK, diagnostic_updater.WARN, diagnostic_updater.ERROR)
outcome("a field that is not there", lambda: DiagnosticStatusWrapper(colour=1))

# Frequencies.
bounds = {"min": 9, "max": 11}
frequency = FrequencyStatus(FrequencyStatusParam(bounds, 0.1, 3))
for ticks in (0, 10, 10, 40, 0, 0, 0, 1):
    Clock.now += 1
    for _ in range(ticks):
        frequency.tick()
    show("frequency", ticks, filled(frequency))
bounds["max"] = bounds["min"] = 0.5
Clock.now += 1
frequency.tick()
show("other bounds", filled(frequency))
frequency.clear()
Clock.now += 2
show("cleared", filled(frequency))
open_end = FrequencyStatus(FrequencyStatusParam({"min": 0}), name="open")
Clock.now += 1
open_end.tick()
show("no upper bound", open_end.getName(), filled(open_end))

# Stamps.
for parameters in (TimeStampStatusParam(), TimeStampStatusParam(-2, 0.5)):
    stamps = TimeStampStatus(parameters, "stamps")
    for ages in ((), (0.1, 1, -1.5), (6,), (-3, 7), (), (0.2,)):
        for age in ages:
            stamps.tick(rospy.Time.from_sec(Clock.now - age))
        show("stamps", ages, filled(stamps))
    stamps.tick(0.0)
    stamps.tick(Clock.now - 0.25)
    stamps.tick(rospy.Time())
    show("zero", filled(stamps))
show("heartbeat", Heartbeat().getName(), filled(Heartbeat()))


# One status of several tasks.
def warns(stat):
    stat.summary(1, "warm")
    stat.add("degrees", 60)
    return stat


def keeps(stat):
    stat.add("was", stat.message)
    return stat


several = CompositeDiagnosticTask("several")
show("composite of none", filled(several))
several.addTask(Heartbeat())
several.addTask(FunctionDiagnosticTask("warns", warns))
several.addTask(FunctionDiagnosticTask("keeps", keeps))
show("composite", several.getName(), filled(several))

# The updater.
arrays = queue.Queue()
subscriber = rospy.Subscriber("/diagnostics", DiagnosticArray, arrays.put)
updater = Updater()
eventually(lambda: updater.publisher.get_num_connections() and subscriber.get_num_connections())


def published(label, call):
    """Print a call's published messages, and the number of arrays."""
    call()
    updater.publish(DiagnosticStatusWrapper(name="end"))
    while True:
        array = arrays.get(timeout=30)
        if array.status[0].name.endswith(": end"):
            break
        show(label, array.header.stamp.to_sec(), [(*status(each), each.hardware_id) for each in array.status])


published("add", lambda: updater.add("warns", warns))
published("add task", lambda: updater.add(several))
published("too early", updater.update)
Clock.now += 0.5
published("too early", updater.update)
Clock.now += 0.5
published("update", updater.update)
updater.setHardwareID("device 7")
published("forced", updater.force_update)
published("broadcast", lambda: updater.broadcast(2, "shutting down"))
rospy.set_param("~diagnostic_period", 0.3)
Clock.now += 0.31
updater.update()

published("new period", updater.update)
show("removed", updater.removeByName("several"), updater.removeByName("several"))
Clock.now += 5
published("after removal", updater.update)
published("unfilled", lambda: (updater.add("unfilled", lambda stat: stat), updater.force_update()))
outcome("a task that raises", lambda: (updater.add("raises", lambda stat: 1 / 0), updater.force_update()))
updater.removeByName("raises")
outcome("of nothing", lambda: updater.add(5))

# Topics.
topics = Updater()
headerless = HeaderlessTopicDiagnostic("scan", topics, FrequencyStatusParam({"min": 1, "max": 5}))
stamped = TopicDiagnostic("cloud", topics, FrequencyStatusParam({"min": 1}), TimeStampStatusParam())
points = rospy.Publisher("points", PointStamped, queue_size=1, latch=True)
diagnosed = DiagnosedPublisher(points, topics, FrequencyStatusParam({"min": 1}), TimeStampStatusParam())
Clock.now += 1
headerless.tick()
stamped.tick(Clock.now - 0.25)
message = PointStamped()
message.header.stamp = rospy.Time.from_sec(Clock.now - 0.5)
diagnosed.publish(message)
show("points", rospy.wait_for_message("points", PointStamped, 20).header.stamp.to_sec())
published("topics", topics.force_update)
headerless.clear_window()
Clock.now += 1
published("topics", topics.force_update)
