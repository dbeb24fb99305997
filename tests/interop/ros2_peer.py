"""A node of real ROS 2, run by a Python that has rclpy: does what lines of JSON on its input say, prints what came.

{"op": "subscribe", "topic": ..., "type": "std_msgs/String", "reliable": true, "latched": false}
{"op": "publish", "topic": ..., "type": ..., "data": hex of the CDR, "count": 1, "latched": false}: once a subscriber is there
{"op": "serve", "topic": ..., "type": ..., "fields": {...}}: a service that answers so; {} in a text is the request's first
field; with "silent" it never answers
{"op": "call", "topic": ..., "type": ..., "fields": [{...}, ...]}: once the service is there; says each answer, in any order
{"op": "call_raw", "topic": ..., "type": ..., "data": hex of the CDR}: the same, with all fields
{"op": "close", "topic": ...}: its publisher, subscription, service and client
"""

import importlib
import json
import sys
import threading
import time

import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.task import Future

SAYING = threading.Lock()


def profile(command):
    return QoSProfile(
        depth=command.get("depth", 100),
        reliability=ReliabilityPolicy.RELIABLE
        if command.get("reliable", True)
        else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if command.get("latched") else DurabilityPolicy.VOLATILE,
    )


def class_of(name, kind="msg"):
    package, _, short = name.partition("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), short)


def made(class_, fields):
    found = class_()
    for name, value in fields.items():
        setattr(found, name, value)
    return found


def fields_of(message):
    return {name: str(getattr(message, name)) for name in message.get_fields_and_field_types()}


def say(**fields):
    # In one piece: two threads say something.
    with SAYING:
        print(json.dumps(fields), flush=True)


class Peer:
    """The node; a method for each operation, which gets the command."""

    def __init__(self):
        self.node = rclpy.create_node("peer", enable_rosout=False, start_parameter_services=False)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.thread = threading.Thread(target=self.spin)
        self.thread.start()
        self.publishers, self.subscriptions, self.services, self.clients = {}, {}, {}, {}

    def spin(self):
        try:
            self.executor.spin()
        except ExternalShutdownException:
            pass

    def end(self):
        self.executor.shutdown()
        self.thread.join()
        self.node.destroy_node()

    def subscribe(self, topic, command):
        self.subscriptions[topic] = self.node.create_subscription(
            class_of(command["type"]),
            topic,
            lambda data: say(op="message", topic=topic, data=data.hex()),
            profile(command),
            raw=True,
        )

    def publish(self, topic, command):
        publisher = self.publishers.get(topic)
        if publisher is None:
            publisher = self.publishers[topic] = self.node.create_publisher(
                class_of(command["type"]), topic, profile(command)
            )
        while not command.get("latched") and not publisher.get_subscription_count():
            time.sleep(0.02)
        for _ in range(command.get("count", 1)):
            publisher.publish(bytes.fromhex(command["data"]))

    def serve(self, topic, command):
        async def answer(request, response):
            fields = fields_of(request)
            say(op="request", topic=topic, fields=fields)
            if command.get("silent"):
                await Future(executor=self.executor)
            for name, value in command["fields"].items():
                first = next(iter(fields.values()), "")
                setattr(response, name, value.format(first) if isinstance(value, str) else value)
            return response

        self.services[topic] = self.node.create_service(
            class_of(command["type"], "srv"), topic, answer, callback_group=ReentrantCallbackGroup()
        )

    def call(self, topic, command):
        class_ = class_of(command["type"], "srv").Request
        self.send(topic, command, [made(class_, each) for each in command["fields"]])

    def call_raw(self, topic, command):
        class_ = class_of(command["type"], "srv").Request
        self.send(topic, command, [deserialize_message(bytes.fromhex(command["data"]), class_)])

    def send(self, topic, command, requests):
        if topic not in self.clients:
            self.clients[topic] = self.node.create_client(
                class_of(command["type"], "srv"), topic, qos_profile=QoSProfile(depth=1000)
            )
        self.clients[topic].wait_for_service()

        def answered(future):
            response = future.result()
            say(op="answer", topic=topic, fields=fields_of(response), data=serialize_message(response).hex())

        for request in requests:
            self.clients[topic].call_async(request).add_done_callback(answered)

    def close(self, topic, _):
        for parts, destroy in (
            (self.publishers, self.node.destroy_publisher),
            (self.subscriptions, self.node.destroy_subscription),
            (self.services, self.node.destroy_service),
            (self.clients, self.node.destroy_client),
        ):
            if topic in parts:
                destroy(parts.pop(topic))


def main():
    rclpy.init(args=[])
    peer = Peer()
    say(op="ready")
    for line in sys.stdin:
        command = json.loads(line)
        getattr(peer, command["op"])(command["topic"], command)
        say(op="done", of=command["op"], topic=command["topic"])
    peer.end()
    rclpy.try_shutdown()


main()
