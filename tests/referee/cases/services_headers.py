"""Requests and responses that start with a header: which side sets its seq and a frame_id of None."""

import rospy
from geometry_msgs.msg import PoseStamped
from referee import outcome, show


class Turn:
    """A service class as genpy makes them, whose request and response are stamped."""

    _type = "case/Turn"
    _md5sum = PoseStamped._md5sum
    _request_class = PoseStamped
    _response_class = PoseStamped


rospy.init_node("case", argv=[])
proxy = rospy.ServiceProxy("turn", Turn)
for _ in range(2):
    outcome("not there", lambda: proxy(PoseStamped()))

seen = []
kept = PoseStamped()


def turn(request):
    seen.append((request.header.seq, request.header.frame_id))
    if request.header.frame_id == "error":
        raise ValueError("x")
    if request.header.frame_id == "nothing":
        return None
    if request.header.frame_id == "fields":
        return {"pose": kept.pose}
    kept.header.frame_id = {"none": None, "number": 5}.get(request.header.frame_id, "kept")
    kept.header.seq = 77
    return kept


service = rospy.Service("turn", Turn, turn)


def call(frame_id, client=proxy):
    request = PoseStamped()
    request.header.seq = 50
    request.header.frame_id = frame_id
    try:
        response = client(request)
        return (response.header.seq, response.header.frame_id), request.header.seq, request.header.frame_id
    except rospy.ServiceException as error:
        return type(error).__name__, str(error).partition(": ")[0], request.header.seq


for frame_id in ("", "a", None, 5, "error", "b", "nothing", "c", "fields", "none", "number", "d"):
    outcome(repr(frame_id), lambda: call(frame_id))
persistent = rospy.ServiceProxy("turn", Turn, persistent=True)
for frame_id in ("a", "error", "b"):
    outcome(f"persistent {frame_id}", lambda: call(frame_id, persistent))
show("requests", seen)

service.shutdown()
service = rospy.Service("turn", Turn, turn)
outcome("offered again", lambda: call("a"))
