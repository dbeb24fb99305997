#!/usr/bin/env python3
"""With the topic, the LED is lit while the button is held."""

from panel import PanelTest


class ButtonLightsLed(PanelTest):
    def test_led_follows_button(self) -> None:
        self.board.press(11)
        self.wait_for_lit(7)
        self.board.release(11)
        self.wait_for_lit()


if __name__ == "__main__":
    import rostest

    rostest.rosrun("rpi_feros", "rpi_led", ButtonLightsLed)
