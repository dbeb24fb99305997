#!/usr/bin/env python3
"""Serve add_two_ints, which returns the sum of two integers. Source: http://wiki.ros.org/rospy_tutorials."""

import rospy
from rospy_tutorials.srv import AddTwoInts, AddTwoIntsRequest, AddTwoIntsResponse


def add(request: AddTwoIntsRequest) -> AddTwoIntsResponse:
    response = AddTwoIntsResponse(request.a + request.b)
    print(f"Returning [{request.a} + {request.b} = {response.sum}]", flush=True)
    return response


if __name__ == "__main__":
    rospy.init_node("add_two_ints_server")
    rospy.Service("add_two_ints", AddTwoInts, add)
    rospy.spin()
