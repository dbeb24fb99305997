#!/usr/bin/env python3
"""The test of all pins lights each LED once, and then shows the buttons' states."""

from panel import PanelTest


class AllPins(PanelTest):
    def test_leds_and_buttons(self) -> None:
        self.wait_for_lit(7)
        self.board.press(12)
        self.wait_for_lit(3)
        self.board.press(11)
        self.wait_for_lit(2, 3)


if __name__ == "__main__":
    import rostest

    rostest.rosrun("rpi_feros", "run_debug", AllPins)
