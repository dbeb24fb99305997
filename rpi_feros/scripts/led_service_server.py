#!/usr/bin/env python3
"""Serve /set_led_state: switch the first green LED on or off."""

import rospy
from RPi import GPIO
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse

LED = 2  # BCM pin number
ALL_LEDS = range(2, 8)


def set_led(request: SetBoolRequest) -> SetBoolResponse:
    GPIO.output(LED, request.data)
    return SetBoolResponse(success=True, message="Successfully changed LED state.")


def main() -> None:
    rospy.init_node("led_actuator")
    GPIO.setmode(GPIO.BCM)
    GPIO.setup(list(ALL_LEDS), GPIO.OUT, initial=GPIO.LOW)
    service = rospy.Service("/set_led_state", SetBool, set_led)
    rospy.loginfo("Service server started. Ready to get request.")
    rospy.spin()
    service.shutdown()
    GPIO.cleanup()


if __name__ == "__main__":
    main()
