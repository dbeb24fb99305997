#!/usr/bin/env python3
import sys
import unittest


class Good(unittest.TestCase):
    def test_one(self):
        print("to stdout: <&> \x1b[1m")

    def test_two(self):
        sys.stderr.write("to stderr\n")


if __name__ == "__main__":
    import rosunit

    rosunit.unitrun("tested", "named_by_the_file", Good)
