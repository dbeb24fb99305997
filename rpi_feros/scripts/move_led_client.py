#!/usr/bin/env python3
"""Call /move_led at each press: button 1 moves the lit LED to the left, button 2 to the right."""

import rospy
from RPi import GPIO
from std_srvs.srv import SetBool

TO_THE_RIGHT = {11: False, 12: True}  # BCM pin numbers
BOUNCE_TIME = 200  # milliseconds


def main() -> None:
    rospy.init_node("button_monitor")
    GPIO.setmode(GPIO.BCM)
    GPIO.setup(list(TO_THE_RIGHT), GPIO.IN)
    move_led = rospy.ServiceProxy("/move_led", SetBool)

    def pressed(channel: int) -> None:
        try:
            rospy.loginfo(move_led(TO_THE_RIGHT[channel]).message)
        except rospy.ServiceException as error:
            rospy.logwarn("button %d: %s", channel, error)
        except rospy.ROSInterruptException:
            pass  # Ctrl-C during the call

    try:
        move_led.wait_for_service()
        for button in TO_THE_RIGHT:
            GPIO.add_event_detect(button, GPIO.RISING, callback=pressed, bouncetime=BOUNCE_TIME)
        rospy.loginfo("Press the buttons.")
        rospy.spin()
    except rospy.ROSInterruptException:
        pass  # Ctrl-C while waiting for the service
    finally:
        GPIO.cleanup()


if __name__ == "__main__":
    main()
