#!/usr/bin/env python3
"""Send /set_led_zone_state the zone of the closest object: 0 beyond 0.4 m, 1 in between, 2 closer than 0.2 m."""

import rospy
from rpi_msgs.srv import safetyZone
from sensor_msgs.msg import LaserScan

FAR, NEAR = 0.4, 0.2  # metres
GREEN, YELLOW, RED = range(3)


def zone_of(distance: float) -> int:
    if distance > FAR:
        return GREEN
    return YELLOW if distance > NEAR else RED


def main() -> None:
    rospy.init_node("sick_zone")
    rospy.wait_for_service("/set_led_zone_state")
    set_zone = rospy.ServiceProxy("/set_led_zone_state", safetyZone)
    published = None

    def measured(scan: LaserScan) -> None:
        nonlocal published
        zone = zone_of(min(scan.ranges))
        if zone == published:
            return
        try:
            rospy.loginfo(set_zone(zone).message)
            published = zone
        except rospy.ServiceException as error:
            rospy.logwarn(error)
        except rospy.ROSInterruptException:
            pass  # Ctrl-C during the call

    rospy.Subscriber("/sick_safetyscanners/scan", LaserScan, measured, queue_size=1)
    rospy.spin()


if __name__ == "__main__":
    try:
        main()
    except rospy.ROSInterruptException:
        pass  # Ctrl-C while waiting for the service
