#!/usr/bin/env python3
"""Passes from the second run on: it creates a file in ROS_HOME."""

import os
import unittest


class SecondTry(unittest.TestCase):
    def test_twice(self):
        note = os.path.join(os.environ["ROS_HOME"], "tried")
        was_tried = os.path.exists(note)
        open(note, "w").close()
        self.assertTrue(was_tried)


if __name__ == "__main__":
    import rosunit

    rosunit.unitrun("tested", "second_try", SecondTry)
