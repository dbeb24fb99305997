"""A roslibpy client. `roslibpy_peer.py PORT` performs the test's operations on the bridge, and prints the results as JSON.

It prints a second line when the bridge has been replaced.
"""

from __future__ import annotations

import base64
import json
import queue
import sys
import threading
from typing import Any

import roslibpy
import roslibpy.ros1.actionlib
import roslibpy.tf

SECONDS = 150


class Box:
    """Stores the first value that a callback receives."""

    def __init__(self) -> None:
        self._arrived = threading.Event()
        self._value: Any = None

    def __call__(self, value: Any) -> None:
        if not self._arrived.is_set():
            self._value = value
            self._arrived.set()

    def get(self) -> Any:
        if not self._arrived.wait(SECONDS):
            raise TimeoutError("nothing came")
        return self._value


def offer_action(client: Any) -> None:
    """Start an action server."""
    server = roslibpy.ros1.actionlib.SimpleActionServer(
        client, "/py_fibonacci", "actionlib_tutorials/FibonacciAction"
    )

    def execute(request: Any) -> None:
        server.set_succeeded({"sequence": list(range(request["order"]))})

    server.start(execute)


def main() -> None:
    """Run all operations, and print the results."""
    client = roslibpy.Ros(host="127.0.0.1", port=int(sys.argv[1]))
    client.run(timeout=SECONDS)
    done: dict[str, Any] = {}

    latched: queue.Queue[Any] = queue.Queue()
    listener = roslibpy.Topic(client, "/latched", "std_msgs/String")
    listener.subscribe(latched.put)
    done["latched"] = latched.get(timeout=SECONDS)

    box = Box()
    image = roslibpy.Topic(client, "/image", "sensor_msgs/Image", queue_length=1)
    image.subscribe(box)
    found = box.get()
    done["image"] = [found["width"], len(base64.b64decode(found["data"]))]
    copy = roslibpy.Topic(client, "/image_copy", "sensor_msgs/Image")
    copy.advertise()
    copy.publish(roslibpy.Message(found))

    talker = roslibpy.Topic(client, "/from_roslibpy", "std_msgs/String")
    talker.advertise()
    talker.publish(roslibpy.Message({"data": "hello"}))

    service = roslibpy.Service(client, "/set", "std_srvs/SetBool")
    done["service"] = dict(service.call(roslibpy.ServiceRequest({"data": True}), timeout=SECONDS))

    offered = roslibpy.Service(client, "/ours", "std_srvs/SetBool")

    def answer(request: Any, response: Any) -> bool:
        response["success"], response["message"] = request["data"], "from roslibpy"
        return True

    offered.advertise(answer)

    parameter = roslibpy.Param(client, "/speed")
    parameter.set(1.5)
    done["parameter"] = parameter.get()
    parameter.delete()
    done["topics"] = "/latched" in client.get_topics()
    done["type"] = client.get_topic_type("/latched")
    done["time"] = client.get_time()["secs"] > 0
    done["details"] = client.get_message_details("std_msgs/String")["typedefs"][0]["fieldnames"]
    done["nodes"] = "/peer" in client.get_nodes()

    action = roslibpy.ros1.actionlib.ActionClient(client, "/fibonacci", "actionlib_tutorials/FibonacciAction")
    goal = roslibpy.ros1.actionlib.Goal(action, roslibpy.Message({"order": 3}))
    goal.send(timeout=SECONDS)
    done["action"] = goal.wait(SECONDS)["sequence"]

    offer_action(client)
    box = Box()
    transforms = roslibpy.tf.TFClient(
        client, fixed_frame="/world", angular_threshold=0.0, translation_threshold=0.0
    )
    transforms.subscribe("camera", box)
    done["tf"] = box.get()["translation"]["x"]

    print(json.dumps(done), flush=True)
    again = latched.get(timeout=SECONDS)
    request = roslibpy.ServiceRequest({"data": False})
    print(json.dumps([again, dict(service.call(request, timeout=SECONDS))]), flush=True)
    sys.stdin.readline()
    client.terminate()


if __name__ == "__main__":
    main()
