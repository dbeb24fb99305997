#!/usr/bin/env python3
"""A test that is a node: it subscribes to the talker, and reads rostest.py's report of it."""

import unittest

import rospy
import rostest
from std_msgs.msg import String


class Listens(unittest.TestCase):
    def test_hears(self):
        rospy.init_node("listens")
        self.assertEqual(rospy.wait_for_message("/chatter", String, 30).data, "hello")
        self.assertTrue(rostest.is_publisher("/chatter", "/talker"))
        self.assertTrue(rostest.is_subscriber("/orders", "/talker"))
        self.assertFalse(rostest.is_subscriber("/chatter", "/talker"))
        self.assertEqual(rospy.get_param("~who"), "you")
        self.assertEqual(rospy.get_name(), "/ns/listener")


if __name__ == "__main__":
    rostest.rosrun("tested", "listens", Listens)
