#!/usr/bin/env python3
"""Serve /set_led_zone_state: light the two LEDs with a zone's colour."""

import rospy
from RPi import GPIO
from rpi_msgs.srv import safetyZone, safetyZoneRequest, safetyZoneResponse

ZONES = (("green", (2, 3)), ("yellow", (4, 5)), ("red", (6, 7)))  # BCM pin numbers
ALL_LEDS = list(range(2, 8))


def set_zone(request: safetyZoneRequest) -> safetyZoneResponse:
    if not 0 <= request.zone < len(ZONES):
        return safetyZoneResponse(
            success=False, message=f"Zone {request.zone} does not exist: 0 to {len(ZONES) - 1}."
        )
    colour, leds = ZONES[request.zone]
    GPIO.output(ALL_LEDS, [led in leds for led in ALL_LEDS])
    return safetyZoneResponse(success=True, message=f"The zone is {colour}.")


def main() -> None:
    rospy.init_node("led_zone")
    GPIO.setmode(GPIO.BCM)
    GPIO.setup(ALL_LEDS, GPIO.OUT, initial=GPIO.LOW)
    service = rospy.Service("/set_led_zone_state", safetyZone, set_zone)
    rospy.spin()
    service.shutdown()
    GPIO.cleanup()


if __name__ == "__main__":
    main()
