"""Responses of one field: values that are accepted in place of the response. Also arrays and messages as fields."""

import rospy
from nav_msgs.msg import OccupancyGrid
from nav_msgs.srv import GetMap, GetMapResponse
from referee import outcome
from roscpp.msg import Logger
from roscpp.srv import GetLoggers, GetLoggersResponse
from tf2_msgs.srv import FrameGraph, FrameGraphResponse

rospy.init_node("case", argv=[])


def offer(name, service_class, values):
    """Offer a service for each value in turn."""
    current = []
    service = rospy.Service(name, service_class, lambda request: current[0])
    proxy = rospy.ServiceProxy(name, service_class)
    for label, value in values.items():
        current[:] = [value]
        outcome(name + " " + label, lambda: proxy())
    service.shutdown()


offer(
    "text",
    FrameGraph,
    {
        "str": "a b",
        "empty str": "",
        "list": ["x"],
        "tuple": ("x",),
        "dict": {"frame_yaml": "y"},
        "response": FrameGraphResponse("z"),
        "int": 5,
        "None": None,
        "list of an int": [5],
        "empty list": [],
        "two": ["x", "y"],
        "float": 1.5,
    },
)
map_ = OccupancyGrid()
map_.info.width = 2
map_.data = [1, -1]
offer("map", GetMap, {"message": map_, "list": [map_], "response": GetMapResponse(map_)})
offer(
    "loggers",
    GetLoggers,
    {
        "list of list": [[Logger("a", "b")]],
        "list of messages": [Logger("a", "b")],
        "empty list": [],
        "list of empty list": [[]],
        "message": Logger("a", "b"),
        "response": GetLoggersResponse([Logger("a", "b"), Logger("c", "d")]),
        "two messages": [Logger("a", "b"), Logger("c", "d")],
        "tuple of tuple": ((Logger("a", "b"),),),
        "dict": {"loggers": [Logger("a", "b")]},
    },
)
