#!/usr/bin/env python3
"""Test all pins: light the LEDs one after the other, then show each button on the LED above it, until Ctrl-C."""

import rospy
from RPi import GPIO

LEDS = list(range(2, 8))  # BCM pin numbers
LED_OF_BUTTON = {11: 2, 12: 3}
STEP = 0.3  # seconds


def main() -> None:
    rospy.init_node("run_debug")
    GPIO.setmode(GPIO.BCM)
    GPIO.setup(LEDS, GPIO.OUT, initial=GPIO.LOW)
    GPIO.setup(list(LED_OF_BUTTON), GPIO.IN)
    try:
        for led in LEDS:
            rospy.loginfo("LED on GPIO %d", led)
            GPIO.output(led, True)
            rospy.sleep(STEP)
            GPIO.output(led, False)
        rospy.loginfo("Press the buttons.")
        rate = rospy.Rate(20)  # Hz
        while not rospy.is_shutdown():
            for button, led in LED_OF_BUTTON.items():
                GPIO.output(led, GPIO.input(button))
            rate.sleep()
    except rospy.ROSInterruptException:
        pass  # Ctrl-C while sleeping
    finally:
        GPIO.cleanup()


if __name__ == "__main__":
    main()
