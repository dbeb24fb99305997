#!/usr/bin/env python3
"""Publish whether button 1 is pressed on /button_state, ten times a second."""

import rospy
from RPi import GPIO
from std_msgs.msg import Bool

BUTTON = 11  # BCM pin number


def main() -> None:
    rospy.init_node("button_state_publisher", anonymous=True)
    GPIO.setmode(GPIO.BCM)
    GPIO.setup(BUTTON, GPIO.IN)
    publisher = rospy.Publisher("/button_state", Bool, queue_size=10)
    rate = rospy.Rate(10)  # Hz
    try:
        rate.sleep()  # subscribers need a moment to connect
        # Publish repeatedly, not only on a change, so that a subscriber that joins late receives the state, too.
        while not rospy.is_shutdown():
            publisher.publish(Bool(data=bool(GPIO.input(BUTTON))))
            rate.sleep()
    except rospy.ROSInterruptException:
        pass  # Ctrl-C while sleeping
    finally:
        GPIO.cleanup()


if __name__ == "__main__":
    main()
