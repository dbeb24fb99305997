#!/usr/bin/env python3
"""Serve the action /run_led: light the LEDs one after the other, as many times as the goal requests, unless it is cancelled."""

import actionlib
import rospy
from RPi import GPIO
from rpi_msgs.msg import runningLedAction, runningLedFeedback, runningLedGoal, runningLedResult

LEDS = list(range(2, 8))  # BCM pin numbers


class Runner:
    """Lights the LEDs one after the other, /led_frequency per second."""

    def __init__(self) -> None:
        self._frequency = rospy.get_param("/led_frequency", 6)  # Hz
        self._server = actionlib.SimpleActionServer(
            "run_led", runningLedAction, self._execute, auto_start=False
        )
        self._server.start()

    def _execute(self, goal: runningLedGoal) -> None:
        try:
            self._run(goal.numberOfRuns)
        except rospy.ROSInterruptException:
            pass  # Ctrl-C while sleeping
        else:
            GPIO.output(LEDS, False)

    def _run(self, runs: int) -> None:
        rate = rospy.Rate(self._frequency)
        for done in range(runs):
            # Publish at the start of a run, because feedback sent right before the result may arrive after it and be
            # lost.
            self._server.publish_feedback(runningLedFeedback(currentRun=done + 1))
            for led in LEDS:
                if self._server.is_preempt_requested():
                    self._server.set_preempted(runningLedResult(finalRun=done), "Goal preempted.")
                    return
                GPIO.output(LEDS, [each == led for each in LEDS])
                rate.sleep()
        self._server.set_succeeded(runningLedResult(finalRun=runs))


def main() -> None:
    rospy.init_node("ledrun_server")
    GPIO.setmode(GPIO.BCM)
    GPIO.setup(LEDS, GPIO.OUT, initial=GPIO.LOW)
    Runner()
    rospy.loginfo("Action server started. Ready to get goals.")
    rospy.spin()
    GPIO.cleanup()


if __name__ == "__main__":
    main()
