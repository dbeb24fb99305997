#!/usr/bin/env python3
"""Two buttons move the lit LED to the left and to the right, wrapping around at the end of the row."""

from panel import PanelTest


class ButtonsMoveLed(PanelTest):
    def test_left_and_right(self) -> None:
        self.wait_for_lit(2)
        self.push(11, led=7)
        self.push(12, led=2)
        self.push(12, led=3)
        self.wait_for_lit(3)


if __name__ == "__main__":
    import rostest

    rostest.rosrun("rpi_feros", "move_led", ButtonsMoveLed)
