"""Topic statistics: with /enable_statistics a subscriber reports what it receives, on /statistics."""

import rospy
from geometry_msgs.msg import PointStamped
from referee import eventually, show
from rosgraph_msgs.msg import TopicStatistics
from std_msgs.msg import String

rospy.init_node("case", argv=[])
rospy.set_param("/enable_statistics", True)
reports = []
rospy.Subscriber("/statistics", TopicStatistics, reports.append)
text = rospy.Publisher("/text", String, queue_size=10)
stamped = rospy.Publisher("/stamped", PointStamped, queue_size=10)
rospy.Subscriber("/text", String, lambda message: None)
rospy.Subscriber("/stamped", PointStamped, lambda message: None)
show(eventually(lambda: text.get_num_connections() == 1 and stamped.get_num_connections() == 1))
rospy.sleep(0.5)
rate = rospy.Rate(50)


def found_in(report):
    """Return whether the window, its messages, and the times between them are as expected."""
    seconds = (report.window_stop - report.window_start).to_sec()
    return (
        1.9 < seconds < 2.3,
        60 < report.delivered_msgs <= 110,
        0.015 < report.period_mean.to_sec() < 0.035,
        report.period_stddev.to_sec() < 0.02,
        round(report.stamp_age_max.to_sec(), 1) in (0.0, 0.5),
    )


def whole():
    """Return the first report of each topic about a complete window, in which the machine did not stall."""
    return {report.topic: report for report in reversed(reports) if all(found_in(report))}


for _ in range(2000):
    text.publish("abc")
    message = PointStamped()
    message.header.stamp = rospy.Time.now() - rospy.Duration(0.5)
    stamped.publish(message)
    rate.sleep()
    if len(whole()) == 2:
        break
show(sorted(whole()))
for topic, report in sorted(whole().items()):
    window, messages, mean, deviation, _ = found_in(report)
    show(topic, report.node_pub, report.node_sub, report.dropped_msgs, report.traffic / report.delivered_msgs)
    show("window", window, "messages", messages)
    show("period", mean, deviation)
    show("age", round(report.stamp_age_mean.to_sec(), 1), round(report.stamp_age_max.to_sec(), 1))
show(sorted(pair for pair in rospy.get_published_topics() if pair[0] == "/statistics"))
