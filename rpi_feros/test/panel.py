"""Operates the workshop's panel in a test: presses its buttons, moves the person in front of its scanner, waits for its LEDs."""

import time
import unittest

from minirospy.board.board import Board

LEDS = range(2, 8)  # BCM pin numbers
PATIENCE = 40.0  # seconds
BOUNCE = 0.6  # seconds, longer than the programs' bounce time


class PanelTest(unittest.TestCase):
    """A test with a virtual board."""

    def setUp(self) -> None:
        self.board = Board()
        self.addCleanup(self.board.close)
        self.is_watched = False

    def lit(self) -> list[int]:
        return [led for led in LEDS if self.board.get(led)]

    def wait_for_lit(self, *leds: int) -> None:
        """Wait until these LEDs are lit, and no others."""
        edges = self.board.watch(LEDS, timeout=PATIENCE)
        if self.lit() != list(leds) and not any(self.lit() == list(leds) for _ in edges):
            self.fail(f"{self.lit()} are lit instead of {list(leds)}")

    def push(self, button: int, led: int, level: int = 1) -> None:
        """Press a button, repeatedly until a program watches it, so that an LED is switched."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if self.is_watched:
                time.sleep(BOUNCE)
            # Once the program watches the button, wait longer: a second press would switch back an LED that is only
            # late.
            edges = self.board.watch([led], timeout=10.0 if self.is_watched else 0.7)
            self.board.press(button)
            is_switched = any(edge.level == level for edge in edges)
            self.board.release(button)
            if is_switched:
                self.is_watched = True
                return
        self.fail(f"button {button} did not switch LED {led}")

    def walk_to(self, ahead: float) -> None:
        """Move the person to this distance in front of the scanner, in metres."""
        self.board.move_person((ahead, 0.0))
