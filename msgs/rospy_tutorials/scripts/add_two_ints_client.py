#!/usr/bin/env python3
"""Request the sum of two integers of add_two_ints. Source: http://wiki.ros.org/rospy_tutorials."""

import random
import sys

import rospy
from genpy import SerializationError
from rospy_tutorials.srv import AddTwoInts


def main(words: list[str]) -> int:
    try:
        x, y = (int(word) for word in words) if words else (random.randint(-50000, 50000) for _ in range(2))
    except ValueError:
        print("add_two_ints_client.py [x y]: two integers, or none for two at random")
        return 1

    try:
        print(f"Requesting {x}+{y}")
        rospy.wait_for_service("add_two_ints")
        print(f"{x} + {y} = {rospy.ServiceProxy('add_two_ints', AddTwoInts)(x, y).sum}")
    except KeyboardInterrupt:
        return 130  # Ctrl-C while it waited
    except (rospy.ServiceException, SerializationError) as error:
        print(f"Service call failed: {error}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(rospy.myargv()[1:]))
