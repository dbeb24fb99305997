#!/usr/bin/env python3
"""With the service, each press of the button toggles the LED."""

from panel import PanelTest


class ButtonTogglesLed(PanelTest):
    def test_each_press_toggles(self) -> None:
        self.push(11, led=2)
        self.push(11, led=2, level=0)


if __name__ == "__main__":
    import rostest

    rostest.rosrun("rpi_feros", "led_service", ButtonTogglesLed)
