"""A node of real ROS 2, run by a Python that has rclpy: does what lines of JSON on its input say, prints what came.

{"op": "subscribe", "topic": ..., "type": "std_msgs/String", "reliable": true, "latched": false}
{"op": "publish", "topic": ..., "type": ..., "data": hex of the CDR, "count": 1, "latched": false}: once a subscriber is there
{"op": "close", "topic": ...}: its publisher and subscription
"""

import importlib
import json
import sys
import threading
import time

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

SAYING = threading.Lock()


def profile(command):
    return QoSProfile(
        depth=command.get("depth", 100),
        reliability=ReliabilityPolicy.RELIABLE
        if command.get("reliable", True)
        else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if command.get("latched") else DurabilityPolicy.VOLATILE,
    )


def class_of(name):
    package, _, short = name.partition("/")
    return getattr(importlib.import_module(f"{package}.msg"), short)


def say(**fields):
    # In one piece: two threads say something.
    with SAYING:
        print(json.dumps(fields), flush=True)


def main():
    rclpy.init(args=[])
    node = rclpy.create_node("peer", enable_rosout=False, start_parameter_services=False)
    executor = SingleThreadedExecutor()
    executor.add_node(node)

    def spin():
        try:
            executor.spin()
        except ExternalShutdownException:
            pass

    thread = threading.Thread(target=spin)
    thread.start()
    publishers, subscriptions = {}, {}
    say(op="ready")

    for line in sys.stdin:
        command = json.loads(line)
        topic = command["topic"]
        if command["op"] == "subscribe":
            subscriptions[topic] = node.create_subscription(
                class_of(command["type"]),
                topic,
                lambda data, topic=topic: say(op="message", topic=topic, data=data.hex()),
                profile(command),
                raw=True,
            )
        elif command["op"] == "publish":
            publisher = publishers.get(topic)
            if publisher is None:
                publisher = publishers[topic] = node.create_publisher(
                    class_of(command["type"]), topic, profile(command)
                )
            while not command.get("latched") and not publisher.get_subscription_count():
                time.sleep(0.02)
            for _ in range(command.get("count", 1)):
                publisher.publish(bytes.fromhex(command["data"]))
        elif command["op"] == "close":
            if topic in publishers:
                node.destroy_publisher(publishers.pop(topic))
            if topic in subscriptions:
                node.destroy_subscription(subscriptions.pop(topic))
        say(op="done", of=command["op"], topic=topic)

    executor.shutdown()
    thread.join()
    node.destroy_node()
    rclpy.try_shutdown()


main()
