#!/usr/bin/env python3
import time
import unittest


class Sleepy(unittest.TestCase):
    def test_sleep(self):
        time.sleep(60)


if __name__ == "__main__":
    import rosunit

    rosunit.unitrun("tested", "sleepy", Sleepy)
