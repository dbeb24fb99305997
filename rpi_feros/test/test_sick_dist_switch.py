#!/usr/bin/env python3
"""The scanner acts as a button: the LED is lit while an object is closer than 0.2 m."""

from panel import PanelTest


class ScannerLightsLed(PanelTest):
    def test_led_follows_person(self) -> None:
        # The person's nearest leg is 0.15 m closer than the person's position.
        self.walk_to(0.3)
        self.wait_for_lit(7)
        self.walk_to(0.5)
        self.wait_for_lit()


if __name__ == "__main__":
    import rostest

    rostest.rosrun("rpi_feros", "sick_dist_switch", ScannerLightsLed)
