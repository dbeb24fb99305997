#!/usr/bin/env python3
"""Toggle the LED through /set_led_state each time button 1 is pressed."""

import rospy
from RPi import GPIO
from std_srvs.srv import SetBool

BUTTON = 11  # BCM pin number
BOUNCE_TIME = 500  # milliseconds


class Toggle:
    """Requests the opposite state from the service at each call."""

    def __init__(self) -> None:
        self._set_led_state = rospy.ServiceProxy("/set_led_state", SetBool)
        self._is_on = False

    def pressed(self, channel: int) -> None:
        try:
            response = self._set_led_state(not self._is_on)
        except rospy.ServiceException as error:
            rospy.logwarn("button %d: %s", channel, error)
            return
        except rospy.ROSInterruptException:
            return  # Ctrl-C during the call
        self._is_on = not self._is_on
        rospy.loginfo(response.message)


def main() -> None:
    rospy.init_node("button_monitor")
    GPIO.setmode(GPIO.BCM)
    GPIO.setup(BUTTON, GPIO.IN)
    try:
        rospy.wait_for_service("/set_led_state")
        toggle = Toggle()
        GPIO.add_event_detect(BUTTON, GPIO.RISING, callback=toggle.pressed, bouncetime=BOUNCE_TIME)
        rospy.spin()
    except rospy.ROSInterruptException:
        pass  # Ctrl-C while waiting for the service
    finally:
        GPIO.cleanup()


if __name__ == "__main__":
    main()
