#!/usr/bin/env python3
import unittest


class Bad(unittest.TestCase):
    def test_error(self):
        raise KeyError("lost")

    def test_fail(self):
        self.assertEqual(1, 2, "one is not two")

    def test_pass(self):
        pass

    @unittest.skip("not today")
    def test_skip(self):
        pass


if __name__ == "__main__":
    import rostest

    rostest.rosrun("tested", "named_by_the_file", Bad)
