#!/usr/bin/env python3
"""Serve /move_led: move the lit LED to the right (True) or to the left (False), wrapping around at the end of the row."""

import threading

import rospy
from RPi import GPIO
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse

LEDS = range(2, 8)  # BCM pin numbers


class Row:
    """Six LEDs, of which one is lit."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._lit = 0
        GPIO.output(LEDS[self._lit], True)

    def move(self, request: SetBoolRequest) -> SetBoolResponse:
        # Two clients may call at the same time.
        with self._lock:
            GPIO.output(LEDS[self._lit], False)
            self._lit = (self._lit + (1 if request.data else -1)) % len(LEDS)
            GPIO.output(LEDS[self._lit], True)
            return SetBoolResponse(success=True, message=f"GPIO {LEDS[self._lit]} is lit.")


def main() -> None:
    rospy.init_node("led_actuator")
    GPIO.setmode(GPIO.BCM)
    GPIO.setup(list(LEDS), GPIO.OUT, initial=GPIO.LOW)
    service = rospy.Service("/move_led", SetBool, Row().move)
    rospy.spin()
    service.shutdown()
    GPIO.cleanup()


if __name__ == "__main__":
    main()
