"""The permitted results of a handler, and the client's responses."""

import rospy
from referee import outcome
from std_srvs.srv import Empty, EmptyResponse, SetBool, SetBoolRequest, SetBoolResponse, TriggerResponse

rospy.init_node("case", argv=[])


class Like:
    success = True
    message = "duck"


returned = {
    "response": SetBoolResponse(True, "r"),
    "empty response": SetBoolResponse(),
    "dict": {"success": True, "message": "d"},
    "half a dict": {"success": True},
    "empty dict": {},
    "dict with an unknown field": {"success": True, "nothing": 1},
    "list": [True, "l"],
    "tuple": (True, "t"),
    "one too few": [True],
    "one too many": [True, "a", "b"],
    "empty list": [],
    "None": None,
    "str": "text",
    "number": 5,
    "bool": True,
    "bytes": b"raw",
    "another class": TriggerResponse(True, "trigger"),
    "a request": SetBoolRequest(True),
    "the class": SetBoolResponse,
    "an object": Like(),
    "wrong types": SetBoolResponse("no bool", 5),
    "wrong types in a list": ["no bool", 5],
    "wrong types in a dict": {"success": 1, "message": 7.5},
    "int for bool": [1, "i"],
    "unicode": [True, "zażółć"],
    "nested list": [[True, "x"]],
    "generator": (x for x in (True, "x")),
}
service = rospy.Service("answers", SetBool, lambda request: returned[current])
proxy = rospy.ServiceProxy("answers", SetBool)
for current in returned:
    outcome(current, lambda: proxy(True))

nothing = rospy.Service("nothing", Empty, lambda request: nothing_returned)
empty = rospy.ServiceProxy("nothing", Empty)
for label, nothing_returned in (
    ("Empty: response", EmptyResponse()),
    ("Empty: dict", {}),
    ("Empty: list", []),
    ("Empty: tuple", ()),
    ("Empty: None", None),
    ("Empty: str", ""),
    ("Empty: True", True),
):
    outcome(label, empty)
