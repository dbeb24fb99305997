#!/usr/bin/env python3
"""The scanner as a button: the LED is lit while something is nearer than 0.2 m."""

from panel import PanelTest


class ScannerLightsLed(PanelTest):
    def test_led_follows_person(self) -> None:
        # Their nearest leg is 0.15 m nearer than they are.
        self.walk_to(0.3)
        self.wait_for_lit(7)
        self.walk_to(0.5)
        self.wait_for_lit()


if __name__ == "__main__":
    import rostest

    rostest.rosrun("rpi_feros", "sick_dist_switch", ScannerLightsLed)
