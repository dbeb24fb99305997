#!/usr/bin/env python3
"""With the action, LEDs are lit one after the other until a person is closer to the scanner than 0.2 m."""

import rospy
from actionlib_msgs.msg import GoalStatus
from panel import LEDS, PATIENCE, PanelTest
from rpi_msgs.msg import runningLedActionResult


class RunningLeds(PanelTest):
    def test_person_stops_the_run(self) -> None:
        rospy.init_node("test_run_led")
        results: list[runningLedActionResult] = []
        rospy.Subscriber("/run_led/result", runningLedActionResult, results.append)
        lit = []
        for edge in self.board.watch(LEDS, timeout=PATIENCE):
            lit += [edge.pin] if edge.level else []
            if len(lit) == 8:
                break
        first = lit[0] - LEDS[0]
        self.assertEqual(lit, [LEDS[(first + step) % len(LEDS)] for step in range(8)])
        self.walk_to(0.3)
        deadline = rospy.get_time() + PATIENCE
        while not results and rospy.get_time() < deadline:
            rospy.sleep(0.05)
        self.assertEqual([result.status.status for result in results], [GoalStatus.PREEMPTED])
        self.assertLess(results[0].result.finalRun, rospy.get_param("/number_of_runs"))
        self.wait_for_lit()


if __name__ == "__main__":
    import rostest

    rostest.rosrun("rpi_feros", "run_led", RunningLeds)
