#!/usr/bin/env python3
"""The scanner selects the colour: green beyond 0.4 m, yellow in between, red closer than 0.2 m."""

from panel import PanelTest


class ScannerShowsZone(PanelTest):
    def test_each_zone_has_its_colour(self) -> None:
        self.wait_for_lit(2, 3)
        self.walk_to(0.45)
        self.wait_for_lit(4, 5)
        self.walk_to(0.3)
        self.wait_for_lit(6, 7)
        self.walk_to(2.0)
        self.wait_for_lit(2, 3)


if __name__ == "__main__":
    import rostest

    rostest.rosrun("rpi_feros", "sick_zone", ScannerShowsZone)
