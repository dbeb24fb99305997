#!/usr/bin/env python3
"""Light the second red LED while /button_state is True."""

import rospy
from RPi import GPIO
from std_msgs.msg import Bool

LED = 7  # BCM pin number
ALL_LEDS = range(2, 8)


def show(message: Bool) -> None:
    GPIO.output(LED, message.data)


def main() -> None:
    rospy.init_node("led_actuator")
    GPIO.setmode(GPIO.BCM)
    GPIO.setup(list(ALL_LEDS), GPIO.OUT, initial=GPIO.LOW)
    subscriber = rospy.Subscriber("/button_state", Bool, show)
    rospy.spin()
    # Stop the callbacks before releasing the pins.
    subscriber.unregister()
    GPIO.cleanup()


if __name__ == "__main__":
    main()
